"""Issue 7's targets: our methods as node groups against EEVEE's own pictures, on the same pixels.

For each case one process draws EEVEE's own set-ups (peer.py) and ours, so that their times compare; on a software device that others share
they are CPU seconds. The best of theirs has the smallest FLIP on the reflectors' pixels; the best of ours too, among those whose frames take no longer, if there are any.

Both have as many samples. A row of its own compares at equal time: our groups answer every sample alike, so frames of ours may have FEWER where as many take longer than EEVEE's.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..core.errors import Cancelled, ReflectError
from ..core.processes import temporary_folder
from . import native, peer
from .bench_eevee_scene import CASES, Case, baked_case
from .bench_row import row
from .eevee_apart import draw_apart
from .exhibit import Exhibit
from .judged import Judged, scores_of
from .native import Drawn
from .peer import Picture
from .rows import is_software, set_up_of

SIZE = (120, 90)  # px
MOST_FLIP, MOST_TIME = 1 / 3, 1.0  # the issue's
FEWER = 3 * peer.SAMPLES // 4


@dataclass(frozen=True)
class Line:
    """One picture of a case."""

    name: str
    samples: int  # of the frame
    flip: float  # against the truth
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
    fewer: tuple[Line, ...]  # ours again, with FEWER samples
    theirs: tuple[Line, ...]
    without: tuple[str, ...]  # sentences of methods that gave no picture
    truth: np.ndarray

    def best(self) -> tuple[Line | None, Line]:
        theirs = min(self.theirs, key=lambda line: line.flip)
        fast = [line for line in self.ours if line.seconds <= theirs.seconds]
        return min(fast or self.ours, key=lambda line: line.flip, default=None), theirs

    def in_time(self) -> Line | None:
        """The best of ours that takes no longer than the best of theirs, by whatever samples."""
        limit = self.best()[1].seconds
        return min((line for line in (*self.ours, *self.fewer) if line.seconds <= limit), key=lambda line: (line.flip, -line.samples), default=None)


def measure(progress, only: tuple[str, ...] = ()) -> list:
    """Rows for targets.json, and an Exhibit for each case. A case whose process fails is told in the rows, which then do not hold: others took an hour. What each
    case came to is told as it is known. only: names of cases, all by default."""
    found, failed = [], {}
    cases = [case for case in CASES if not only or case.name in only]
    with temporary_folder("reflect-bench-") as folder:
        for number, case in enumerate(cases):
            case = replace(case, bake=case.bake | case.fast)
            say = lambda s, t, n=number, c=case: progress((n + s) / len(cases), f"EEVEE, {c.name}: {t}")
            try:
                one = _drawn(case, folder, say)
            except Cancelled:
                raise
            except ReflectError as error:
                failed[case.name] = error.message
                say(1.0, f"failed: {error.message}")
                continue
            found.append(one)
            ours, theirs = one.best()
            say(1.0, "; ".join(f"{line.name} FLIP {line.flip:.4f}, {line.seconds:.2f} s" for line in (ours, theirs) if line is not None))
    return [*told(found, failed), *map(_exhibit, found)]


def _drawn(case: Case, folder, say) -> Found:
    with baked_case(case, SIZE, folder, lambda s, t: say(0.4 * s, t)) as (judged, _, job):
        pictures, drawn = native.draw(replace(job, fewer=FEWER), judged.ray_map, partial(draw_apart, say=lambda s, t: say(0.4 + 0.6 * s, t)))
        drew = [d for d in drawn if d.error is None and d.told["plain"] is not None]
    without = [f"{d.method}: {' '.join([d.error or '', *d.notes]).strip()}" for d in drawn if d not in drew]
    ours = tuple(_ours(judged, d) for d in drew)
    fewer = tuple(replace(line, samples=FEWER, seconds=line.told["fewer"][_which(d.device)], traced=None) for line, d in zip(ours, drew, strict=True))
    return Found(case, ours, fewer, tuple(_theirs(judged, p) for p in pictures), tuple(without), judged.truth_picture)


def _which(device: str) -> str:
    """Of eevee_draw's times, the one that is judged."""
    return "busy" if is_software(device) else "seconds"


def _ours(judged: Judged, drawn: Drawn) -> Line:
    picture, scores, _ = scores_of(judged, drawn.answer.radiance)
    which = _which(drawn.device)
    plain, traced = drawn.told["plain"], drawn.told["traced"]
    return Line(drawn.method, peer.SAMPLES, scores["flip"], plain[which], plain["sample"], plain["compile"], drawn.told, traced[which], picture)


def _theirs(judged: Judged, found: Picture) -> Line:
    picture, scores, _ = scores_of(judged, found.radiance)
    times = found.times
    seconds = times[_which(found.device)]
    return Line(f"EEVEE, {set_up_of(found.setting)}", peer.SAMPLES, scores["flip"], seconds, times["sample"], times["compile"], {}, None, picture)


def told(found: list[Found], failed: dict[str, str]) -> list[dict]:
    """The targets' rows. failed: case -> why nothing is known of it."""
    best = [one.best() for one in found]
    flips = [np.inf if ours is None else ours.flip / max(theirs.flip, 1e-9) for ours, theirs in best]
    times = [np.inf if ours is None else ours.seconds / max(theirs.seconds, 1e-9) for ours, theirs in best]
    flips, times = flips + [np.inf] * len(failed), times + [np.inf] * len(failed)
    missing = [f"{one.case.name}: {sentence}" for one in found for sentence in one.without] + [f"{name}: {why}" for name, why in failed.items()]
    pairs = "; ".join(
        f"{one.case.name} {'none' if ours is None else f'{ours.name} {ours.flip:.3f}'} over {theirs.name} {theirs.flip:.3f}"
        for one, (ours, theirs) in zip(found, best, strict=True)
    )
    spent = "; ".join(
        f"{one.case.name} {'none' if ours is None else f'{ours.seconds:.1f}'} over {theirs.seconds:.1f} s" for one, (ours, theirs) in zip(found, best, strict=True)
    )
    soon = [one.in_time() for one in found]
    within = [np.inf if ours is None else ours.flip / max(theirs.flip, 1e-9) for ours, (_, theirs) in zip(soon, best, strict=True)] + [np.inf] * len(failed)
    shown = "; ".join(
        f"{one.case.name} {'none' if ours is None else f'{ours.name} of {ours.samples} samples, {ours.seconds:.1f}'} over {theirs.seconds:.1f} s"
        for one, ours, (_, theirs) in zip(found, soon, best, strict=True)
    )
    how = f"{SIZE[0]}x{SIZE[1]}, {peer.SAMPLES} samples"
    return [
        row("I7-flip", _finite(flips), [MOST_FLIP] * len(flips), max(flips) <= MOST_FLIP,
            f"FLIP on reflector pixels, our best method as a node group over the best of EEVEE's own set-ups, {how}: {pairs}."
            f"{' Without a group: ' + ' '.join(missing) if missing else ''}"),
        row("I7-time", _finite(times), [MOST_TIME] * len(times), max(times) <= MOST_TIME,
            f"Frame of that method, EEVEE's ray tracing off, over the frame of that set-up, one process, after compiling: {spent}."),
        row("I7-equal-time", _finite(within), [MOST_FLIP] * len(within), max(within) <= MOST_FLIP,
            f"The same FLIP at equal time and not at equal samples: ours of {peer.SAMPLES} samples or, where that takes longer, {FEWER}; EEVEE's has {peer.SAMPLES}: {shown}."),
    ]  # fmt: skip


def _finite(values: list[float]) -> list[float]:
    """JSON has no infinity: 1e9 stands for "no picture"."""
    return [min(float(v), 1e9) for v in values]


def _exhibit(found: Found) -> Exhibit:
    def cells(line: Line) -> tuple[str, ...]:
        counts = [f"{line.told[k]:,}" if line.told else "" for k in ("nodes", "look_ups", "images")]
        size = f"{line.told['image_bytes'] / 1e6:.1f}" if line.told else ""
        return (
            line.name, str(line.samples), f"{line.flip:.4f}", f"{line.seconds:.2f}",
            f"{line.sample:.3f}", "" if line.traced is None else f"{line.traced:.2f}", f"{line.compile:.1f}", *counts, size,
        )  # fmt: skip

    ours, theirs = found.best()
    shown = [("truth", found.truth)] + [(f"{line.name}, FLIP {line.flip:.3f}", line.picture) for line in (ours, theirs) if line is not None]
    without = " ".join(found.without)
    return Exhibit(
        f"Node groups in EEVEE: {found.case.name}",
        f"{SIZE[0]}x{SIZE[1]}; bakes {found.case.bake}. Frames in seconds (on a software device of its CPU time), without and with EEVEE's ray "
        f"tracing; EEVEE's own include its tracing where named. Nodes and look-ups of the largest group, inlined and unrolled. {without}",
        ("picture", "samples", "FLIP", "frame s", "a sample s", "traced s", "compile s", "nodes", "look-ups", "images", "MB"),
        tuple(cells(line) for line in (*found.ours, *found.fewer, *found.theirs)),
        tuple(shown),
    )
