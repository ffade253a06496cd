"""Issue 5's animation: what virtual objects flicker while their reflector moves, over what the truth does.

`columns` in its own 60 frames, in which the mirror ball wanders through the room. Everything is baked once, at FIRST; then each frame is
drawn by the one renderer, as the viewport does it: searches start where the last frame's ended. The truth is Cycles along the same rays,
twice with other noise (flicker.py says what is compared). So surfaces keep the light that they had at the bake, with the ball's shadow
where it was then.
"""

from contextlib import contextmanager
from functools import partial

import numpy as np

from ..core import metrics
from ..core.methods import virtual_objects
from ..core.processes import temporary_folder
from ..core.spaces import STATUS_HIT
from ..scene.bake import bake_assets
from ..scene.camera import camera_of
from ..scene.look import read_look
from ..scene.raytrace import trace
from .assets import baked_in
from .bench_row import row
from .bench_yu_columns import frame_of
from .bench_yu_scene import columns
from .flicker import flicker
from .frame import open_frame

FIRST, FRAMES = 1, range(1, 61)
SIZE, PATHS = (96, 72), 32  # px; Cycles' paths a ray of each truth
MOST = 2.0  # times the truth's own


def measure(progress) -> list[dict]:
    """A row for targets.json."""
    progress(0.0, "flicker: baking columns")
    scene = columns()
    with temporary_folder("reflect-bench-") as folder, open_frame(scene, FIRST) as snapshot:
        bake_assets(snapshot, (virtual_objects.NAME,), folder, tracer=partial(trace, scene=scene))
        baked = baked_in(folder, snapshot, virtual_objects.NAME)
    masks, radiances, drawn, errors = [], [], [], []
    with drawing(snapshot, baked) as renderer:
        for number in FRAMES:
            progress(0.2 + 0.8 * (number - FIRST) / len(FRAMES), f"flicker: frame {number}")
            frame = frame_of(scene, number, SIZE, PATHS, truths=2)
            renderer.scene.update(frame.snapshot)
            answer = renderer.answer(camera_of(scene, None, *SIZE))
            own = answer.radiance[frame.mask]
            masks.append(frame.mask)
            radiances.append([own, *(truth.radiance for truth in frame.truths)])
            drawn.append(float((answer.status[frame.mask] == STATUS_HIT).mean()))
            errors.append(metrics.rmse(own, frame.truths[0].radiance))
    return [of_frames(masks, radiances, read_look(scene), drawn, errors)]


@contextmanager
def drawing(snapshot, baked):
    """A renderer of what was baked (assets.Baked), for the length of a block."""
    from ..gpu.renderer import Renderer

    renderer = Renderer(snapshot, baked.assets, surfaces=baked.surfaces)
    try:
        yield renderer
    finally:
        renderer.free()


def of_frames(masks, radiances, look, drawn: list[float], errors: list[float]) -> dict:
    """The row: masks and radiances as flicker.flicker takes them; drawn, errors: by frame, what the sentence tells besides."""
    own, true = flicker(masks, radiances, look)
    ratio = own / true if true > 0 else (1e9 if own > 0 else 0.0)
    covered = [int(mask.sum()) for mask in masks]
    return row(
        "I5-flicker", ratio, MOST, ratio <= MOST,
        f"Root mean square of second differences in time of display values over the truth's own ({own:.4f} over {true:.4f}), {len(masks)} frames "
        f"of columns, {masks[0].shape[1]}x{masks[0].shape[0]}, the ball on {min(covered)} to {max(covered)} px; one bake, at frame {FIRST}. Pixels "
        f"that show virtual objects: {min(drawn):.1%} at least; RMSE of radiance {np.mean(errors):.4f}, {max(errors):.4f} at most.",
    )  # fmt: skip
