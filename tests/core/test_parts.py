"""Dealing work to parts: each unit once, what belongs together in one, no part with much more than it must."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from reflect_addon.core.parts import Part, dealt, joined

EFFORTS = st.lists(st.floats(0.1, 100), max_size=30)


@given(efforts=EFFORTS, of=st.integers(1, 40), data=st.data())
def test_every_unit_is_in_one_part_with_what_it_is_joined_to(efforts, of, data):
    count = len(efforts)
    together = data.draw(st.lists(st.lists(st.integers(0, count - 1), min_size=1, max_size=4), max_size=3)) if count else []
    groups = joined(count, together)
    assert sorted(i for group in groups for i in group) == list(range(count))
    numbers = dealt(efforts, groups, of)
    assert len(numbers) == count and all(1 <= number <= of for number in numbers)
    assert all(len({numbers[i] for i in some}) == 1 for some in (*together, *groups))
    # What a greedy deal is known for: no part has more than the mean of all and one group.
    loads = [sum(e for e, n in zip(efforts, numbers, strict=True) if n == number) for number in range(1, of + 1)]
    largest = max((sum(efforts[i] for i in group) for group in groups), default=0.0)
    assert max(loads) <= sum(efforts) / of + largest + 1e-6


def test_groups_that_share_a_unit_are_one():
    assert joined(6, [[0, 3], [3, 5], [1, 2]]) == [[0, 3, 5], [1, 2], [4]]


def test_more_parts_than_work():
    assert dealt([1.0, 2.0], [[0], [1]], 5) == [2, 1]


@pytest.mark.parametrize("text", ["", "1", "0/2", "3/2", "1/0", "-1/2", "1/10000", "1/2/3", "a/b"])
def test_what_is_no_part(text):
    with pytest.raises(ValueError, match="is not a part; write I/N"):
        Part.parse(text)


def test_a_part_reads_as_it_writes():
    assert str(Part.parse(" 2/5 ")) == "2/5"
