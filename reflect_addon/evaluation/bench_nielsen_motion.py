"""What cube maps that are kept between frames show wrong while everything moves, and how soon it is right again [nielsen-2002 2.3, 3.2].

"In general, it can be hard to distinguish flaws in secondary reflections on curved objects." Here they are numbers: (b)'s balls, block, wall and
floor all move, a frame makes one map of three, and each frame is compared with the one whose maps are all made for it. Then motion stops.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ..core.processes import temporary_folder
from ..core.snapshot import Instance, SceneSnapshot
from .bench_nielsen_drawn import Drawn, drawn
from .bench_row import row
from .exhibit import Exhibit

SIZE, MAP = (128, 96), 32  # px
FRAMES = 16  # in which everything moves
TURN = 2 * np.pi / 48  # of a circle, each frame
WAY = {"Sphere": 0.25, "Cube": 0.25}  # m, radius of the circle; of all others:
REST = 0.02
GROWTH = 1.5  # errors of the later half of the frames over those of the earlier: they do not add up
ZERO = 1e-3  # of the mean radiance that reflectors show: rounding of half floats


def measure(progress) -> list:
    """Rows for targets.json, and an Exhibit."""
    progress(0.0, "nielsen: baking what moves")
    with temporary_folder("reflect-bench-") as folder:
        scene = drawn("mirrors_b", SIZE, Path(folder))
        progress(0.5, "nielsen: everything moves")
        return told(*errors(scene))


def errors(scene: Drawn) -> tuple[list[float], list[int | None], int]:
    """(error of each frame, age of its oldest map, index of the first frame at rest; frames at rest that are said to be enough)."""
    reused, exact = (scene.renderer(curved=True, map_side=MAP, maps_per_frame=most) for most in (1, 100))
    maps = reused.mirrors.maps
    reused.settle(scene.camera), exact.settle(scene.camera)
    found, ages, enough = [], [], maps.frames_to_settle
    for frame in range(FRAMES + enough + 1):
        if frame < FRAMES:
            now = moved(scene.snapshot, frame + 1)
            reused.scene.update(now), exact.scene.update(now)
        shown = reused.answer(scene.camera, positions=False)
        exact.settle(scene.camera)
        right = exact.answer(scene.camera, positions=False)
        mask = right.coverage > 0
        off = np.sqrt(np.square(shown.radiance[mask] - right.radiance[mask]).mean())
        found.append(float(off / right.radiance[mask].mean()))
        ages.append(max(maps.kept.age(maps.frame)))
    reused.free(), exact.free()
    return found, ages, enough


def moved(scene: SceneSnapshot, frame: int) -> SceneSnapshot:
    """Everything on its circle."""
    return replace(scene, frame=frame, instances=tuple(_on_circle(i, n, frame) for n, i in enumerate(scene.instances)))


def _on_circle(instance: Instance, number: int, frame: int) -> Instance:
    radius = next((way for name, way in WAY.items() if instance.name.startswith(name)), REST)
    start, angle = 2.4 * number, 2.4 * number + TURN * frame
    step = np.eye(4)
    step[:2, 3] = radius * (np.cos(angle) - np.cos(start)), radius * (np.sin(angle) - np.sin(start))
    return replace(instance, world_from_object=step @ instance.world_from_object)


def told(found: list[float], ages: list[int], enough: int) -> list:
    moving, rest = found[:FRAMES], found[FRAMES:]
    settled = next((frame for frame, error in enumerate(rest) if max(rest[frame:]) <= ZERO), len(rest))
    fast = max(WAY.values()) * TURN
    halves = [max(moving[: FRAMES // 2]), max(moving[FRAMES // 2 :])]
    return [
        row("N-reused-error", halves, [halves[0], GROWTH * halves[0]], halves[1] <= GROWTH * halves[0],
            f"Largest RMS error of a frame over the mean of what reflectors show, of {FRAMES // 2} frames and of the next {FRAMES // 2}, which may be {GROWTH} "
            f"times as large: everything moves up to {fast:.3f} m a frame, one map of three is made in each; mean {np.mean(moving):.4f}, oldest map "
            f"{max(ages[:FRAMES])} frames."),
        row("N-reused-settled", settled, enough, settled <= enough, f"Frames at rest until the error is at most {ZERO} for good; said beforehand: {enough}."),
        Exhibit(
            "Cube maps kept while everything moves", f"Error of each frame over the mean of what reflectors show, and the age of its oldest map; after {FRAMES} frames "
            "motion stops.", ("frame", "error", "oldest map"),
            tuple((str(i + 1) + (" at rest" if i >= FRAMES else ""), f"{e:.5f}", str(a)) for i, (e, a) in enumerate(zip(found, ages, strict=True))),
        ),
    ]  # fmt: skip
