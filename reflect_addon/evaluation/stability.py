"""Numerical stability: every method's kernel in float32 beside the same kernel in float64, on rays that are hard.

Same rays, same tables (half floats and all), so what differs is arithmetic. A hit is wrong when it is reported as one and lies
farther from every surface than the method itself promises; the truth is the scene's triangles (stability_scene.py):
  * cube maps show the place that the texel was captured from, so their hits lie within a texel's diagonal of it;
  * billboards lie in the plane of what is flat, and for a volume somewhere in its bounding sphere;
  * depth maps lie within STEPS texels of the surface that the map shows;
  * light fields blend what four views see: a view's step and a texel from it, for rays that start in the cell. To others
    nothing is promised.
Differences are in ulps of the largest coordinate of ray and hit: the float32 steps in which a position can be said at all.
Where float32 takes another texel or passes an edge on the other side, answers differ by more than any rounding: such rays
are counted apart (`other`), and judged like all others by the surfaces.
"""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from ..core import methods
from ..core.asset import Asset
from ..core.kernel import record, run_numpy
from ..core.light_field import cell_of
from ..core.methods import light_field
from ..core.rays import Answer
from ..core.safe_write import write_whole
from ..core.spaces import FAR, STATUS_HIT
from .stability_cases import Case, cases
from .stability_scene import Surfaces

FORMAT = 1
FILE_NAME = "stability.json"
RAYS = 4000
BAKE = {"resolution": 32, "samples": 1, "texels": 64, "sky_error": 0, "maps": 2, "views": 8, "view_texels": 16}
SEED = 11
STEPS = 2.0
# Of the hit's distance from its map: half floats, and the trees that truth comes from.
ROUNDING = 1e-3
# A hit that moves by more than this share of the scene is another hit, not a rounding.
OTHER = 1e-3


@dataclass(frozen=True)
class Stability:
    """One line of the table. ulps and relative are over rays that show the same place, relative to the scene's diagonal."""

    case: str
    method: str
    rays: int
    hits: int  # rays that report a hit on a surface
    nonfinite: int  # rays with a value that is no number, in radiance, position, coverage or status
    wrong: int  # hits, in float32
    wrong64: int  # the same in float64: of the method's making, not of rounding
    other: float  # share of rays that answer with another place or status
    ulps_999: float
    ulps_worst: float
    relative_worst: float


def measure(
    progress: Callable[[float, str], object], rays: int = RAYS, chosen: tuple[Case, ...] | None = None
) -> list[Stability]:
    """The table's rows, cases by methods."""
    chosen = cases() if chosen is None else chosen
    rows = []
    for number, case in enumerate(chosen):
        progress(number / len(chosen), f"stability: {case.name}")
        rows += _measured(case, rays)
    progress(1.0, "stability: done")
    return rows


def write(rows: list[Stability], out: Path) -> Path:
    """Writes out/stability.json and returns its path."""
    path = Path(out) / FILE_NAME
    data = {"format": FORMAT, "rows": [asdict(row) for row in rows]}
    write_whole(path, (json.dumps(data, indent=1, allow_nan=False) + "\n").encode())
    return path


def _measured(case: Case, count: int) -> list[Stability]:
    surfaces = Surfaces(case.scene)
    assets = _baked(case, surfaces)
    rays = case.rays(np.random.default_rng(SEED), count, assets)
    rows = []
    for name, asset in assets.items():
        program = record(methods.get(name).trace, asset)
        # A footprint of its own for every ray, so that levels are chosen too.
        width = np.resize([0.0, 1e-3, 3e-2], count) * case.scene.diagonal()
        spread = np.resize([0.0, 0.0, 1e-2, 2.0], count)
        low, high = (run_numpy(program, asset, rays, width, spread, dtype) for dtype in (np.float32, np.float64))
        rows.append(_row(case, name, surfaces, asset, rays, low, high))
    return rows


def _baked(case: Case, surfaces: Surfaces) -> dict[str, Asset]:
    """method -> its asset, joined with what it requires."""
    done: dict[str, Asset] = {}
    for name in methods.with_required(methods.gathering()):
        method = methods.get(name)
        required = {kind: done[kind] for kind in method.REQUIRES}
        job = surfaces.job({**method.DEFAULTS, **BAKE, **case.settings}, required, case.light)
        done[name] = method.bake(job, case.views) if name == "depth_maps" else method.bake(job)
    return {name: done[name].joined(*(done[kind] for kind in methods.get(name).REQUIRES)) for name in methods.gathering()}


def _row(case: Case, name: str, surfaces: Surfaces, asset: Asset, rays, low: Answer, high: Answer) -> Stability:
    finite = np.ones(len(rays), bool)
    for part in ("radiance", "position", "coverage", "status"):
        finite &= np.isfinite(getattr(low, part)).reshape(len(rays), -1).all(1)
    wrong, wrong64 = (wrong_hits(surfaces, name, asset, rays, a) for a in (low, high))
    found, wanted = low.position.astype(np.float64), high.position
    off = np.abs(found - wanted).max(1)
    largest = np.maximum(np.abs(wanted).max(1), np.abs(rays.origin).max(1))
    both = finite & np.isfinite(off) & (low.status == high.status)
    same = both & (off <= OTHER * np.maximum(surfaces.scene.diagonal(), largest * (largest > FAR / 2)))
    ulps = off[same] / np.spacing(np.maximum(largest[same], 1e-30).astype(np.float32))
    return Stability(
        case.name, name, len(rays), int(is_surface(rays, low).sum()), int((~finite).sum()), int(wrong.sum()),
        int(wrong64.sum()), float(np.mean(finite & ~same)), *(float(np.percentile(ulps, q)) for q in (99.9, 100)),
        float((off[same] / np.maximum(surfaces.scene.diagonal(), largest[same] * (largest[same] > FAR / 2))).max()),
    )  # fmt: skip


def is_surface(rays, answer: Answer) -> np.ndarray:
    """(N,) bool: the ray reports a hit, and not of the sky."""
    away = np.linalg.norm(np.nan_to_num(answer.position.astype(np.float64)) - rays.origin, axis=1)
    return (answer.status == STATUS_HIT) & (away < FAR / 2)


def wrong_hits(surfaces: Surfaces, name: str, asset: Asset, rays, answer: Answer) -> np.ndarray:
    """(N,) bool: reported as a hit, and farther from every surface than the method promises."""
    found = np.flatnonzero(is_surface(rays, answer) & _promised(name, asset, rays))
    points = answer.position[found].astype(np.float64)
    good = np.zeros(len(found), bool)
    center = np.asarray(asset.uniforms["cell_center" if name == light_field.NAME else "center"], np.float64)
    rounding = ROUNDING * np.linalg.norm(points - center, axis=1)
    for instance in surfaces.scene.instances:
        left = np.flatnonzero(~good)
        allowed = _allowed(surfaces, name, asset, instance, points[left], center) + rounding[left]
        good[left] = surfaces.distance(instance, points[left]) <= allowed
    out = np.zeros(len(rays), bool)
    out[found[~good]] = True
    return out


def _promised(name: str, asset: Asset, rays) -> np.ndarray:
    """(N,) bool: rays whose hits the method says anything about."""
    return cell_of(asset).contains(rays.origin) if name == light_field.NAME else np.ones(len(rays), bool)


def _allowed(surfaces: Surfaces, name: str, asset: Asset, instance, points: np.ndarray, center: np.ndarray) -> np.ndarray:
    """(N,) m: how far from the instance a hit of the method may lie."""
    if "cube_size" in asset.uniforms and name not in ("billboards", "depth_maps"):
        # The diagonal of the widest texel, in the middle of a face.
        return np.linalg.norm(points - center, axis=1) * np.sqrt(8) / asset.uniforms["cube_size"]
    if name == light_field.NAME:
        cell = cell_of(asset)
        step = max(float(np.linalg.norm(cell.step(axis))) for axis in range(3))
        return step + np.linalg.norm(points - center, axis=1) * np.sqrt(8) / (cell.texels - 1)
    corners = surfaces.scene.world_positions(instance)
    low, high = corners.min(0), corners.max(0)
    radius = float(np.linalg.norm(high - low)) / 2
    texel = STEPS * 2 * radius / float(asset.settings["texels"])
    volumes = {p.instance for p in asset.parts if p.kind in ("volume", "mirror")}
    return np.full(len(points), radius if name == "billboards" and instance.name in volumes else texel)
