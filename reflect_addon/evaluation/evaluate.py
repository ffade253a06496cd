"""One frame, every method: draw, compare with the truth, time, and write rows and pictures.

The rays are those of the ray map: the renderer's with backend 'gpu', Blender's BVH tree's with 'numpy'. Methods answer
them with footprint 0, the truth is traced along them (evaluation/truth.py); so the numbers judge each method's geometry
and radiance, not its filter. Times and the composite picture are those of the real frame, filter included.
"""

import re
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import bpy
import numpy as np

from ..core import methods as registry
from ..core import metrics
from ..core.camera import Camera
from ..core.errors import Cancelled, ReflectError
from ..core.look import Look
from ..core.rays import Answer, RayMap, Rays
from ..core.snapshot import SceneSnapshot
from ..scene.bake import chosen_reflectors
from ..scene.look import read_look
from . import eye, maps
from .assets import asset_of, assets_for
from .backends import GpuBackend, NumpyBackend
from .frame import open_frame
from .png import write_png
from .rows import Row, write_rows
from .truth import SEEDS, Truth, key_of, lifted, truth_of

Progress = Callable[[float, str], object]
BACKENDS = {"gpu": GpuBackend, "numpy": NumpyBackend}


@dataclass(frozen=True)
class Judged:
    """What all methods of one frame are judged against."""

    scene: str
    camera_name: str
    camera: Camera
    snapshot: SceneSnapshot
    ray_map: RayMap
    rays: Rays  # of the covered pixels
    truth: Truth
    truth_picture: np.ndarray  # (H, W, 3) display-encoded: the frame, its reflector pixels the truth of their rays
    look: Look
    diagonal: float
    samples: int


def evaluate(
    scene: bpy.types.Scene,
    methods: tuple[str, ...],
    size: tuple[int, int],
    out: Path,
    *,
    camera: str | None = None,
    frame: int | None = None,
    samples: int = 64,
    backend: str = "gpu",
    settings: dict[str, object] | None = None,
    progress: Progress | None = None,
) -> list[Row]:
    """Evaluates methods on one frame; writes out/results.json and out/pictures and returns the rows.

    settings: of the bakes (resolution, samples ...), over each method's defaults. Assets are read from the scene's folder
    when fresh, else baked there, or below `out` where that folder cannot be written. ReflectError says what is missing.
    """
    say = _teller(progress)
    for name in methods:
        registry.get(name)
    out = Path(out)
    with open_frame(scene, frame, say) as snapshot:
        chosen_reflectors(snapshot, ())
        say(0.02, "reading the scene")
        judged = judge(scene, snapshot, size, out, camera, samples, backend, say)
        rows = []
        for number, name in enumerate(methods):
            share = 0.4 + 0.6 * number / len(methods)
            assets = assets_for(
                scene, snapshot, name, out, settings, lambda s, t: say(share + s * 0.3 / len(methods), f"{name}: {t}")
            )
            say(share + 0.4 / len(methods), f"{name}: drawing, comparing and timing")
            rows.append(_row(judged, name, assets, backend, out, settings or {}))
    rows = _with_ratios(rows)
    write_rows(rows, out)
    say(1.0, f"wrote {out / 'results.json'}")
    return rows


def judge(scene, snapshot, size, out, camera_name, samples, backend, say) -> Judged:
    """Ray map and truth of one frame."""
    from ..scene.camera import camera_of
    from ..scene.raytrace import primary, trace

    camera_object = named_camera(scene, camera_name)
    camera = camera_of(scene, camera_object, *size)
    ray_map = BACKENDS[backend].ray_map(snapshot, camera)
    diagonal = snapshot.diagonal()
    if not diagonal > 0:
        raise ReflectError(f"The scene {scene.name} has no extent.", "Give its objects faces and a size.")
    key = key_of(ray_map, camera, snapshot.geometry_hash, samples, bpy.app.version_string)
    say(0.05, f"tracing the truth with Cycles, {samples} samples, twice, and the frame")
    truth = truth_of(
        ray_map,
        camera,
        diagonal,
        samples,
        lambda rays, **more: trace(rays, scene=scene, progress=_guard(say), **more),
        lambda view, **more: primary(view, scene=scene, progress=_guard(say), **more),
        out / "truth" / f"{key}.npz",
    )
    look = read_look(scene)
    label = Path(bpy.data.filepath).stem or scene.name
    mask = ray_map.covered()
    picture = look.apply(_placed(truth.frame, mask, truth.hits.radiance))
    stem = _file_name(f"{label}-{(camera_object or scene.camera).name}-{snapshot.frame}-{size[0]}x{size[1]}-{backend}")
    write_png(out / "pictures" / f"{stem}-frame.png", look.apply(truth.frame))
    write_png(out / "pictures" / f"{stem}-truth.png", picture)
    return Judged(
        label, (camera_object or scene.camera).name, camera, snapshot, ray_map, lifted(ray_map, 0.0), truth, picture, look,
        diagonal, samples,
    )  # fmt: skip


def named_camera(scene: bpy.types.Scene, name: str | None) -> bpy.types.Object | None:
    """The named camera object; None stands for the scene's. ReflectError lists those there are."""
    if name is None:
        return None
    found = scene.objects.get(name)
    if found is None or found.type != "CAMERA":
        there = [o.name for o in scene.objects if o.type == "CAMERA"]
        raise ReflectError(
            f"There is no camera named '{name}' in the scene {scene.name}.",
            f"Choose among: {', '.join(there)}." if there else "Add a camera to the scene.",
        )
    return found


def _row(judged: Judged, name: str, assets: dict, backend: str, out: Path, asked: dict) -> Row:
    mask = judged.ray_map.covered()
    run = BACKENDS[backend](judged.snapshot, assets, judged.look, judged.camera, judged.ray_map)
    answer = run.answer()
    truth = judged.truth.hits
    placed = _placed(judged.truth.frame, mask, answer.radiance)
    picture = judged.look.apply(placed)
    flip, flip_note = eye.flip(picture, judged.truth_picture, mask)
    ssim, ssim_note = eye.ssim(picture, judged.truth_picture, mask)
    notes = [n for n in (flip_note, ssim_note, *run.notes) if n]
    cost = run.cost()
    bad = metrics.nonfinite(answer.radiance, answer.coverage, answer.position)
    if bad:
        notes.append("Values that are not finite count as black in the errors.")
    unanswered = sorted(i.name for i in judged.snapshot.reflectors() if asset_of(assets, i) is None)
    if unanswered:
        notes.append(f"No asset answers for: {', '.join(unanswered)}.")
    kinds = list({id(a): a for a in assets.values()}.values())
    first = kinds[0].settings if kinds else {}
    return Row(
        scene=judged.scene,
        camera=judged.camera_name,
        frame=judged.snapshot.frame,
        size=f"{judged.camera.width}x{judged.camera.height}",
        method=name,
        settings={**asked, **first, "truth_samples": judged.samples, "truth_seeds": list(SEEDS)},
        device=run.device,
        backend=run.backend,
        blender=bpy.app.version_string,
        pixels=int(mask.sum()),
        rmse=metrics.rmse(answer.radiance, truth.radiance),
        relmse=metrics.relmse(answer.radiance, truth.radiance),
        median_relative=metrics.median_relative(answer.radiance, truth.radiance),
        flip=flip,
        ssim=ssim,
        floor_rmse=metrics.rmse(judged.truth.second_radiance, truth.radiance),
        **asdict(metrics.hit_errors(answer, truth, judged.rays, judged.diagonal)),
        bake_s=float(sum(a.bake_seconds for a in kinds)),
        bytes=int(sum(a.bytes() for a in kinds)),
        nonfinite=bad,
        pictures=_pictures(judged, name, backend, answer, picture, run.composite(judged.truth), out),
        notes=tuple(notes),
        **cost,
    )


def _pictures(judged: Judged, name: str, backend: str, answer: Answer, picture, composite, out: Path) -> dict[str, str]:
    mask = judged.ray_map.covered()
    size = f"{judged.camera.width}x{judged.camera.height}"
    frame = _file_name(f"{judged.scene}-{judged.camera_name}-{judged.snapshot.frame}-{size}-{backend}")
    error = metrics.hit_distance_error(answer, judged.truth.hits, judged.rays, judged.diagonal)
    made = {
        "answer": picture,
        "difference": maps.difference_map(picture, judged.truth_picture, mask),
        "hit_error": maps.hit_error_map(error, mask),
    }
    if composite is not None:
        made["composite"] = composite
    files = {"frame": f"pictures/{frame}-frame.png", "truth": f"pictures/{frame}-truth.png"}
    for what, image in made.items():
        files[what] = f"pictures/{frame}-{_file_name(name)}-{what}.png"
        write_png(out / files[what], image)
    return files


def _with_ratios(rows: list[Row]) -> list[Row]:
    base = next((r.ms for r in rows if r.method == "environment" and r.ms), None)
    if base is None:
        return rows
    return [replace(r, ms_vs_environment=None if r.ms is None else r.ms / base) for r in rows]


def _placed(frame: np.ndarray, mask: np.ndarray, radiance: np.ndarray) -> np.ndarray:
    """The frame with the covered pixels replaced: mirror radiance, without Fresnel and tint, which are not judged."""
    out = frame.copy()
    out[mask] = np.nan_to_num(radiance, nan=0.0, posinf=0.0, neginf=0.0)
    return out


def _file_name(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", text)


def _teller(progress: Progress | None) -> Progress:
    def say(share: float, text: str):
        if progress is not None and progress(share, text) is False:
            raise Cancelled("The evaluation")

    return say


def _guard(say: Progress) -> Progress:
    """Passes a part's words on, at the share where the truth is traced."""
    return lambda share, text: say(0.05 + 0.3 * share, text)
