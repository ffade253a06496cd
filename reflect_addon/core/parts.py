"""Work that several machines share: which of its units each takes, the same on all of them without a word between them.

Problem. A farm's workers know a part's number and how many there are ("2/5") and no more: what is in which part follows from the work alone.
Idea. The work is a list of units in a fixed order, each with an effort: about how long it takes, known before. Units that take from each other are joined.
The longest joined ones are dealt first, each to the part that has the least to do yet, which is at most 4/3 of the best that can be (R. L. Graham,
"Bounds on Multiprocessing Timing Anomalies", 1969). Efforts are sums of the same few numbers in the same order everywhere; were they not, `merge` would see
a unit twice or never.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

MOST = 9999  # parts: more than any farm has workers


@dataclass(frozen=True)
class Part:
    """Part number `index` of `of`."""

    index: int  # 1 .. of
    of: int

    def __str__(self) -> str:
        return f"{self.index}/{self.of}"

    @staticmethod
    def parse(text: str) -> "Part":
        """Of "2/5". ValueError where it is none."""
        match = re.fullmatch(r"(\d{1,4})/(\d{1,4})", text.strip())
        if not match or not 1 <= int(match[1]) <= int(match[2]) <= MOST:
            raise ValueError(f"'{text}' is not a part; write I/N, for example 2/5, with I from 1 to N and N up to {MOST}")
        return Part(int(match[1]), int(match[2]))


def joined(count: int, together: Iterable[Sequence[int]]) -> list[list[int]]:
    """The units 0 .. count - 1 as groups, in the order of their first, that hold all that `together` names with one of them."""
    group = list(range(count))
    for some in together:
        all_of = {group[i] for i in some}
        group = [min(all_of) if g in all_of else g for g in group]
    return [[i for i in range(count) if group[i] == g] for g in sorted(set(group))]


def dealt(efforts: Sequence[float], groups: Sequence[Sequence[int]], of: int) -> list[int]:
    """For each unit the part, 1 .. of, that it is in. efforts: of the units, any measure of time; groups: of `joined`."""
    loads, out = [0.0] * of, [0] * len(efforts)
    for group in sorted(groups, key=lambda g: -sum(efforts[i] for i in g)):
        least = loads.index(min(loads))
        loads[least] += sum(efforts[i] for i in group)
        for i in group:
            out[i] = least + 1
    return out
