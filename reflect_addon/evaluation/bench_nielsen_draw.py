"""Targets of nielsen-2002 on drawing (Table 1): passes as made, static frames over dynamic ones, what culling saves, targets in bytes.

Passes are counted while they are drawn, with back faces culled as in the paper's program, and are those of its table and of the schedule
(bench_nielsen_counts.py). Times are ratios within this run, of processor time where the processor draws. The paper's speeds are of whole
frames at 640 x 480, of geometry as much as of pixels; a dynamic frame makes all maps, a static one none. "Simple frustrum culling improves the
frame rates by a factor of 2 to 3": judged as a mean, since (b)'s frame at rest has one reflection, which is seen.
Limits. (b)'s floor is a mirror here. Software draws pixels slowly and triangles fast, the paper's card the other way round.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..core.processes import temporary_folder
from ..core.reflection_tree import BACK_FACES_ONLY, NOTHING_CULLED, Culling
from ..gpu.timing import Work, frame_seconds, processor_clock, time_in_turns
from . import bench_nielsen_counts as counts
from . import bench_nielsen_culling as culling
from .bench_nielsen_drawn import Drawn, drawn
from .bench_nielsen_scene import SCENES
from .bench_row import row

SIZE = (160, 120)
MAP = 32  # px: 128 to 640, as the paper's cube maps to its pictures
LARGE = (320, 240)  # px, of what culling saves: of smaller views each costs much besides its pixels
TURNS, STEADY, MOST = 3, 0.3, 8  # s a turn, frames of it
HALF = 0.5  # culling at least halves the time
PIXEL = 8 + 16 + 4 + 3 * 16 + 8 + 4 + 8 + 4  # bytes: picture, ray map, answers, with their depths


def measure(progress) -> list:
    """Rows for targets.json, and an Exhibit of what each culling saves (bench_nielsen_culling.py)."""
    scenes = []
    with temporary_folder("reflect-bench-") as folder:
        for number, name in enumerate(SCENES):
            progress(0.6 * number / len(SCENES), f"nielsen: baking {name}")
            scenes.append(drawn(name, SIZE, Path(folder)))
        progress(0.6, "nielsen: drawing")
        rows = [*_passes(scenes), *_view_dependent(scenes), *_times(scenes), _targets(scenes)]
        return [*rows, *culling.table(scenes, _live, lambda share, text: progress(0.8 + 0.2 * share, f"nielsen, {text}"))]


def _live(scene: Drawn, culls: Culling | None = None):
    """A renderer with all its maps."""
    renderer = scene.renderer(culls, curved=True, map_side=MAP, maps_per_frame=100)
    renderer.settle(scene.camera)
    return renderer


def _passes(scenes: list[Drawn]) -> list[dict]:
    moving, still = [], []
    for scene in scenes:
        renderer = _live(scene, BACK_FACES_ONLY)
        for found, expire in ((moving, True), (still, False)):
            if expire:
                renderer.mirrors.maps.expire()
            before = renderer.counts()
            renderer.answer(scene.camera, positions=False)
            after = renderer.counts()
            found.append([after[name] - before[name] for name in ("views", "faces")])
            renderer.settle(scene.camera)
        renderer.free()
    (planar, faces), (planar_still, faces_still) = (list(map(list, zip(*found, strict=True))) for found in (moving, still))
    return [
        row("N-drawn-dynamic", planar, counts.DYNAMIC, planar == counts.DYNAMIC,
            "Planar reflections drawn in a frame in which everything moved, back faces culled; (a) to (d).", paper=counts.DYNAMIC),
        row("N-drawn-static", planar_still, counts.STATIC, planar_still == counts.STATIC, "The same while nothing but the camera moves.", paper=counts.STATIC),
        row("N-drawn-faces", faces, counts.FACES, faces == counts.FACES, "Faces of cube maps drawn in a frame in which everything moved.", paper=counts.FACES),
        row("N-drawn-static-faces", faces_still, [0] * 4, not any(faces_still), "The same while nothing but the camera moves."),
    ]  # fmt: skip


def _view_dependent(scenes: list[Drawn]) -> list[dict]:
    """Fig 5: a view of each mirror for each picture that shows it, curved ones too, in every frame."""
    found = []
    for culls in (BACK_FACES_ONLY, NOTHING_CULLED):
        views = []
        for scene in scenes:
            renderer = scene.renderer(culls, curved_views=True, map_side=MAP)
            renderer.answer(scene.camera, positions=False)
            views.append(renderer.counts()["views_drawn"])
            renderer.free()
        found.append(views)
    culled, unculled = found
    return [
        row("N-drawn-view-dependent", culled, counts.DEPENDENT, culled == counts.DEPENDENT,
            "Reflections drawn in a frame by the view-dependent method, curved ones by one view each, back faces culled; (a) to (d).",
            paper=counts.DEPENDENT),
        row("N-drawn-view-dependent-unculled", unculled, counts.NO_CULLING, unculled == counts.NO_CULLING,
            "The same without any culling, the mirror that a view was made by left out."),
    ]  # fmt: skip


def _times(scenes: list[Drawn]) -> list[dict]:
    speeds, at_rest, shares, over_paper = [], [], [], []
    for scene in scenes:
        paper = _live(scene, BACK_FACES_ONLY)
        still = paper.work(scene.camera)

        def expired(maps=paper.mirrors.maps, still=still):
            maps.expire()
            still.submit()

        moving = _ms([Work(expired, still.finish)])[0]
        paper.settle(scene.camera)
        at_rest += _ms([still])
        speeds.append(moving / at_rest[-1])
        paper.free()
        renderers = [_live(scene, culls) for culls in (Culling(), NOTHING_CULLED, BACK_FACES_ONLY)]
        best, none, back = _ms([renderer.work(replace(scene.camera, width=LARGE[0], height=LARGE[1])) for renderer in renderers])
        shares.append(best / none)
        over_paper.append(best / back)
        for renderer in renderers:
            renderer.free()
    mean = float(np.exp(np.mean(np.log(shares))))
    return [
        row("N-speed", speeds, None, min(speeds) > 1,
            f"Time of a frame in which everything moved over one at rest, back faces culled, {SIZE[0]}x{SIZE[1]}, cube maps of {MAP}; at rest "
            f"{_said(at_rest)} ms here.", paper=counts.SPEED),
        row("N-culling-time", mean, HALF, mean <= HALF,
            f"Time of a frame at rest with every culling over none, geometric mean of four scenes, {LARGE[0]}x{LARGE[1]}: {_said(shares)}; over back faces "
            f"alone {_said(over_paper)}. The paper's is of frustum culling."),
    ]  # fmt: skip


def _ms(works: list[Work]) -> list[float]:
    """Of a frame each, in turns; short frames are repeated."""
    frames = [int(np.clip(STEADY / max(frame_seconds(work), 1e-6), 1, MOST)) for work in works]
    times = time_in_turns(works, TURNS, min(frames), processor_clock())
    return [times.median(number) for number in range(len(works))]


def _said(numbers) -> str:
    return ", ".join(f"{n:.3g}" for n in numbers)


def _targets(scenes: list[Drawn]) -> dict:
    """Bytes of all targets over those of one a level."""
    ours, asked = [], []
    for scene in scenes:
        renderer = scene.renderer(BACK_FACES_ONLY, curved=False)
        renderer.answer(scene.camera, positions=False)
        ours.append(renderer.mirrors.targets.bytes())
        asked.append(renderer.mirrored_views.levels * scene.camera.width * scene.camera.height * PIXEL)
        renderer.free()
    return row(
        "N-level-bytes", ours, asked, all(a <= b for a, b in zip(ours, asked, strict=True)),
        f"Bytes of the targets of mirrored views at {SIZE[0]}x{SIZE[1]}: one set a level, of {PIXEL} bytes a pixel, however many mirrors there are.",
    )  # fmt: skip
