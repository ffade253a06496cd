"""One frame, every method: draw, compare with the truth, time, and write rows and pictures.

The rays are those of the ray map: the renderer's with backend 'gpu', Blender's BVH tree's with 'numpy'. Methods answer
them with footprint 0, the truth is traced along them (evaluation/truth.py); so the numbers judge each method's geometry
and radiance, not its filter. Times and the composite picture are those of the real frame, filter included.
"""

from dataclasses import asdict, dataclass, replace
from pathlib import Path

import bpy
import numpy as np

from ..core import methods as registry
from ..core import metrics
from ..core.asset import asset_of
from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.lamp_hits import with_lamps
from ..core.look import Look
from ..core.progress import Progress, teller
from ..core.rays import RayMap, Rays
from ..core.snapshot import SceneSnapshot
from ..gpu.timing import frame_seconds, time_in_turns
from ..scene.bake import chosen_reflectors
from ..scene.freshness import remarks
from ..scene.look import read_look
from . import eye, peer
from .assets import assets_for
from .backends import GpuBackend, NumpyBackend
from .frame import open_frame
from .pictures import frame_files, method_files, placed
from .rows import Row, write_rows
from .truth import SEEDS, Truth, key_of, lifted, truth_of

BACKENDS = {"gpu": GpuBackend, "numpy": NumpyBackend}
TIMED = {"turns": 5, "frames": 2}
# A frame that takes longer than this, s, is timed fewer times, beside the base alone.
SLOW, TIMED_SLOW = 0.5, {"turns": 2, "frames": 1}
REPORTED = 3  # assets of a method that a row's notes describe


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
    backend: str  # a key of BACKENDS: whose ray map it is
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

    methods: registered names, and 'eevee' for EEVEE's own picture (evaluation/peer.py: a row per setting).

    settings: of the bakes (resolution, samples ...), over each method's defaults. Assets are read from the scene's folder
    when fresh, else baked there, or below `out` where that folder cannot be written. ReflectError says what is missing.
    """
    say = teller(progress, "The evaluation")
    for name in methods:
        if name != peer.NAME:
            registry.get(name)
    out = Path(out)
    with open_frame(scene, frame, say) as snapshot:
        chosen_reflectors(snapshot, ())
        say(0.02, "reading the scene")
        judged = judge(scene, snapshot, size, out, camera, samples, backend, say)
        frame_files(judged, out)
        rows, runs = [], {}
        for number, name in enumerate(methods):
            share = 0.4 + 0.6 * number / len(methods)
            if name == peer.NAME:
                say(share, "eevee: drawing in another process")
                rows += _peer_rows(scene, judged, out, lambda s, t: say(share + s * 0.6 / len(methods), t))
                continue
            baked = assets_for(
                scene, snapshot, name, out, settings, lambda s, t: say(share + s * 0.3 / len(methods), f"{name}: {t}")
            )
            say(share + 0.4 / len(methods), f"{name}: drawing and comparing")
            run = BACKENDS[backend](snapshot, baked.assets, judged.look, judged.camera, judged.ray_map, baked.surfaces)
            runs[len(rows)] = run
            rows.append(_row(judged, name, baked.assets, run, out, settings or {}))
    say(0.98, "timing")
    rows = _with_times(rows, runs)
    write_rows(rows, out)
    say(1.0, f"wrote {out / 'results.json'}")
    return rows


def judge(scene, snapshot, size, out, camera_name, samples, backend, say) -> Judged:
    """Ray map and truth of one frame."""
    from ..scene.camera import camera_of
    from ..scene.intersect import intersector
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
    if snapshot.lamps:
        rays = lifted(ray_map, diagonal)
        truth = replace(truth, hits=with_lamps(truth.hits, rays, snapshot, intersector(snapshot)))
    look = read_look(scene)
    label = Path(bpy.data.filepath).stem or scene.name
    mask = ray_map.covered()
    picture = look.apply(placed(truth.frame, mask, truth.hits.radiance))
    return Judged(
        label, (camera_object or scene.camera).name, camera, snapshot, ray_map, lifted(ray_map, 0.0), truth, backend, picture,
        look, diagonal, samples,
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


def _row(judged: Judged, name: str, assets: dict, run, out: Path, asked: dict) -> Row:
    answer = run.answer()
    truth = judged.truth.hits
    picture, scores, notes = _scores(judged, answer.radiance)
    notes += run.notes
    cost = run.cost()
    bad = metrics.nonfinite(answer.radiance, answer.coverage, answer.position)
    if bad:
        notes.append("Values that are not finite count as black in the errors.")
    unanswered = sorted(i.name for i in judged.snapshot.reflectors() if asset_of(assets, i) is None)
    if unanswered:
        notes.append(f"No asset answers for: {', '.join(unanswered)}.")
    kinds = list({id(a): a for a in assets.values()}.values())
    notes += dict.fromkeys(sentence for asset in kinds for sentence in remarks(asset, judged.snapshot))
    if report := getattr(registry.get(name), "report", None):
        notes += dict.fromkeys(report(asset) for asset in kinds[:REPORTED])
    first = kinds[0].settings if kinds else {}
    error = metrics.hit_distance_error(answer, truth, judged.rays, judged.diagonal)
    return Row(
        **_whose(judged),
        method=name,
        settings={**asked, **first, **_truth_settings(judged)},
        device=run.device,
        backend=run.backend,
        **scores,
        **asdict(metrics.hit_errors(answer, truth, judged.rays, judged.diagonal)),
        bake_s=float(sum(a.bake_seconds for a in kinds)),
        bytes=int(sum(a.bytes() for a in kinds)),
        nonfinite=bad,
        pictures=method_files(judged, name, picture, out, hit_error=error, composite=run.composite(judged.truth)),
        notes=tuple(notes),
        **cost,
    )


def _peer_rows(scene: bpy.types.Scene, judged: Judged, out: Path, say: Progress) -> list[Row]:
    """EEVEE's rows: the same pixels and truth, but no hit points, no passes to time and nothing that was baked."""
    job = peer.job_of(scene, judged.camera_name, judged.camera, judged.snapshot, judged.ray_map)
    values = judged.snapshot.geometry_hash, peer.eevee_values(scene), bpy.app.version_string
    kept = out / "truth" / f"eevee-{peer.key_of(job, judged.camera, judged.ray_map, *values)}.npz"
    rows = []
    for found in peer.pictures_of(job, judged.ray_map, lambda j, folder: peer.draw_apart(j, folder, say), kept):
        picture, scores, notes = _scores(judged, found.radiance)
        rows.append(
            Row(
                **_whose(judged),
                method=peer.NAME,
                settings={**found.setting, "samples": job.samples, "probe_side": job.probe_side, **_truth_settings(judged)},
                device=found.device,
                backend="EEVEE",
                **scores,
                nonfinite=metrics.nonfinite(found.radiance),
                pictures=method_files(judged, f"{peer.NAME}{len(rows) or ''}", picture, out),
                counts={"samples": job.samples, "probes": found.probes if found.setting["sphere_probe"] else 0},
                notes=(*notes, *found.notes()),
            )
        )
    return rows


def _whose(judged: Judged) -> dict:
    """The fields of a row that say what was drawn."""
    return {
        "scene": judged.scene,
        "camera": judged.camera_name,
        "frame": judged.snapshot.frame,
        "size": f"{judged.camera.width}x{judged.camera.height}",
        "blender": bpy.app.version_string,
        "pixels": int(judged.ray_map.covered().sum()),
    }


def _truth_settings(judged: Judged) -> dict:
    return {"truth_samples": judged.samples, "truth_seeds": list(SEEDS)}


def _scores(judged: Judged, radiance: np.ndarray) -> tuple[np.ndarray, dict, list[str]]:
    """(display-encoded picture with this radiance (N, 3) in the covered pixels, the row's errors of it, notes)."""
    mask, truth = judged.ray_map.covered(), judged.truth.hits.radiance
    picture = judged.look.apply(placed(judged.truth.frame, mask, radiance))
    flip, flip_note = eye.flip(picture, judged.truth_picture, mask)
    ssim, ssim_note = eye.ssim(picture, judged.truth_picture, mask)
    errors = {
        "rmse": metrics.rmse(radiance, truth),
        "relmse": metrics.relmse(radiance, truth),
        "median_relative": metrics.median_relative(radiance, truth),
        "flip": flip,
        "ssim": ssim,
        "floor_rmse": metrics.rmse(judged.truth.second_radiance, truth),
    }
    return picture, errors, [n for n in (flip_note, ssim_note) if n]


def _with_times(rows: list[Row], runs: dict[int, object]) -> list[Row]:
    """The rows with their times; runs: row's index -> what draws it. Rows without one (a peer) have no time."""
    works = {i: run.work() for i, run in runs.items()}
    base = next((i for i in works if rows[i].method == "environment"), None)
    slow = [i for i, work in works.items() if i != base and frame_seconds(work) > SLOW]
    out = list(rows)
    for chosen, how in (([i for i in works if i not in slow], TIMED), *(([i], TIMED_SLOW) for i in slow)):
        timed = [*dict.fromkeys([*([base] if base is not None else []), *chosen])]
        times = time_in_turns([works[i] for i in timed], **how)
        for i in chosen:
            at = timed.index(i)
            ratio = None if base is None else times.ratio(at, timed.index(base))
            out[i] = replace(rows[i], ms=times.median(at), ms_spread=times.spread(at), ms_vs_environment=ratio)
    return out


def _guard(say: Progress) -> Progress:
    """Passes a part's words on, at the share where the truth is traced."""
    return lambda share, text: say(0.05 + 0.3 * share, text)
