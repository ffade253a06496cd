"""How large the maps of recursive reflections are: by projected area, in steps, and without popping [nielsen-2002 3.1 and section 4].

"The resolution of the generated reflection maps can also be dynamically scaled, based on the projected area of the reflector." A planar mirror's
map has the picture's own pixels, those of its window, so it is as sharp as the picture and its size is only memory; a curved mirror's one
view is drawn at a size of its own. "This reduces the sampling interval and can result in temporal aliasing": sizes go in steps of the square
root of two, a map grows as soon as it is too small, and shrinks only once it is so by more than KEEP below the next step. So a mirror
whose size swings by less than 1 - KEEP keeps one map.
"""

from collections.abc import Mapping

from .reflection_tree import Tree

STEP = 2.0**0.5
LEAST = 16  # px
# A map shrinks to the next step below when what is needed is under this share of it.
KEEP = 0.85


def side_of(needed: float, most: int, before: int | None = None) -> int:
    """px of a map's side, at most `most`: the smallest step that is enough; the one before (an answer of this function) as long as it serves."""
    steps = _steps(most)
    enough = next((step for step in steps if step >= needed), most)
    if before in steps and before > enough and needed > KEEP * steps[steps.index(before) - 1]:
        return before
    return enough


def _steps(most: int) -> list[int]:
    steps = [min(LEAST, most)]
    while steps[-1] < most:
        steps.append(min(-int(-steps[0] * STEP ** len(steps) // 2) * 2, most))
    return steps


def targets_of(tree: Tree, before: Mapping[int, tuple[int, int]] | None = None) -> dict[int, tuple[int, int]]:
    """Level -> (width, height) px of a target that holds what each of its views draws; before: the last frame's answer."""
    found: dict[int, tuple[int, int]] = {}
    for node in tree.nodes:
        widest, highest = found.get(node.depth - 1, (0, 0))
        found[node.depth - 1] = max(widest, node.drawn[2]), max(highest, node.drawn[3])
    most = max((tree.root.width, tree.root.height, *(n.camera.width for n in tree.nodes)))
    last = before or {}
    return {level: tuple(side_of(n, most, b) for n, b in zip(size, last.get(level, (None, None)), strict=True)) for level, size in found.items()}
