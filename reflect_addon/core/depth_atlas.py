"""Depth maps as rows of the billboards' table and as one image of simplified rows.

A map's row in `billboard_buf` holds its camera where a quad has its plane: in columns plane, u, v the vectors whose dot
product with a point, plus w, is z, x and y of the camera (depth_camera.py; |x| <= z and |y| <= z inside), p relative to
the asset's centre. Its colours are a block of `billboard_tx` as a quad's are.
"""

import numpy as np

from .billboard_atlas import ROW, Placed
from .depth_fit import DepthView

# Hits closer than this many texels are the surface that the ray starts on (depth_start.py is exact to a part of that).
NEAR = 0.1
# A segment that rises by more than this many texels of depth per texel is no surface: its camera saw it too slanted to
# know it, or it is a band over the gap between two parts of the object. What another map sees is then not hidden by it.
STEEP = 6.0
# Rows of maps are stacked to this height, then beside each other: every graphics card holds images of this side.
TALLEST = 8192


def fill_rows(
    rows: np.ndarray,  # (maps, len(ROW), 4), written
    views: list[DepthView],
    started_on: list[bool],  # whether rays start on what a view shows
    placed: list[Placed],
    corners: list[tuple[int, int, int, int]],  # lowest left texels of each view's table and depths
    spheres: list[tuple[np.ndarray, float]],  # around each view's object: centre (3,) world, radius in m
    center: np.ndarray,  # (3,) world, what rows are relative to
) -> None:
    """Writes one row per view."""
    for row, view, on, where, corner, (middle, radius) in zip(rows, views, started_on, placed, corners, spheres, strict=True):
        camera = view.camera
        eye = camera.eye - center
        axes = (camera.forward, camera.right / camera.tan_half, camera.up / camera.tan_half)
        for name, axis in zip(("plane", "u", "v"), axes, strict=True):
            row[ROW[name]] = *axis, -np.dot(eye, axis)
        row[ROW["place"]] = where.x, where.y, where.width, where.height
        row[ROW["detail"], :3] = where.levels - 1, 1 / camera.texel(where.width), 1.0
        near = NEAR * camera.texel(where.width) if on else 0.0
        steep = STEEP * camera.texel(where.width) / (camera.yon - camera.hither)
        row[ROW["limits"]] = camera.hither, camera.yon, near, steep
        row[ROW["ball"]] = *(np.asarray(middle) - center), radius
        row[ROW["table"]] = corner


def sphere_around(points: np.ndarray) -> tuple[np.ndarray, float]:
    """(centre (3,), radius, m) of a sphere that holds the points (N, 3)."""
    middle = (points.min(0) + points.max(0)) / 2
    return middle, 1.001 * float(np.linalg.norm(points - middle, axis=-1).max())


def moved_map_row(row: np.ndarray, world_from_world: np.ndarray, center) -> np.ndarray:
    """(len(ROW), 4) float32: a map's row after a motion that keeps shapes (4.3: "The DM camera is simply transformed")."""
    out, center = row.astype(np.float64), np.asarray(center, np.float64)
    scale = np.cbrt(np.linalg.det(world_from_world[:3, :3]))
    turn = world_from_world[:3, :3] / scale

    def moved(point):
        return world_from_world[:3, :3] @ (point + center) + world_from_world[:3, 3] - center

    camera = out[[ROW["plane"], ROW["u"], ROW["v"]]]
    eye = moved(np.linalg.solve(camera[:, :3], -camera[:, 3]))
    for name in ("plane", "u", "v"):
        axis = turn @ out[ROW[name], :3]
        out[ROW[name]] = *axis, -np.dot(eye, axis)
    out[ROW["limits"], :3] *= scale
    out[ROW["detail"], 1] /= scale
    out[ROW["ball"]] = *moved(out[ROW["ball"], :3]), out[ROW["ball"], 3] * scale
    return out.astype(np.float32)


def hidden_map_row(row: np.ndarray) -> np.ndarray:
    """(len(ROW), 4) float32: a map's row that no ray meets."""
    out = row.copy()
    out[ROW["ball"], 3] = 0
    return out


def stacked(images: list[np.ndarray], fill: tuple[float, ...]) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """((H, W, 4) of the images' type, lowest left texel (x, y) of each), what is left over filled with `fill`."""
    corners, x, y, wide, tall = [], 0, 0, 0, 0
    for image in images:
        h, w = image.shape[:2]
        if y and y + h > TALLEST:
            x, y, wide = x + wide, 0, 0
        corners.append((x, y))
        y, wide, tall = y + h, max(wide, w), max(tall, y + h)
    out = np.empty((tall, x + wide, 4), images[0].dtype)
    out[:] = fill
    for (x, y), image in zip(corners, images, strict=True):
        out[y : y + image.shape[0], x : x + image.shape[1]] = image
    return out, corners
