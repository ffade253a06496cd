"""One frame, every method: draw, compare with the truth, time, and write rows and pictures.

The rays are those of the ray map: the renderer's with backend 'gpu', Blender's BVH tree's with 'numpy'. Methods answer
them with footprint 0, the truth is traced along them (evaluation/truth.py); so the numbers judge each method's geometry
and radiance, not its filter. Times and the composite picture are those of the real frame, filter included.
"""

from dataclasses import replace
from functools import partial
from pathlib import Path

import bpy

from ..core import methods as registry
from ..core.progress import Progress, teller
from ..gpu.timing import frame_seconds, time_in_turns
from ..scene.bake import chosen_reflectors
from ..scene.eevee_job import Groups
from . import native, peer
from .assets import Baked, assets_for
from .backends import GpuBackend, NumpyBackend
from .eevee_apart import draw_apart
from .frame import open_frame
from .judged import Judged, judge
from .pictures import frame_files
from .rows import Row, write_rows
from .scored import group_row, method_row, peer_rows

BACKENDS = {"gpu": GpuBackend, "numpy": NumpyBackend}
TIMED = {"turns": 5, "frames": 2}
# A frame that takes longer than this, s, is timed fewer times, beside the base alone.
SLOW, TIMED_SLOW = 0.5, {"turns": 2, "frames": 1}
EEVEE = "eevee"  # as node groups, in another process


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
    assets: Path | None = None,
    progress: Progress | None = None,
) -> list[Row]:
    """Evaluates methods on one frame; writes out/results.json and out/pictures and returns the rows.

    methods: registered names, and 'eevee' for EEVEE's own picture (evaluation/peer.py: a row per setting).

    settings: of the bakes (resolution, samples ...), over each method's defaults. Assets are read from the scene's folder
    when fresh, else baked there, or below `out` where that folder cannot be written; those of the folder `assets` are only read, and must be fresh. ReflectError says what is missing.
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
        if backend == EEVEE:
            rows = _in_eevee(scene, judged, methods, out, settings or {}, assets, say)
        else:
            rows = _here(scene, judged, methods, out, settings or {}, assets, say)
    write_rows(rows, out)
    say(1.0, f"wrote {out / 'results.json'}")
    return rows


def _here(scene: bpy.types.Scene, judged: Judged, methods: tuple[str, ...], out: Path, settings: dict, given: Path | None, say: Progress) -> list[Row]:
    """Methods by one of BACKENDS, timed in turns; EEVEE's own picture from another process."""
    rows, runs = [], {}
    for number, name in enumerate(methods):
        share = 0.4 + 0.58 * number / len(methods)
        if name == peer.NAME:
            say(share, "eevee: drawing in another process")
            rows += _peer_rows(scene, judged, out, lambda s, t: say(share + s * 0.58 / len(methods), t))
            continue
        baked = assets_for(
            scene, judged.snapshot, name, out, settings, lambda s, t: say(share + s * 0.3 / len(methods), f"{name}: {t}"), given
        )
        say(share + 0.4 / len(methods), f"{name}: drawing and comparing")
        run = BACKENDS[judged.backend](judged.snapshot, baked.assets, judged.look, judged.camera, judged.ray_map, baked.surfaces)
        runs[len(rows)] = run
        answer = run.answer()
        size = int(sum(a.bytes() for a in {id(a): a for a in baked.assets.values()}.values()))
        rows.append(
            method_row(
                judged, name, baked.assets, answer, out, settings, notes=run.notes, device=run.device, backend=run.backend, bytes=size,
                composite=run.composite(judged.truth), **run.cost(),
            )
        )  # fmt: skip
    say(0.98, "timing")
    return _with_times(rows, runs)


def _peer_rows(scene: bpy.types.Scene, judged: Judged, out: Path, say: Progress) -> list[Row]:
    job = peer.job_of(scene, judged.camera_name, judged.camera, judged.snapshot, judged.ray_map)
    values = judged.snapshot.geometry_hash, peer.eevee_values(scene), bpy.app.version_string
    kept = out / "truth" / f"eevee-{peer.key_of(job, judged.camera, judged.ray_map, *values)}.npz"
    pictures = peer.pictures_of(job, judged.ray_map, lambda j, folder: draw_apart(j, folder, say), kept)
    return peer_rows(judged, job.samples, job.probe_side, pictures, out)


def _in_eevee(scene: bpy.types.Scene, judged: Judged, methods: tuple[str, ...], out: Path, settings: dict, given: Path | None, say: Progress) -> list[Row]:
    """Methods as node groups, and EEVEE's own picture beside them in the same process, so that times compare."""
    ours = [name for name in methods if name != peer.NAME]
    baked: dict[str, Baked] = {}
    for number, name in enumerate(ours):
        share = 0.4 + 0.3 * number / len(ours)
        if name in (*registry.gathering(), registry.AUTO):
            baked[name] = assets_for(scene, judged.snapshot, name, out, settings, lambda s, t, share=share, name=name: say(share + s * 0.3 / len(ours), f"{name}: {t}"), given)
    job = peer.job_of(scene, judged.camera_name, judged.camera, judged.snapshot, judged.ray_map)
    groups = tuple(Groups(name, str(baked[name].folder) if name in baked else "") for name in ours)
    job = replace(job, groups=groups, settings=job.settings if peer.NAME in methods else ())
    pictures, drawn = native.draw(job, judged.ray_map, partial(draw_apart, say=lambda s, t: say(0.7 + 0.28 * s, t)))
    rows = []
    for name in methods:
        if name == peer.NAME:
            rows += peer_rows(judged, job.samples, job.probe_side, pictures, out)
        else:
            found = drawn[ours.index(name)]
            rows.append(group_row(judged, found, baked[name].assets if name in baked else {}, job.samples, out, settings))
    return _over_environment(rows)


def _over_environment(rows: list[Row]) -> list[Row]:
    base = next((row.ms for row in rows if row.method == "environment" and row.ms), None)
    return [replace(row, ms_vs_environment=row.ms / base) if base and row.ms is not None else row for row in rows]


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
