"""Targets of nielsen-2002 that are errors: what planar mirrors show against Cycles, first order and mirrors in mirrors to depth 8.

The first is one mirror at default settings, beside what an environment map makes of it. Depths are judged with `endless` off, as the
paper and renderers end: the rays judged are those that left a mirror, so depth d is Cycles with d - 1 more glossy bounces. A room is
baked once: depth and `endless` decide only what is drawn. A frame's time, over that of the first depth, may grow no faster than the
number of its views.
"""

from dataclasses import replace
from functools import partial

import bpy
import numpy as np

from ..core import metrics
from ..core.errors import ReflectError
from ..core.methods import environment, recursive
from ..core.processes import temporary_folder
from ..scene.bake import bake_assets
from ..scene.raytrace import trace
from . import bench_nielsen_rooms as rooms
from . import eye
from .assets import Baked, baked_in
from .backends import GpuBackend
from .bench_row import row
from .exhibit import Exhibit
from .frame import open_frame
from .judged import Judged, judge
from .maps import difference_map
from .pictures import placed

# px; Cycles' paths a ray, of depths and of one mirror, where noise of 64 would be more than half of what is allowed.
SIZE, SAMPLES, CLOSE = (160, 90), 64, 256
HIT, FLIP, RMSE = 0.001, 0.05, 0.1  # the issue's, of a first-order mirror; RMSE over environment's
DEEP_FLIP = 0.07  # the issue's, at every depth
DEPTHS = (2, 3, 4, 5, 6, 7, 8)
# Of the maps, which answer nothing of what is judged but environment's own picture; surfaces and views are made as by default.
MAPS = {"resolution": 128, "samples": 4, "sky_error": 0}
TURNS, FRAMES = 15, 4  # of a few milliseconds: single ones scatter by a tenth and more
GROWTH = 1.1  # how much more than the views time may grow: what ratios of one run scatter by
SHOWN = (2, 8)  # depths that are shown


def measure(progress) -> list:
    """Rows for targets.json, and Exhibits."""
    rows = first_order(lambda share, text: progress(0.3 * share, f"nielsen, one mirror: {text}"))
    lines, pictures, views, times = [], [], [], []
    for number, (name, build) in enumerate((("facing", rooms.facing), ("angle", rooms.angle))):
        start = 0.3 + 0.35 * number

        def tell(share: float, text: str, start=start, name=name):
            return progress(start + 0.35 * share, f"nielsen, {name}: {text}")

        found = deeper(build(), DEPTHS, tell)
        flips, floors, count, ratio = (list(column) for column in zip(*found["rows"], strict=True))
        rows.append(
            row(f"N-depth-{name}", flips, [DEEP_FLIP] * len(flips), max(flips) <= DEEP_FLIP,
                f"FLIP of two mirrors against Cycles at the same limit of glossy bounces, depths {DEPTHS[0]} to {DEPTHS[-1]}, `endless` off; "
                f"two truths differ by up to {max(floors):.3f}. {_what()}.")
        )  # fmt: skip
        views.append(count)
        times.append(ratio)
        columns = zip(DEPTHS, flips, floors, count, ratio, strict=True)
        lines += [(name, str(d), f"{flip:.3f}", f"{floor:.3f}", str(n), f"{time:.2f}") for d, flip, floor, n, time in columns]
        pictures += [(f"{name}, {caption}", picture) for caption, picture in found["pictures"]]
    return [*rows, *_work(views, times), _exhibit(lines, pictures)]


def _work(views: list[list[int]], times: list[list[float]]) -> list[dict]:
    """The views of both rooms' depths, and time against their growth since the first of them."""
    count, time = np.array(views, float), np.array(times)
    growth, allowed = time.ravel(), (count / count[:, :1]).ravel()
    which = f"Facing, then at an angle, depths {DEPTHS[0]} to {DEPTHS[-1]} each"
    return [
        row("N-depth-views", count.ravel().tolist(), None, True, f"Mirrored views of a frame, those that are seen. {which}."),
        row("N-depth-time", growth.tolist(), allowed.tolist(), bool((growth <= GROWTH * allowed).all()),
            f"Time of a frame, read-back included, over that of the first depth, against the growth of visible reflections, within {GROWTH - 1:.0%}. "
            f"{which}, {_what()}."),
    ]  # fmt: skip


def first_order(progress) -> list:
    """N-planar-*: one mirror, default settings."""
    scene = rooms.one_mirror()
    with temporary_folder("reflect-bench-") as folder, open_frame(scene, None) as snapshot:
        names = environment.NAME, recursive.NAME
        baked = bake_for(scene, snapshot, names, folder, MAPS, lambda share, text: progress(0.7 * share, text))
        progress(0.7, "the truth")
        judged = judge(scene, snapshot, SIZE, folder, None, CLOSE, "gpu", lambda share, text: None)
        answers = [_run(judged, one).answer() for one in baked]
        seconds = baked[1].surfaces.bake_seconds
    picture, flip = flip_of(judged, answers[1].radiance)
    _, floor = flip_of(judged, judged.truth.second_radiance)
    hit = metrics.hit_errors(answers[1], judged.truth.hits, judged.rays, judged.diagonal).hit_p95
    errors = [metrics.rmse(answer.radiance, judged.truth.hits.radiance) for answer in answers]
    ratio = errors[1] / errors[0]
    what = f"One planar mirror, default settings but for maps of {MAPS['resolution']} texels, {_what(CLOSE)}"
    return [
        row("N-planar-hit", hit, HIT, hit <= HIT, f"hit_p95, of the scene's diagonal. {what}."),
        row("N-planar-flip", flip, FLIP, flip <= FLIP,
            f"FLIP; two truths differ by {floor:.3f}, and surfaces took {seconds:.1f} s to bake. {what}."),
        row("N-planar-rmse", ratio, RMSE, ratio <= RMSE,
            f"RMSE of radiance over environment's: {errors[1]:.3g} over {errors[0]:.3g}. {what}."),
        Exhibit("What one planar mirror shows", f"{what}.", pictures=tuple(pictures_of(judged, picture, "one mirror"))),
    ]  # fmt: skip


def deeper(scene: bpy.types.Scene, depths: tuple[int, ...], progress, size=SIZE, samples=SAMPLES) -> dict:
    """rows: for each depth (FLIP, FLIP of two truths, views, frame's time over the first depth's); pictures: of depths SHOWN."""
    rows, pictures, runs = [], [], []
    with temporary_folder("reflect-bench-") as folder, open_frame(scene, None) as snapshot:
        (baked,) = bake_for(scene, snapshot, (recursive.NAME,), folder, MAPS, lambda share, text: progress(0.5 * share, text))
        for number, depth in enumerate(depths):
            progress(0.5 + 0.4 * number / len(depths), f"depth {depth}")
            scene.cycles.glossy_bounces = depth - 1
            judged = judge(scene, snapshot, size, folder / str(depth), None, samples, "gpu", lambda share, text: None)
            run = _run(judged, ending_at(baked, depth))
            picture, flip = flip_of(judged, run.answer().radiance)
            _, floor = flip_of(judged, judged.truth.second_radiance)
            runs.append(run)
            rows.append((flip, floor, run.views))
            if depth in SHOWN:
                pictures += pictures_of(judged, picture, f"depth {depth}")
        progress(0.9, "times")
        times = _times(runs)
    return {"rows": [(*line, time) for line, time in zip(rows, times, strict=True)], "pictures": pictures}


def ending_at(baked: Baked, depth: int) -> Baked:
    """The same, drawn to a depth and no deeper."""
    assets = {name: replace(one, settings={**one.settings, "depth": depth, "endless": False}) for name, one in baked.assets.items()}
    return replace(baked, assets=assets)


def bake_for(scene, snapshot, names, folder, settings, progress) -> list[Baked]:
    """What each of the methods draws from."""
    tracer = partial(trace, scene=scene)
    bake_assets(snapshot, names, folder, settings=settings, tracer=tracer, progress=lambda share, text: progress(share, text) or True)
    return [baked_in(folder, snapshot, name) for name in names]


def _run(judged: Judged, baked: Baked) -> GpuBackend:
    return GpuBackend(judged.snapshot, baked.assets, judged.look, judged.camera, judged.ray_map, baked.surfaces)


def flip_of(judged: Judged, radiance: np.ndarray) -> tuple[np.ndarray, float]:
    """(display-encoded picture with this radiance in the mirrors' pixels, its FLIP against the truth)."""
    mask = judged.ray_map.covered()
    picture = judged.look.apply(placed(judged.truth.frame, mask, radiance))
    flip, note = eye.flip(picture, judged.truth_picture, mask)
    if flip is None:
        raise ReflectError(note, "Install what requirements.txt lists.")
    return picture, flip


def _times(runs: list[GpuBackend]) -> list[float]:
    """Times of a frame over the first one's, the median of pairs of runs."""
    from ..gpu.timing import close_ratio, processor_clock

    base, *others = (run.work() for run in runs)
    return [1.0, *(close_ratio(work, base, TURNS, FRAMES, processor_clock()) for work in others)]


def pictures_of(judged: Judged, picture: np.ndarray, what: str) -> list[tuple[str, np.ndarray]]:
    difference = difference_map(picture, judged.truth_picture, judged.ray_map.covered())
    return [(f"{what}: the truth", judged.truth_picture), (f"{what}: mirrored views", picture), (f"{what}: difference", difference)]


def _what(samples: int = SAMPLES) -> str:
    return f"{SIZE[0]}x{SIZE[1]}, {samples} paths"


def _exhibit(lines, pictures) -> Exhibit:
    heads = ("room", "depth", "FLIP", "FLIP of two truths", "views", "time over the first depth")
    lead = f"Two mirrors against Cycles with the same limit of glossy bounces, `endless` off. {_what()}."
    return Exhibit("What two planar mirrors show, by depth", lead, heads, tuple(lines), tuple(pictures))
