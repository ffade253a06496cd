"""core/row_search.py: which rows a loop over spans visits, and how often."""

import itertools

import numpy as np
import pytest

from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import evaluate, record_function
from reflect_addon.core.row_search import ALL, AT_ONCE, Among, Span, each_row, spans

EVERY = 4  # rows that may be met, where some are chosen first: one in so many
SCENE = Asset("a", "", {}, {}, options={"count": 12, "glossy": 5, "lamps": 3, "mirrors": 4})


def visited(rows, choose: bool, asked) -> list[set[int]]:
    """The rows that each ray visits; asked: (N, K) bools, of spans whose `asked` is the number of a column. No row twice."""
    count = max(span.last for span in rows)

    def kernel(k, scope, a, b, c):
        columns = (a > 0.5, b > 0.5, c > 0.5)
        given = [Span(s.first, s.last, s.asked if isinstance(s.asked, bool) else columns[s.asked]) for s in rows]

        def meet(asset, row, found):
            distance, seen, high, times = found
            # Whole numbers up to 2**24 are exact: rows 0 to 23 as bits of one, the others of another.
            low, bit = row < 23.5, k.exp2(k.select(row < 23.5, row, row - 24.0))
            return distance, seen + k.select(low, bit, 0.0), high + k.select(low, 0.0, bit), times + 1.0

        may = (lambda asset, row, distance: row - EVERY * k.floor(row * (1 / EVERY)) < 0.5) if choose else None
        seen, high, times = each_row(k, Asset("", "", {}), given, (1.0, 0.0, 0.0, 0.0), meet, may)[1:]
        return {"seen": seen, "high": high, "times": times}

    program = record_function(kernel, {"a": "float", "b": "float", "c": "float"})
    found = evaluate(program, dict(zip("abc", np.asarray(asked, float).T)), Asset("", "", {}))
    bits = [int(low) + (int(high) << 24) for low, high in zip(found["seen"], found["high"])]
    sets = [{row for row in range(count) if number >> row & 1} for number in bits]
    assert [len(s) for s in sets] == list(found["times"])
    return sets


@pytest.mark.parametrize("choose", [False, True])
@pytest.mark.parametrize(
    "rows",
    [
        (Span(0, 5), Span(5, 9), Span(20, 23)),
        (Span(3, 7, 0), Span(9, 10), Span(12, 12, 1), Span(14, 40, 2)),
        (Span(0, 12, 0), Span(13, 30, False), Span(30, 30 + AT_ONCE, 1)),
        (Span(2, 2 + AT_ONCE, 0),),
        (Span(4, 5, 0), Span(8, 9, 1)),
        (Span(7, 8),),
        (Span(7, 7),),
    ],
)
def test_what_is_asked_for_is_visited_once(rows, choose):
    asked = list(itertools.product((False, True), repeat=3))
    found = visited(rows, choose, asked)
    for says, rows_of_ray in zip(asked, found, strict=True):
        wanted = {row for s in rows if (s.asked if isinstance(s.asked, bool) else says[s.asked]) for row in range(s.first, s.last)}
        if choose and sum(s.last - s.first for s in rows if s.asked is not False) > 1:
            wanted = {row for row in wanted if row % EVERY == 0}
        assert rows_of_ray == wanted


def test_kinds_lie_one_after_the_other():
    quads, maps = spans(SCENE, Among(False, True, False, True), (1, 0, 2, 4))
    assert quads == [Span(0, 3), Span(4, 7, False), Span(7, 10), Span(12, 12)]
    assert maps == [Span(3, 4), Span(7, 7, False), Span(10, 12, False), Span(12, 16)]
    everything = [span for kinds in zip(*spans(SCENE, ALL, (1, 0, 2, 4))) for span in kinds]
    assert [row for span in everything for row in range(span.first, span.last)] == list(range(16))
