"""Two mirrors that face each other, to no end: whether the last level shows, against Cycles with so many glossy bounces that none is missed.

What issue 6 asks of facing mirrors is a limit without a visible last level and without more work for it. The same frame is drawn at the default
depth with the series through drawn pictures (core/mirror_series.py), as it was with distance maps there, and at depth 12 with distance maps.
Deep frames are drawn with the coarser meshes of deep levels (core/coarse_surface.py) and without.
"""

from dataclasses import replace

import numpy as np

from ..core.methods import recursive
from ..core.processes import temporary_folder
from . import bench_nielsen_rooms as rooms
from .bench_nielsen_planar import MAPS, SAMPLES, SIZE, TURNS, bake_for, flip_of, pictures_of
from .bench_row import row
from .exhibit import Exhibit
from .frame import open_frame
from .judged import judge

BOUNCES = 32  # of Cycles: nine tenths to this power is 3 %, of a few pixels
DEPTH, DEEP = recursive.DEFAULTS["depth"], 12
# (caption, depth, whether series go on beyond it, whether meshes of deep levels are coarser).
DRAWN = (
    ("series", DEPTH, True, True), ("distance maps", DEPTH, False, True), ("distance maps, deep", DEEP, False, True),
    ("series, deep", DEEP, True, True), ("series, deep, fine meshes", DEEP, True, False),
)  # fmt: skip
LEFT = 0.5  # of the difference to a deep picture that distance maps make
TIME = 1.2  # of a frame, over one with distance maps
NOTICED, HALF = 0.003, 0.5  # FLIP; of the triangles
AS_DEEP = 1.05  # of FLIP at that depth, whose own end is some pixels


def measure(progress) -> list:
    """Rows for targets.json, and an Exhibit."""
    scene = rooms.facing()
    with temporary_folder("reflect-bench-") as folder, open_frame(scene, None) as snapshot:
        (baked,) = bake_for(scene, snapshot, (recursive.NAME,), folder, MAPS, lambda share, text: progress(0.6 * share, f"nielsen, endless: {text}"))
        progress(0.6, "nielsen, endless: the truth")
        scene.cycles.glossy_bounces, scene.cycles.max_bounces = BOUNCES, 2 * BOUNCES
        judged = judge(scene, snapshot, SIZE, folder, None, SAMPLES, "gpu", lambda share, text: None)
        progress(0.9, "nielsen, endless: frames")
        flips, pictures, times, triangles = _drawn(judged, baked)
    off = [float(np.abs(pictures[i] - pictures[2])[judged.ray_map.covered()].mean()) for i in (0, 1)]
    what = f"Facing mirrors, {SIZE[0]}x{SIZE[1]}, {SAMPLES} paths, depth {DEPTH}"
    against = [(f"{caption}, depth {depth}: FLIP {flip:.3f}", picture)
               for (caption, depth, *_), picture, flip in zip(DRAWN, pictures, flips, strict=True)]  # fmt: skip
    return [
        row("N-endless-flip", flips, None, flips[0] < flips[1] and flips[0] <= AS_DEEP * flips[2],
            f"FLIP against Cycles with {BOUNCES} glossy bounces: series through drawn pictures, distance maps, distance maps at depth {DEEP}. "
            f"Asked: less than the second, and no more than {AS_DEEP} of the third. {what}."),
        row("N-endless-level", off[0] / off[1], LEFT, off[0] <= LEFT * off[1],
            f"Mean difference of display values to the picture of depth {DEEP}, series over distance maps. {what}."),
        row("N-endless-time", times[0], TIME, times[0] <= TIME,
            f"Time of a frame over one with distance maps there; depth {DEEP} takes {times[2]:.2f} of it. {what}."),
        row("N-coarse-flip", flips[3:], None, flips[3] <= flips[4] + NOTICED,
            f"FLIP at depth {DEEP} with coarser meshes from the second level on, and without: no more than {NOTICED} worse. {what}."),
        row("N-coarse-triangles", sum(triangles[3].values()) / sum(triangles[4].values()), HALF, 2 * sum(triangles[3].values()) <= sum(triangles[4].values()),
            f"Triangles of surfaces at depth {DEEP}, coarser over fine; by level {_said(triangles[3])} instead of {_said(triangles[4])}."),
        row("N-coarse-time", times[3] / times[4], 1.0, times[3] <= times[4], f"Time of a frame at depth {DEEP}, coarser over fine meshes. {what}."),
        Exhibit("Mirrors that face each other, without an end", f"{what}.",
                pictures=(("Cycles", judged.truth_picture), *against, *pictures_of(judged, pictures[0], "series")[2:])),
    ]  # fmt: skip


def _drawn(judged, baked):
    """([FLIP], [picture], [time over the first's; its own over the second's], [triangles by level]) of DRAWN."""
    from ..gpu.renderer import Renderer
    from ..gpu.timing import close_ratio, processor_clock, time_in_turns

    flips, pictures, triangles, runs = [], [], [], []
    for _, depth, goes_on, coarse in DRAWN:
        assets = {name: replace(one, settings={**one.settings, "depth": depth, "cull_coarse_meshes": coarse}) for name, one in baked.assets.items()}
        renderer = Renderer(judged.snapshot, assets, look=judged.look, surfaces=baked.surfaces)
        renderer.mirrors.continues = goes_on
        radiance = renderer.answer(judged.camera).radiance[judged.ray_map.covered()]
        picture, flip = flip_of(judged, radiance)
        flips.append(flip)
        pictures.append(picture)
        triangles.append(dict(sorted(renderer.mirrors.triangles.items())))
        runs.append(renderer)
    works = [run.work(judged.camera) for run in runs]
    times = time_in_turns(works, TURNS, 1, processor_clock())
    ratios = [times.ratio(i, 0) or 1.0 for i in range(len(runs))]
    ratios[0] = close_ratio(works[0], works[1], 3 * TURNS, 1, processor_clock())
    for run in runs:
        run.free()
    return flips, pictures, ratios, triangles


def _said(triangles: dict[int, int]) -> str:
    return ", ".join(f"{count:,}" for count in triangles.values())
