"""Issue 5's errors: what convex reflectors of `kitchen` show by virtual objects, over what an environment map makes of it.

A kettle and two jars are baked as they are with default settings; the truth is Cycles along the same rays. RMSE is of scene-linear
radiance, where few pixels at lamps' edges may outweigh all others; shares of the square error say what it is made of.
"""

from functools import partial

import bpy
import numpy as np

from ..core import metrics
from ..core.errors import ReflectError
from ..core.methods import environment, layered_distance, virtual_objects
from ..core.processes import temporary_folder
from ..core.spaces import STATUS_HIT
from ..scene.bake import bake_assets
from ..scene.raytrace import trace
from .assets import baked_in
from .bench_row import row
from .bench_yu_scene import SAMPLES
from .exhibit import Exhibit
from .frame import open_frame
from .judged import judge

REFLECTORS = ("Kettle", "Jar 1", "Jar 2")
METHODS = (environment.NAME, layered_distance.NAME, virtual_objects.NAME)
SIZE, PATHS = (640, 360), 32  # px; Cycles' paths a ray
MOST = 0.25  # of environment's, the issue's
PLACE = 1e-3  # of the scene's diagonal: what is nearer to the truth's point is at its place


def measure(progress) -> list:
    """A row for targets.json, and an Exhibit of all methods."""
    path = SAMPLES / "kitchen.blend"
    if not path.is_file():
        raise ReflectError(f"{path} is missing.", "The targets of estalella-2005 are measured in a checkout of the project.")
    bpy.ops.wm.open_mainfile(filepath=str(path))
    scene = bpy.context.scene
    with temporary_folder("reflect-bench-") as folder, open_frame(scene, None) as snapshot:
        bake_assets(
            snapshot, (environment.NAME, virtual_objects.NAME), folder, reflectors=REFLECTORS, tracer=partial(trace, scene=scene),
            progress=lambda share, text: progress(0.8 * share, f"errors: {text}") or True,
        )  # fmt: skip
        progress(0.8, "errors: the truth")
        judged = judge(scene, snapshot, SIZE, folder, None, PATHS, "gpu", lambda share, text: None)
        answers = {name: _answer(judged, baked_in(folder, snapshot, name)) for name in METHODS}
    return _told(judged, answers)


def _answer(judged, baked):
    """Of the covered pixels: (radiance (N, 3), drawn (N,) bool, at its place (N,) bool)."""
    from ..gpu.renderer import Renderer

    mask = judged.ray_map.covered()
    renderer = Renderer(judged.snapshot, {name: baked.assets[name] for name in REFLECTORS}, look=judged.look, surfaces=baked.surfaces)
    try:
        answer = renderer.answer(judged.camera)
    finally:
        renderer.free()
    off = np.linalg.norm(answer.position[mask].astype(np.float64) - judged.truth.hits.position, axis=1)
    return answer.radiance[mask], answer.status[mask] == STATUS_HIT, off < PLACE * judged.diagonal


def _told(judged, answers) -> list:
    truth = judged.truth.hits.radiance
    own = judged.ray_map.reflector[judged.ray_map.covered()]
    rows, ratios = [], []
    for name in REFLECTORS:
        mine = own == judged.ray_map.reflector_names.index(name)
        errors = [metrics.rmse(answers[method][0][mine], truth[mine]) for method in METHODS]
        radiance, drawn, placed = (values[mine] for values in answers[virtual_objects.NAME])
        square = np.square(radiance.astype(np.float64) - truth[mine]).sum(1)
        shares = [float(square[chosen].sum() / max(square.sum(), 1e-300)) for chosen in (drawn & placed, drawn & ~placed, ~drawn)]
        floor = metrics.rmse(judged.truth.second_radiance[mine], truth[mine])
        ratios.append(errors[-1] / errors[0])
        texts = (*(f"{error:.3f}" for error in errors), f"{ratios[-1]:.3f}", f"{floor:.3f}", f"{drawn.mean():.1%}", *(f"{share:.0%}" for share in shares))
        rows.append((name, f"{mine.sum():,}", *texts))
    heads = ("reflector", "pixels", *METHODS, "ratio", "floor", "drawn", "at its place", "elsewhere", "fell back")
    told = "; ".join(f"{line[0]} {line[4]} over {line[2]}, {line[1]} px" for line in rows)
    return [
        row(
            "I5-rmse", ratios, [MOST] * len(ratios), max(ratios) <= MOST,
            f"RMSE of radiance by virtual objects over environment's in kitchen, {SIZE[0]}x{SIZE[1]}, default settings, {PATHS} paths: {told}.",
        ),
        Exhibit(
            "What convex reflectors of kitchen show",
            "RMSE of scene-linear radiance by method, the last over the first, and between two truths (`floor`). The last three columns share out "
            f"the square error of virtual objects: drawn within {PLACE} of the diagonal from the truth's point, drawn elsewhere, and left to "
            "distance maps.",
            heads, tuple(rows),
        ),
    ]  # fmt: skip
