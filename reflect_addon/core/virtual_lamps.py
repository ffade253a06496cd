"""Lamps as reflected rays meet them: each is a shape from a formula, asked by every pixel's own ray.

Problem. In Cycles a lamp hides nothing: a ray that meets one takes its light along and goes on to what lies behind, which is another thing
for every ray. A virtual triangle can only show one colour, lamp and background together as they were seen when it was baked.
Idea. Surface radiance knows the lamp's own light (surface_radiance.py). It is added where a ray meets the lamp before what was drawn
(gpu/virtual_lamps.py). A lamp is a rectangle, an ellipse or a ball, so that nothing has to be searched.
Limits. One colour a lamp, the median over its surface; no spread, no texture. Before a sky that nothing was drawn for it shows its own
light alone.
"""

import numpy as np

from .lamp_hits import shining
from .snapshot import Instance, SceneSnapshot
from .surface_asset import SurfaceMesh

RECTANGLE, ELLIPSE, BALL = 0.0, 1.0, 2.0
# A lamp's texels: centre in world space, m, and what it is; rows of unit_from_world about its centre, in which it reaches from -1 to 1
# (a flat one's third axis is its normal, in m, on the side that shines); radiance.
CENTER, ROWS, RADIANCE, TEXELS = 0, 1, 4, 5
CORNERS = 4  # of a rectangle's mesh


def lamp_rows(scene: SceneSnapshot, surfaces: dict[str, SurfaceMesh]) -> np.ndarray:
    """(L, TEXELS, 4) float32 of the scene's lamps that have surface radiance and that rays can meet."""
    rows = [_row(scene, lamp, surfaces[lamp.name]) for lamp in scene.lamps if lamp.name in surfaces]
    return np.array([row for row in rows if row is not None], np.float32).reshape(-1, TEXELS, 4)


def _row(scene: SceneSnapshot, lamp: Instance, surface: SurfaceMesh) -> np.ndarray | None:
    mesh, matrix = scene.meshes[lamp.mesh], np.asarray(lamp.world_from_object, np.float64)
    low, high = mesh.positions.min(0).astype(np.float64), mesh.positions.max(0).astype(np.float64)
    half = (high - low) / 2
    world_from_unit = matrix[:3, :3] * np.where(half > 0, half, 1.0)
    normal = shining(scene, lamp)
    is_flat = bool(normal.any())
    if is_flat:
        world_from_unit[:, half.argmin()] = normal
        world_from_unit = world_from_unit[:, [*np.delete(np.arange(3), half.argmin()), half.argmin()]]
    if not abs(np.linalg.det(world_from_unit)) > 0 or not len(surface.radiance):
        return None
    row = np.zeros((TEXELS, 4))
    row[CENTER] = *(matrix[:3, :3] @ ((low + high) / 2) + matrix[:3, 3]), _kind(is_flat, mesh)
    row[ROWS : ROWS + 3, :3] = np.linalg.inv(world_from_unit)
    row[RADIANCE, :3] = np.median(surface.radiance, axis=0)
    return row


def _kind(is_flat: bool, mesh) -> float:
    if not is_flat:
        return BALL
    return RECTANGLE if len(mesh.positions) == CORNERS else ELLIPSE
