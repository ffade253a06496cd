"""How large the maps of recursive reflections are: by projected area, in steps, and without popping [nielsen-2002 3.1 and section 4].

"The resolution of the generated reflection maps can also be dynamically scaled, based on the projected area of the reflector." A planar mirror's
map has the picture's own pixels, those of its window, so it is as sharp as the picture and its size is only memory; a curved mirror's one
view, and its cube map, are drawn at a size of their own. "This reduces the sampling interval and can result in temporal aliasing": sizes go
in steps, a map grows as soon as it is too small, and shrinks only once it is so by more than KEEP below the next step. So a mirror whose
size swings by less than 1 - KEEP keeps one map. A cube map steps by two, since its levels halve; all others by the square root of two.
"""

from collections.abc import Iterable, Mapping

import numpy as np

from .camera import Camera
from .reflection_tree import Node

STEP, CUBE_STEP = 2.0**0.5, 2.0
LEAST = 16  # px
# Texels of a cube map's edge for a pixel that its ball is wide: four for a pixel at its middle. Against a map of 512, what the ball of mirrors_d shows
# at 256x192 is off by 0.116 of its mean then (RMS), with half as many by 0.175.
CUBE_TEXELS = 2.0
# A map shrinks to the next step below when what is needed is under this share of it.
KEEP = 0.85


def side_of(needed: float, most: int, before: int | None = None, step: float = STEP) -> int:
    """px of a map's side, at most `most`: the smallest step that is enough; the one before (an answer of this function) as long as it serves."""
    steps = _steps(most, step)
    enough = next((one for one in steps if one >= needed), most)
    if before in steps and before > enough and needed > KEEP * steps[steps.index(before) - 1]:
        return before
    return enough


def _steps(most: int, step: float) -> list[int]:
    steps = [min(LEAST, most)]
    while steps[-1] < most:
        steps.append(min(-int(-steps[0] * step ** len(steps) // 2) * 2, most))
    return steps


def targets_of(
    nodes: Iterable[Node], whole: tuple[int, int], before: Mapping[int, tuple[int, int]] | None = None, by_area: bool = True
) -> dict[int, tuple[int, int]]:
    """Depth -> (width, height) px of a target that holds what each view of that depth draws. whole: px of the picture, which a target has
    where sizes do not go by area; before: the sizes that there are."""
    found: dict[int, tuple[int, int]] = {}
    for node in nodes:
        widest, highest = found.get(node.depth, (0, 0) if by_area else whole)
        found[node.depth] = max(widest, node.drawn[2]), max(highest, node.drawn[3])
    if not by_area:
        return found
    last = before or {}
    return {
        depth: tuple(side_of(n, max(n, w), b) for n, w, b in zip(size, whole, last.get(depth, (None, None)), strict=True))
        for depth, size in found.items()
    }


def cube_sides(centers: np.ndarray, radii: np.ndarray, camera: Camera) -> np.ndarray:
    """(C,) px: texels along an edge that the cube maps of balls are worth, centers (C, 3) and radii (C,) in m: by the width of each ball in the picture, and
    in that of the ball that shows it best.

    In a planar mirror a ball is never nearer than it is, wherever in the picture it stands. Infinite from within it.
    """
    if not len(radii):
        return np.zeros(0)
    pixel = 2.0 / (abs(camera.clip_from_camera[1, 1]) * camera.height)  # at 1 m, or everywhere
    if camera.is_orthographic:
        seen = 2 * radii / pixel
    else:
        away = np.square(centers - camera.world_from_camera[:3, 3]).sum(-1) - radii**2
        seen = np.where(away > 0, 2 * radii / (pixel * np.sqrt(np.maximum(away, 1e-300))), np.inf)
    apart = np.linalg.norm(centers[:, None] - centers[None], axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        shown = np.where(np.eye(len(radii), dtype=bool), 0.0, radii[:, None] / np.maximum(apart, 1e-300) * seen[None])
    return CUBE_TEXELS * np.maximum(seen, np.nan_to_num(shown, nan=0.0, posinf=np.inf).max(1))
