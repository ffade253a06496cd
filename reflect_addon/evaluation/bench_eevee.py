"""Issue 7's targets: our methods as node groups against EEVEE's own pictures, and against the overlay, on the same pixels.

For each case one process draws EEVEE's own set-ups (peer.py) and ours, so that their times compare; on a software device that others share
they are CPU seconds. The best of ours and the best of theirs are those of the smallest FLIP on the reflectors' pixels. The overlay's answer is
the GPU's on the same rays, shown by the same view transform.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..core.processes import temporary_folder
from ..core.rays import Answer
from ..scene.eevee_job import Groups
from . import eye, native, peer
from .assets import Baked, assets_for
from .backends import GpuBackend
from .bench_eevee_scene import CASES, PATHS, SIZE, Case, open_case
from .bench_row import row
from .eevee_apart import draw_apart
from .exhibit import Exhibit
from .frame import open_frame
from .judged import Judged, judge, scores_of
from .native import Drawn
from .peer import Picture
from .pictures import placed
from .rows import is_software, set_up_of

MOST_FLIP, MOST_TIME, MOST_APART = 1 / 3, 1.0, 0.02  # the issue's


@dataclass(frozen=True)
class Line:
    """One picture of a case."""

    name: str
    flip: float  # against the truth
    apart: float | None  # FLIP against the overlay; None for EEVEE's own
    seconds: float  # of the frame, as judged
    sample: float  # CPU s, for each sample of it, without what a frame takes once
    compile: float
    told: dict  # nodes, look_ups, images, image_bytes of ours, and of theirs nothing
    traced: float | None  # s, ours with EEVEE's ray tracing on
    picture: np.ndarray  # (H, W, 3) display-encoded


@dataclass(frozen=True)
class Found:
    """What was drawn of a case."""

    case: Case
    ours: tuple[Line, ...]
    theirs: tuple[Line, ...]
    without: tuple[str, ...]  # sentences of methods that gave no picture
    truth: np.ndarray

    def best(self) -> tuple[Line | None, Line]:
        return min(self.ours, key=lambda line: line.flip, default=None), min(self.theirs, key=lambda line: line.flip)


def measure(progress) -> list:
    """Rows for targets.json, and an Exhibit for each case."""
    found = []
    with temporary_folder("reflect-bench-") as folder:
        for number, case in enumerate(CASES):
            found.append(_drawn(case, folder, lambda s, t, n=number, c=case: progress((n + s) / len(CASES), f"EEVEE, {c.name}: {t}")))
    return [*told(found), *map(_exhibit, found)]


def _drawn(case: Case, folder, say) -> Found:
    scene = open_case(case, folder)
    with open_frame(scene, None) as snapshot:
        judged = judge(scene, snapshot, SIZE, folder, None, PATHS, "gpu", lambda share, text: say(0.2 * share, text))
        baked = {}
        for number, name in enumerate(case.methods):
            share = 0.1 + 0.3 * number / len(case.methods)
            baked[name] = assets_for(scene, snapshot, name, folder, case.bake, lambda s, t, share=share: say(share + 0.3 * s / len(case.methods), t))
        job = peer.job_of(scene, judged.camera_name, judged.camera, snapshot, judged.ray_map)
        job = replace(job, groups=tuple(Groups(name, str(b.folder)) for name, b in baked.items()))
        pictures, drawn = native.draw(job, judged.ray_map, partial(draw_apart, say=lambda s, t: say(0.4 + 0.6 * s, t)))
        drew = [d for d in drawn if d.error is None and d.told["plain"] is not None]
    without = [f"{d.method}: {' '.join([d.error or '', *d.notes]).strip()}" for d in drawn if d not in drew]
    ours = tuple(_ours(judged, d, baked[d.method]) for d in drew)
    return Found(case, ours, tuple(_theirs(judged, p) for p in pictures), tuple(without), judged.truth_picture)


def _ours(judged: Judged, drawn: Drawn, baked: Baked) -> Line:
    picture, scores, _ = scores_of(judged, drawn.answer.radiance)
    overlay = judged.look.apply(placed(judged.truth.frame, judged.ray_map.covered(), _overlay(judged, baked).radiance))
    apart, _ = eye.flip(picture, overlay, judged.ray_map.covered())
    which = "busy" if is_software(drawn.device) else "seconds"
    plain, traced = drawn.told["plain"], drawn.told["traced"]
    return Line(drawn.method, scores["flip"], apart, plain[which], plain["sample"], plain["compile"], drawn.told, traced[which], picture)


def _overlay(judged: Judged, baked: Baked) -> Answer:
    return GpuBackend(judged.snapshot, baked.assets, judged.look, judged.camera, judged.ray_map).answer()


def _theirs(judged: Judged, found: Picture) -> Line:
    picture, scores, _ = scores_of(judged, found.radiance)
    times = found.times
    seconds = times["busy" if is_software(found.device) else "seconds"]
    return Line(f"EEVEE, {set_up_of(found.setting)}", scores["flip"], None, seconds, times["sample"], times["compile"], {}, None, picture)


def told(found: list[Found]) -> list[dict]:
    """The targets' rows."""
    best = [one.best() for one in found]
    flips = [np.inf if ours is None else ours.flip / max(theirs.flip, 1e-9) for ours, theirs in best]
    times = [np.inf if ours is None else ours.seconds / max(theirs.seconds, 1e-9) for ours, theirs in best]
    apart = {}
    for one in found:
        for line in one.ours:
            apart.setdefault(line.name, {})[one.case.name] = line.apart
    missing = [f"{one.case.name}: {sentence}" for one in found for sentence in one.without]
    most = [max(cases.values()) for cases in apart.values()]
    pairs = "; ".join(
        f"{one.case.name} {'none' if ours is None else f'{ours.name} {ours.flip:.3f}'} over {theirs.name} {theirs.flip:.3f}"
        for one, (ours, theirs) in zip(found, best, strict=True)
    )
    spent = "; ".join(
        f"{one.case.name} {'none' if ours is None else f'{ours.seconds:.1f}'} over {theirs.seconds:.1f} s" for one, (ours, theirs) in zip(found, best, strict=True)
    )
    worst = "; ".join(f"{name} {max(cases.values()):.4f} in {max(cases, key=cases.get)}" for name, cases in apart.items())
    how = f"{SIZE[0]}x{SIZE[1]}, {peer.SAMPLES} samples"
    return [
        row("I7-flip", _finite(flips), [MOST_FLIP] * len(flips), max(flips) <= MOST_FLIP,
            f"FLIP on reflector pixels, our best method as a node group over the best of EEVEE's own set-ups, {how}: {pairs}."),
        row("I7-time", _finite(times), [MOST_TIME] * len(times), max(times) <= MOST_TIME,
            f"Frame of that method, EEVEE's ray tracing off, over the frame of that set-up, one process, after compiling: {spent}."),
        row("I7-overlay", most or [0.0], [MOST_APART] * max(len(most), 1), bool(most) and max(most) <= MOST_APART and not missing,
            f"Largest FLIP between node group and overlay on the same rays: {worst or 'nothing was drawn'}."
            f"{' Without a group: ' + ' '.join(missing) if missing else ''}"),
    ]  # fmt: skip


def _finite(values: list[float]) -> list[float]:
    """JSON has no infinity: 1e9 stands for "no picture"."""
    return [min(float(v), 1e9) for v in values]


def _exhibit(found: Found) -> Exhibit:
    def cells(line: Line) -> tuple[str, ...]:
        counts = [f"{line.told[k]:,}" if line.told else "" for k in ("nodes", "look_ups", "images")]
        size = f"{line.told['image_bytes'] / 1e6:.1f}" if line.told else ""
        return (
            line.name, f"{line.flip:.4f}", "" if line.apart is None else f"{line.apart:.4f}", f"{line.seconds:.2f}",
            f"{line.sample:.3f}", "" if line.traced is None else f"{line.traced:.2f}", f"{line.compile:.1f}", *counts, size,
        )  # fmt: skip

    ours, theirs = found.best()
    shown = [("truth", found.truth)] + [(f"{line.name}, FLIP {line.flip:.3f}", line.picture) for line in (ours, theirs) if line is not None]
    without = " ".join(found.without)
    return Exhibit(
        f"Node groups in EEVEE: {found.case.name}",
        f"{SIZE[0]}x{SIZE[1]}, {peer.SAMPLES} samples; bakes {found.case.bake}. Frames in seconds (on a software device of its CPU time), without and with EEVEE's ray "
        f"tracing; EEVEE's own include its tracing where named. Nodes and look-ups of the largest group, inlined and unrolled. {without}",
        ("picture", "FLIP", "against overlay", "frame s", "a sample s", "traced s", "compile s", "nodes", "look-ups", "images", "MB"),
        tuple(cells(line) for line in (*found.ours, *found.theirs)),
        tuple(shown),
    )
