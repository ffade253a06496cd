"""The maps of nielsen-2002 in one table: passes, error and memory of sphere map, cube map, dual paraboloid and octahedron at equal texels.

A map is filled with the exact radiance of its texels' directions and asked in random ones. `sky` is known everywhere: a smooth gradient with a sun
of 2 degrees and an edge at the horizon; `captured` is the environment map of (d)'s ball, 256 texels a face, as Cycles made it, noise included.
"""

from functools import partial
from pathlib import Path

import bpy
import numpy as np

from ..core import environment_maps
from ..core.kernel import evaluate, record, record_function, run_numpy
from ..core.methods import environment
from ..core.processes import temporary_folder
from ..core.rays import Rays
from ..scene.bake import bake_assets
from ..scene.raytrace import trace
from .assets import baked_in
from .bench_nielsen_scene import mirrors_d
from .bench_row import row
from .exhibit import Exhibit
from .frame import open_frame

TEXELS = 6 * 64 * 64  # as a cube map of 64
DIRECTIONS = 200_000
BACK = -0.9  # along Z: beyond it a sphere map is all rim
NAMES = tuple(p.name for p in environment_maps.PROJECTIONS)


def measure(progress) -> list:
    """Rows for targets.json, and an Exhibit."""
    progress(0.0, "nielsen: an environment to keep in maps")
    worlds = {"sky": sky, "captured": _captured()}
    progress(0.8, "nielsen: maps")
    return table({name: errors(radiance) for name, radiance in worlds.items()})


def sky(direction: np.ndarray) -> np.ndarray:
    """(N, 3) radiance of (N, 3) unit directions."""
    x, _, z = direction.T
    toward = np.array([0.5, 0.6, 0.62]) / np.linalg.norm([0.5, 0.6, 0.62])
    sun = 10.0 * np.exp(-np.square(np.arccos(np.clip(direction @ toward, -1, 1)) / np.radians(2.0)))
    ground = np.where(z < 0, 0.2 + 0.1 * np.sin(9 * x), 0.6 + 0.3 * z)
    return np.stack([ground + sun, ground + 0.9 * sun, 1.2 * ground + 0.7 * sun], -1)


def _captured():
    scene = mirrors_d()
    with temporary_folder("reflect-bench-") as folder, open_frame(scene, None) as snapshot:
        ball = next(r.name for r in snapshot.reflectors() if r.name.startswith("Sphere"))
        settings = {"samples": 16, "resolution": 256}
        bake_assets(snapshot, (environment.NAME,), Path(folder), reflectors=(ball,), settings=settings, tracer=partial(trace, scene=bpy.context.scene))
        asset = baked_in(Path(folder), snapshot, environment.NAME).assets[ball]
    kernel = record(environment.trace, asset)

    def radiance(direction):
        rays = Rays(np.zeros_like(direction, np.float32), direction.astype(np.float32))
        return run_numpy(kernel, asset, rays).radiance

    return radiance


def errors(radiance) -> dict[str, tuple[float, float, float]]:
    """Projection -> (RMSE over the mean radiance, the same of directions towards BACK, largest over the mean)."""
    direction = np.random.default_rng(3).normal(size=(DIRECTIONS, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    truth, found = radiance(direction), {}
    back = direction[:, 2] < BACK
    for projection in environment_maps.PROJECTIONS:
        image = environment_maps.filled(projection, environment_maps.side_for(projection, TEXELS), radiance)
        program = record_function(projection.place, environment_maps.INPUTS, name=projection.name.replace(" ", "_"))
        place = evaluate(program, {"direction": direction.astype(np.float32)})
        off = np.square(environment_maps.look_up(place["picture"], place["s"], place["t"], image) - truth).mean(1)
        found[projection.name] = tuple(float(np.sqrt(of) / truth.mean()) for of in (off.mean(), off[back].mean(), off.max()))
    return found


def table(found: dict[str, dict[str, tuple[float, float, float]]]) -> list:
    rows, lines = [], []
    for world, by_name in found.items():
        ours = [by_name[name][0] for name in NAMES]
        best = NAMES[int(np.argmin(ours))]
        told = ", ".join(f"{name} {by_name[name][1]:.3g}" for name in NAMES)
        rows.append(
            row(f"N-maps-{world}", ours, None, bool(np.isfinite(ours).all()),
                f"RMSE of look-ups by direction over the mean of {world}, {TEXELS} texels in all: {', '.join(NAMES)}; {best} is best. Behind (z < {BACK}): {told}.")
        )  # fmt: skip
    for projection in environment_maps.PROJECTIONS:
        side = environment_maps.side_for(projection, TEXELS)
        size = f"{projection.pictures} x {side} x {side}"
        cells = [f"{found[world][projection.name][k]:.4f}" for world in found for k in range(3)]
        lines.append((projection.name, str(projection.passes), size, f"{projection.pictures * side * side * 8 / 1024:.0f}", *cells))
    heads = ("map", "passes", "px", "KiB (RGBA16F)", *(f"{world} {what}" for world in found for what in ("RMSE", "behind", "largest")))
    lead = (
        "Errors over the mean radiance, by direction, at equal memory. Passes: six views of the scene see all directions; the others are drawn from those by one more (bent by vertices, a dual paraboloid takes two). "
        "The paper's own sphere map is one pass, of 127 degrees at most."
    )
    return [*rows, Exhibit("Maps of all directions", lead, heads, tuple(lines))]
