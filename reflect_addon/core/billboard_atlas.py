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
# Tables with mirrors:
#   base: colour, metallic; tint: specular tint, index of refraction (core/shading.py)
#   normals: xy = place in normal_tx of the block with the same size and levels; z = weight of the mirror-like lobe;
#   w = spread that its roughness adds to a ray
#   eye: place of the capture's camera relative to the asset's centre; w = 1 / its height above the plane, 0 = parallel rays
# A depth map's row (depth_atlas.py) has its camera in plane, u and v, and
#   limits: x = hither, y = yon, m; z = distance of the nearest hit that counts, m; w = rise in q per texel from which a
#     segment counts as steep
#   ball: centre and radius of a sphere around the object
#   table: xy = lowest left texel of its simplified rows in srdm_buf, zw = of its depths in depth_tx
_COLUMNS = ("plane", "u", "v", "place", "detail", "base", "tint", "normals", "eye", "limits", "ball", "table")
ROW = {name: column for column, name in enumerate(_COLUMNS)}
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

    def block(self) -> tuple[int, int]:
        """(width, height) of the block from (x - 1, y - 1) on: all levels with their borders."""
        column = sum((self.height >> i) + 2 for i in range(1, self.levels))
        return self.width + 2 + (self.width // 2 + 2 if self.levels > 1 else 0), max(self.height + 2, column)


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
    columns, rows = Placed(1, 1, w, h, len(levels)).block()
    block = np.zeros((rows, columns, 4), np.float32)
    y = 0
    for i, a in enumerate(levels):
        padded = np.pad(a, ((1, 1), (1, 1), (0, 0)), mode="edge")
        x = w + 2 if i else 0
        block[y : y + padded.shape[0], x : x + padded.shape[1]] = padded
        y = y + padded.shape[0] if i else 0
    return block


def table_rows(quads: list[Quad], placed: list[Placed], opaque: list[bool], center) -> np.ndarray:
    """(max(quads, 1), len(ROW), 4) float32 table. center: (3,) world, m, what rows are relative to."""
    rows = np.zeros((max(len(quads), 1), len(ROW), 4), np.float32)
    for i, (quad, where, full) in enumerate(zip(quads, placed, opaque, strict=True)):
        rows[i] = table_row(quad, where, full, center)
    return rows


def table_row(quad: Quad, where: Placed, opaque: bool, center) -> np.ndarray:
    """(len(ROW), 4) float32: one row."""
    row = np.zeros((len(ROW), 4), np.float32)
    place = np.asarray(quad.center, np.float64) - center
    row[ROW["plane"]] = *quad.normal, np.dot(place, quad.normal)
    for name, axis, half in (("u", quad.u, quad.half_u), ("v", quad.v, quad.half_v)):
        scaled = np.asarray(axis) / half
        row[ROW[name]] = *scaled, -np.dot(place, scaled)
    row[ROW["place"]] = where.x, where.y, where.width, where.height
    row[ROW["detail"], :3] = where.levels - 1, where.width / (2 * quad.half_u), opaque
    return row


def write_mirror(row: np.ndarray, material: Material, where: Placed, quad: Quad | None, center) -> None:
    """Makes a row (len(ROW), 4) that of a mirror: its material, where its normals lie and, of a quad, the capture's eye."""
    row[ROW["base"]], row[ROW["tint"]], (weight, *_) = material_rows(material)
    row[ROW["normals"]] = where.x, where.y, weight, roughness_spread(material)
    if quad is not None and quad.eye is not None:
        above = np.dot(np.asarray(quad.eye) - quad.center, quad.normal)
        row[ROW["eye"]] = *(np.asarray(quad.eye) - center), 1 / above


def placed_of(row: np.ndarray) -> Placed:
    """Where a row (len(ROW), 4) of the table says that its texels lie."""
    x, y, width, height = (int(n) for n in row[ROW["place"]])
    return Placed(x, y, width, height, int(row[ROW["detail"], 0]) + 1)


def moved_row(row: np.ndarray, world_from_world: np.ndarray, center) -> np.ndarray:
    """(len(ROW), 4) float32: a row after a motion that keeps shapes (remake.is_rigid), its texels going along."""
    row, center = row.astype(np.float64), np.asarray(center, np.float64)
    scale = np.cbrt(np.linalg.det(world_from_world[:3, :3]))
    turn = world_from_world[:3, :3] / scale
    axes = {name: row[ROW[name], :3] for name in ("plane", "u", "v")}
    # The plane's point nearest to the quad's middle: where all three of its equations are 0.
    middle = np.linalg.solve(
        np.array(list(axes.values())), np.array([row[ROW["plane"], 3], -row[ROW["u"], 3], -row[ROW["v"], 3]])
    )
    middle = world_from_world[:3, :3] @ (middle + center) + world_from_world[:3, 3] - center
    out = row.copy()
    out[ROW["plane"], :3] = turn @ axes["plane"]
    out[ROW["plane"], 3] = middle @ out[ROW["plane"], :3]
    for name in ("u", "v"):
        out[ROW[name], :3] = turn @ axes[name] / scale
        out[ROW[name], 3] = -middle @ out[ROW[name], :3]
    out[ROW["detail"], 1] /= scale
    if row[ROW["eye"], 3]:
        out[ROW["eye"], :3] = world_from_world[:3, :3] @ (row[ROW["eye"], :3] + center) + world_from_world[:3, 3] - center
    out[ROW["eye"], 3] /= scale
    return out.astype(np.float32)


def hidden_row(row: np.ndarray) -> np.ndarray:
    """(len(ROW), 4) float32: a row that no ray meets."""
    out = row.copy()
    out[[ROW["u"], ROW["v"]]] = 0, 0, 0, 2  # u = v = 2 everywhere, and a quad ends at 1
    return out
