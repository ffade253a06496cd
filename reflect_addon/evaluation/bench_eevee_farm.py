"""Issue 7's render farm: an animation with a moving reflector, rendered from the command line by a Blender without the add-on.

Problem. A file of ours is baked at one frame and rendered at all, elsewhere. Do all frames come, and are they as right as the first?
Idea. Each method is baked at the first frame and put into the materials; another process renders all frames. Some are judged against Cycles' of the same file, as FLIP
on the reflector's pixels; one is rendered here, too, and must be the same to the bit. The last is also baked anew, which tells what moving away from the bake costs.
Limits. One scene. A stand-in leaves out what it leaves out (`box_proxy` the pillars, `environment` every distance, `light_field` what is beyond its cell), so errors grow as the
reflector leaves the place of its bake: they are reported, and nothing is asked of them.
"""

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ..core.methods import billboards, box_proxy, depth_maps, environment, light_field
from ..core.processes import temporary_folder
from ..scene.camera import camera_of
from ..scene.look import read_look
from ..scene.raymap_numpy import numpy_ray_map
from . import eye
from .assets import assets_for
from .bench_eevee_farm_scene import FRAMES, moving_body, render_alone, still, what_is_wrong
from .bench_row import row
from .exhibit import Exhibit
from .frame import open_frame
from .native_file import write_native

METHODS = tuple(m.NAME for m in (environment, box_proxy, billboards, depth_maps, light_field))
BAKE = {"resolution": 128, "samples": 1, "view_texels": 64, "sky_error": 0}
JUDGED = (1, 10, 20, FRAMES)
AGAIN = 20  # the frame that is rendered here, too


@dataclass(frozen=True)
class Animation:
    """One method's frames."""

    method: str
    wrong: tuple[str, ...]  # sentences; none when all is well
    flip: tuple[float, ...]  # of the JUDGED frames
    anew: float  # of the last frame, baked there
    pictures: tuple[np.ndarray, ...]  # (H, W, 3) display-encoded, of the JUDGED frames

    def grown(self) -> float:
        return self.flip[-1] / max(self.anew, 1e-9)


@dataclass(frozen=True)
class Truths:
    """Cycles' pictures of the JUDGED frames, display-encoded, and which of their pixels the reflector covers."""

    look: object
    pictures: tuple[np.ndarray, ...]
    masks: tuple[np.ndarray, ...]

    def flip(self, picture: np.ndarray, number: int) -> float:
        return eye.flip(self.look.apply(picture), self.pictures[number], self.masks[number])[0]


def measure(progress, methods: tuple[str, ...] = METHODS) -> list:
    """Rows for targets.json, and an Exhibit."""
    with temporary_folder("reflect-farm-") as folder:
        first = _saved(folder / "first", (1, FRAMES))
        last = _saved(folder / "last", (FRAMES, FRAMES))
        truths = _truths(first, folder)
        found = []
        for number, method in enumerate(methods):
            say = lambda share, text, n=number, m=method: progress((n + share) / len(methods), f"farm, {m}: {text}")
            found.append(_animation(method, first, last, truths, say))
    return [*told(found), _exhibit(found, truths)]


def _saved(folder: Path, frames: tuple[int, int]) -> Path:
    scene = moving_body()
    scene.frame_start, scene.frame_end = frames
    scene.frame_set(frames[0])
    folder.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "farm.blend"))
    return folder / "farm.blend"


def _truths(blend: Path, folder: Path) -> Truths:
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    scene = bpy.context.scene
    look, pictures, masks = read_look(scene), [], []
    for frame in JUDGED:
        pictures.append(look.apply(still(frame, "CYCLES", folder / f"truth{frame}.exr")))
        with open_frame(scene, frame) as snapshot:
            camera = camera_of(scene, scene.camera, scene.render.resolution_x, scene.render.resolution_y)
            masks.append(numpy_ray_map(snapshot, camera).covered())
    return Truths(look, tuple(pictures), tuple(masks))


def _animation(method: str, first: Path, last: Path, truths: Truths, say) -> Animation:
    say(0.0, "baking, twice")
    out, anew = (_native(method, blend) for blend in (first, last))
    say(0.2, f"another Blender renders {FRAMES} frames")
    frames = render_alone(out)
    wrong = what_is_wrong(frames, FRAMES)
    say(0.8, "judging")
    (fresh,) = render_alone(anew)
    bpy.ops.wm.open_mainfile(filepath=str(out))
    if len(frames) == FRAMES:
        here = still(AGAIN, "BLENDER_EEVEE", out.parent / "here.exr")
        if not np.array_equal(here, frames[AGAIN - 1]):
            wrong.append(f"frame {AGAIN} differs by {np.abs(here - frames[AGAIN - 1]).max():.2g} from the one rendered here")
    judged = [frames[min(frame, len(frames)) - 1] for frame in JUDGED]
    flips = tuple(truths.flip(picture, k) for k, picture in enumerate(judged))
    return Animation(method, tuple(wrong), flips, truths.flip(fresh, -1), tuple(map(truths.look.apply, judged)))


def _native(method: str, blend: Path) -> Path:
    """The file with the method in its materials, baked at the frame that it was saved at."""
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    scene, out = bpy.context.scene, blend.parent / method / "native.blend"
    silent = lambda share, text: None
    with open_frame(scene, None) as snapshot:
        folder = assets_for(scene, snapshot, method, blend.parent, BAKE, silent).folder
    write_native(scene, method, folder, out, pack=True, progress=silent)
    return out


def told(found: list[Animation]) -> list[dict]:
    wrong = [f"{one.method}: {sentence}" for one in found for sentence in one.wrong]
    errors = "; ".join(f"{one.method} {' '.join(f'{f:.3f}' for f in one.flip)}, baked at the last {one.anew:.3f}" for one in found)
    frames = ", ".join(map(str, JUDGED))
    return [
        row("I7-farm", len(wrong), 0, not wrong,
            f"What is wrong with {FRAMES} frames of a moving reflector rendered by a Blender without the add-on: {'; '.join(wrong) or 'nothing'}. Every frame is there, none black, each "
            f"another than the one before, and frame {AGAIN} is to the bit what this Blender renders. Methods: {', '.join(one.method for one in found)}."),
        row("I7-farm-error", [one.grown() for one in found], None, True,
            f"FLIP on the reflector's pixels of the last frame, baked at the first, over the same baked at the last. Frames {frames} against Cycles, baked at the first: {errors}."),
    ]  # fmt: skip


def _exhibit(found: list[Animation], truths: Truths) -> Exhibit:
    rows = tuple((one.method, *(f"{f:.4f}" for f in one.flip), f"{one.anew:.4f}", f"{one.grown():.2f}") for one in found)
    best = min(found, key=lambda one: one.flip[-1])
    shown = [(f"truth, frame {frame}", picture) for frame, picture in zip(JUDGED, truths.pictures)]
    shown += [(f"{best.method}, frame {frame}, FLIP {flip:.3f}", p) for frame, flip, p in zip(JUDGED, best.flip, best.pictures)]
    return Exhibit(
        "Native reflections on a render farm",
        f"A reflector moves and turns; {FRAMES} frames rendered by a Blender without the add-on, from a bake of the first. FLIP on the reflector's pixels against Cycles.",
        ("method", *(f"frame {frame}" for frame in JUDGED), "last, baked anew", "grown"),
        rows,
        tuple(shown),
    )
