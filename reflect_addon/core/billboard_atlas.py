"""Many billboards in one image and one table.

Each billboard's block holds its level 0 at the left and the coarser levels in a column at its right, every level
inside a border of one texel that repeats its edge. With sides that are powers of two all offsets have a closed form:
level i >= 1 lies at x0 + w + 2, y0 + h (1 - 2^(1-i)) + 2 (i - 1), inside the border.
Texels are premultiplied radiance and alpha, so that bilinear look-ups and coarser levels do not bleed.
"""

from dataclasses import dataclass

import numpy as np

from .billboard_fit import Quad
from .shading import material_rows, roughness_spread
from .snapshot import Material

# Columns of the table, one texel (vec4) each; a row is a billboard. p is a point relative to the asset's centre, so that
# float32 keeps its digits wherever the scene lies.
#   plane: normal; w = its dot product with a point of the plane
#   u, v: axis / half extent, w so that dot(p, u.xyz) + u.w is in -1..1
#   place: xy = level 0's lowest left texel inside its border; zw = width, height of level 0 in texels
#   detail: x = coarsest level; y = texels per metre; z = 1 where all of it is opaque
# and, in tables with mirrors, whose rows are the last:
#   base: colour, metallic; tint: specular tint, index of refraction (core/shading.py)
#   normals: xy = place in normal_tx of the block with the same size and levels; z = weight of the mirror-like lobe;
#   w = spread that its roughness adds to a ray
#   eye: place of the capture's camera relative to the asset's centre; w = 1 / its height above the plane, 0 = parallel rays
ROW = {"plane": 0, "u": 1, "v": 2, "place": 3, "detail": 4, "base": 5, "tint": 6, "normals": 7, "eye": 8}
DIFFUSE_COLUMNS = 5
# Coarsest level: its smaller side still has this many texels.
COARSEST = 4


@dataclass(frozen=True)
class Placed:
    """Where a billboard's level 0 lies inside its border, and how many levels it has."""

    x: int
    y: int
    width: int
    height: int
    levels: int


def pack(images: list[np.ndarray]) -> tuple[np.ndarray, list[Placed]]:
    """((H, W, 4) float32 atlas, where each image lies). Shelves, tallest first; sides are powers of two."""
    blocks = [_block(image) for image in images]
    order = sorted(range(len(blocks)), key=lambda i: -blocks[i].shape[0])
    area = sum(b.shape[0] * b.shape[1] for b in blocks)
    width = max([b.shape[1] for b in blocks] + [int(np.ceil(np.sqrt(area))), 1])
    corner: dict[int, tuple[int, int]] = {}
    x = y = shelf = 0
    for i in order:
        h, w = blocks[i].shape[:2]
        if x + w > width:
            x, y, shelf = 0, y + shelf, 0
        corner[i] = (x, y)
        x, shelf = x + w, max(shelf, h)
    atlas = np.zeros((max(y + shelf, 1), width, 4), np.float32)
    placed = []
    for i, block in enumerate(blocks):
        x, y = corner[i]
        atlas[y : y + block.shape[0], x : x + block.shape[1]] = block
        h, w = images[i].shape[:2]
        placed.append(Placed(x + 1, y + 1, w, h, _levels(w, h)))
    return atlas, placed


def _levels(width: int, height: int) -> int:
    return max(1, int(np.log2(min(width, height) // COARSEST)) + 1) if min(width, height) >= COARSEST else 1


def _block(image: np.ndarray) -> np.ndarray:
    """All levels of one billboard with their borders."""
    h, w = image.shape[:2]
    levels = [image]
    for _ in range(_levels(w, h) - 1):
        a = levels[-1]
        levels.append(a.reshape(a.shape[0] // 2, 2, a.shape[1] // 2, 2, 4).mean((1, 3)))
    column = sum(a.shape[0] + 2 for a in levels[1:])
    block = np.zeros((max(h + 2, column), w + 2 + (w // 2 + 2 if len(levels) > 1 else 0), 4), np.float32)
    y = 0
    for i, a in enumerate(levels):
        padded = np.pad(a, ((1, 1), (1, 1), (0, 0)), mode="edge")
        x = w + 2 if i else 0
        block[y : y + padded.shape[0], x : x + padded.shape[1]] = padded
        y = y + padded.shape[0] if i else 0
    return block


def table_rows(
    quads: list[Quad], placed: list[Placed], opaque: list[bool], center, mirrors: list[tuple[Material, Placed]] = ()
) -> np.ndarray:
    """(count, columns, 4) float32 table, at least one row. center: (3,) world, m, what rows are relative to.

    mirrors: for each of the last rows its material and where its normals lie."""
    rows = np.zeros((max(len(quads), 1), len(ROW) if mirrors else DIFFUSE_COLUMNS, 4), np.float32)
    for row, quad, where, full in zip(rows, quads, placed, opaque, strict=False):
        place = np.asarray(quad.center, np.float64) - center
        row[ROW["plane"]] = *quad.normal, np.dot(place, quad.normal)
        for name, axis, half in (("u", quad.u, quad.half_u), ("v", quad.v, quad.half_v)):
            scaled = np.asarray(axis) / half
            row[ROW[name]] = *scaled, -np.dot(place, scaled)
        row[ROW["place"]] = where.x, where.y, where.width, where.height
        row[ROW["detail"], :3] = where.levels - 1, where.width / (2 * quad.half_u), full
    last = slice(len(quads) - len(mirrors), len(quads))
    for row, quad, (material, where) in zip(rows[last], quads[last], mirrors, strict=True):
        row[ROW["base"]], row[ROW["tint"]], (weight, *_) = material_rows(material)
        if quad.eye is not None:
            above = np.dot(np.asarray(quad.eye) - quad.center, quad.normal)
            row[ROW["eye"]] = *(np.asarray(quad.eye) - center), 1 / above
        row[ROW["normals"]] = where.x, where.y, weight, roughness_spread(material)
    return rows
