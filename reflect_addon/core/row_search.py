"""Which rows of `billboard_buf` a ray looks among, and the one loop that visits them [popescu-2006 3.1, step 2].

Problem. Rows lie by kind: what is only lit, lamps, what is glossy, mirrors, and of each its quads before its depth maps. A ray off the reflector looks
among all of them, one off a mirror or a glossy thing among some. With a loop for each kind and each sort of ray a kernel held the search of depth maps
seven times; as shader nodes that is most of a material's 64 KB of constants, and a CPU that draws runs the body even of a loop that does nothing.
Idea. A ray's rows are a list of spans, each asked for or not. One loop counts through those that are, and a number is turned into its row by a choice
among spans. Where a visit is costly, a cheap test chooses rows first, as the bits of a number.
Rows of what moves are loops of their own (moved_rows.py).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from . import moved_rows

# Rows that are chosen from at once, as bits of a number: the logarithms of 2**AT_ONCE - 0.5 and + 0.5 differ by 1e-3, and graphics
# cards' are good to 1e-5.
AT_ONCE = 10


@dataclass(frozen=True)
class Span:
    """Rows first..last-1. asked: whether a ray looks among them, True, False or a bool of the kernel."""

    first: int
    last: int
    asked: object = True


@dataclass(frozen=True)
class Among:
    """The kinds of rows, beside what is only lit, that a ray looks among: each True, False or a bool of the kernel."""

    lamps: object
    glossy: object  # quads
    glossy_maps: object
    mirrors: object


ALL = Among(True, True, True, True)


def spans(asset, among: Among, maps: Sequence[int] = (0, 0, 0, 0)) -> tuple[list[Span], list[Span]]:
    """(quads, depth maps). maps: how many rows of what is only lit, of lamps, glossy things and mirrors are depth maps.
    asset.options: count, mirrors, glossy, lamps; see second_order.answer."""
    count, mirrors, glossy, lamps = (asset.options[name] for name in ("count", "mirrors", "glossy", "lamps"))
    asked = ((True, True), (among.lamps, among.lamps), (among.glossy, among.glossy_maps), (among.mirrors, among.mirrors))
    quads, volumes, high = [], [], 0
    for rows, some, (of_quads, of_maps) in zip((count - glossy - lamps, lamps, glossy, mirrors), maps, asked, strict=True):
        low, high = high, high + rows
        quads.append(Span(low, high - some, of_quads))
        volumes.append(Span(high - some, high, of_maps))
    return quads, volumes


def each_row(k, asset, rows: Sequence[Span], before, meet, may=None):
    """The record after meet(asset, row, record) of the rows that are asked for.

    may(asset, row, distance) -> bool: whether a row can be met before that distance; cheap, and looked at for all rows first, so that `meet`
    is not a step of the loop where it cannot be. For a `meet` that is not cheap itself."""
    runs = [(of, Span(low, high, s.asked)) for s in rows if s.asked is not False for of, low, high in moved_rows.runs(asset, s.first, s.last)]
    still = [(of, span) for of, span in runs if "one_run" not in of.options]
    loops = [(still[0][0], [span for _, span in still])] if still else []
    loops += [(of, [span]) for of, span in runs if "one_run" in of.options]
    for of, some in loops:
        numbered = _Numbered(k, some)
        visit = _alike if may is None or numbered.most == 1 else partial(_chosen, may=may)
        before = visit(k, of, numbered, before, meet)
    return before


class _Numbered:
    """The asked rows of spans, numbered. most: how many there can be; count: how many there are, an int where all are asked for."""

    def __init__(self, k, rows: Sequence[Span]):
        self._k, self._spans = k, _joined(rows)
        sizes = [span.last - span.first for span in self._spans]
        self.most = sum(sizes)
        self._ends, end = [], 0
        for span, size in zip(self._spans, sizes, strict=True):
            end = end + size if span.asked is True else k.name("end", end + k.select(span.asked, float(size), 0.0))
            self._ends.append(end)
        self.count = end

    def row(self, number):
        begins = [0, *self._ends[:-1]]
        *shifts, shift = [float(span.first) - begin for span, begin in zip(self._spans, begins, strict=True)]
        for end, other in zip(self._ends[-2::-1], shifts[::-1], strict=True):
            shift = self._k.select(number < end, other, shift)
        return number + shift


def _joined(rows: Sequence[Span]) -> list[Span]:
    out: list[Span] = []
    for span in rows:
        if out and out[-1].last == span.first and out[-1].asked is True is span.asked:
            out[-1] = Span(out[-1].first, span.last)
        else:
            out.append(span)
    return out


def _alike(k, asset, numbered: _Numbered, before, meet):
    return k.loop(numbered.count, before, lambda i, distance, row, u, v: (meet(asset, numbered.row(i), (distance, row, u, v)), None))


def _chosen(k, asset, numbered: _Numbered, before, meet, may):
    """_alike of the rows that may be met: AT_ONCE rows are bits of a number, the first one its highest."""
    highest = 2.0 ** (AT_ONCE - 1)
    most = float(min(AT_ONCE, numbered.most))
    one_batch = numbered.most <= AT_ONCE

    def some(batch, distance, row, u, v):
        low = k.name("low", batch * float(AT_ONCE))

        def look(i, chosen, many, bit):
            met = may(asset, numbered.row(low + i), distance)
            return (chosen + k.select(met, bit, 0.0), many + k.select(met, 1.0, 0.0), bit * 0.5), None

        chosen, many, _ = k.loop(numbered.count if one_batch else k.min(numbered.count - low, most), (0.0, 0.0, highest), look)

        def visit(_, left, distance, row, u, v):
            # Half a bit more: a logarithm of a power of two may be a little too small.
            bit = k.name("bit", k.floor(k.log2(left + 0.5)))
            met = meet(asset, numbered.row(low + (AT_ONCE - 1.0 - bit)), (distance, row, u, v))
            return (left - k.floor(k.exp2(bit) + 0.5), *met), None

        return tuple(k.loop(k.min(many, most), (chosen, distance, row, u, v), visit)[1:]), None

    if one_batch:
        return some(0.0, *before)[0]
    return k.loop(k.ceil((numbered.count - 0.5) * (1.0 / AT_ONCE)), before, some)
