"""What an asset's stand-ins are in space, as lines and points for people to look at: its tables and uniforms, drawn as they are looked up."""

from dataclasses import dataclass, field

import numpy as np

from . import spaces
from .asset import Asset
from .billboard_atlas import ROW


def _none(*shape: int) -> np.ndarray:
    return field(default_factory=lambda: np.zeros(shape))


@dataclass(frozen=True)
class Outlines:
    """World space, m."""

    lines: np.ndarray = _none(0, 2, 3)  # (L, 2, 3) float64: ends
    points: np.ndarray = _none(0, 3)  # (P, 3) float64: where something was captured from

    def __add__(self, other: "Outlines") -> "Outlines":
        return Outlines(np.concatenate([self.lines, other.lines]), np.concatenate([self.points, other.points]))


def of_center(asset: Asset) -> Outlines:
    """Where an environment map was captured from."""
    return Outlines(points=np.array([asset.uniforms["center"]]))


def of_box(low, high, axes=np.eye(3), center=(0.0, 0.0, 0.0)) -> Outlines:
    """The twelve edges. low, high: (3,) m along the axes (3, 3 rows) from the centre (3,) world."""
    bits = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
    corners = np.where(bits, high, low) @ np.asarray(axes) + center
    ends = [(i, i | 1 << axis) for i in range(8) for axis in range(3) if not i >> axis & 1]
    return Outlines(corners[np.array(ends)])


def of_rectangle(center, u, v) -> Outlines:
    """Its four sides. u, v: (3,) from its centre to the middles of two sides."""
    corners = np.array([np.asarray(center) + a * np.asarray(u) + b * np.asarray(v) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    return Outlines(np.stack([corners, np.roll(corners, -1, 0)], 1))


def of_sphere(center, radius: float, sides: int = 48) -> Outlines:
    """Three great circles."""
    angle = np.linspace(0, 2 * np.pi, sides + 1)
    circle = radius * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], -1)
    rings = [np.roll(circle, k, -1) + center for k in range(3)]
    return Outlines(np.concatenate([np.stack([ring[:-1], ring[1:]], 1) for ring in rings]))


def of_table(asset: Asset) -> Outlines:
    """Quads, what depth maps see and whence, the ground's box, and where the map behind them was captured from."""
    center, u = np.asarray(asset.uniforms["center"], np.float64), asset.uniforms
    found = of_center(asset)
    if asset.options["ground"]:
        low, high = np.array(u["ground_low"]), np.array(u["ground_high"])
        high[2] = low[2] + u["ground_morph"]
        found += of_box(low, high, [u[f"ground_{axis}"] for axis in "xyz"], center)
    for row in asset.images["billboard_buf"][: asset.options["count"] + asset.options["mirrors"]].astype(np.float64):
        found += _of_map(row, center) if row[ROW["limits"], 1] > 0 else _of_quad(row, center)
    return found


def _of_quad(row: np.ndarray, center: np.ndarray) -> Outlines:
    axes = row[[ROW["plane"], ROW["u"], ROW["v"]]]
    if not axes[1:, :3].any(-1).all():
        return Outlines()  # hidden: no ray meets it
    solve = np.linalg.inv(axes[:, :3])
    middle = solve @ (axes[0, 3], -axes[1, 3], -axes[2, 3])
    return of_rectangle(middle + center, solve[:, 1], solve[:, 2])


def _of_map(row: np.ndarray, center: np.ndarray) -> Outlines:
    """The part of space that its camera sees, between hither and yon, and the camera's place."""
    if not row[ROW["ball"], 3]:
        return Outlines()  # hidden
    camera = row[[ROW["plane"], ROW["u"], ROW["v"]]]
    solve = np.linalg.inv(camera[:, :3])
    eye = center - solve @ camera[:, 3]
    ends = [of_rectangle(eye + z * solve[:, 0], z * solve[:, 1], z * solve[:, 2]).lines for z in row[ROW["limits"], :2]]
    between = np.stack([ends[0][:, 0], ends[1][:, 0]], 1)
    return Outlines(np.concatenate([*ends, between]), eye[None])


def of_room(asset: Asset) -> Outlines:
    """The box that an environment map lies on; where a side is open to the sky, the rim of the walls beside it."""
    u, low, high = asset.uniforms, *(np.array(asset.uniforms[f"box_{name}"]) for name in ("low", "high"))
    if not asset.options["walls"]:
        return of_center(asset)
    low = np.where(low <= -spaces.FAR, u["box_rim_low"], low)
    high = np.where(high >= spaces.FAR, u["box_rim_high"], high)
    return of_center(asset) + of_box(low, high, [u[f"box_{axis}"] for axis in "xyz"], u["center"])
