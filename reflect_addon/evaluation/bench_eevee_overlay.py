"""Issue 7's target of agreement: every gather method as node groups in EEVEE against the overlay, in every scene, on the same pixels.

Both answer the mirror rays of the pixels' centres, EEVEE by its own surface points and the overlay (the GPU) by the ray map's; both are shown over the same frame by the
same view transform. One sample of EEVEE's and no time is enough for that, so pictures and bakes are small. EEVEE keeps radiance in half floats, and so
does the overlay.
Pixels where EEVEE shows no group of ours count as black.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from ..core.processes import temporary_folder
from . import eye, native
from .backends import GpuBackend
from .bench_eevee_scene import ALL, CASES, Case, baked_case
from .bench_row import row
from .eevee_apart import draw_apart
from .exhibit import Exhibit
from .pictures import placed

SIZE = (96, 72)  # px
MOST = 0.02  # the issue's
# Further bake settings of scenes with many mirrors, where every method's default would be baked for an hour.
SMALLER = {
    "teapots": {"resolution": 64, "samples": 4, "texels": 64, "view_texels": 32},
    "kitchen": {"samples": 4, "texels": 32, "maps": 1, "turns": 12, "order": 2, "shared": True, "views": 4, "view_texels": 32},
}


@dataclass(frozen=True)
class Pair:
    """One method in one scene, by both."""

    case: str
    method: str
    flip: float | None  # between both; None without a picture
    missing: float  # share of the reflectors' pixels where EEVEE shows no group of ours
    notes: tuple[str, ...]
    group: np.ndarray | None = None  # (H, W, 3) display-encoded
    overlay: np.ndarray | None = None


def measure(progress: Callable[[float, str], object]) -> list:
    """A row for targets.json, and an Exhibit."""
    found = []
    with temporary_folder("reflect-bench-") as folder:
        for number, case in enumerate(CASES):
            case = replace(case, methods=ALL, bake=case.bake | SMALLER.get(case.name, {}), large=())
            found += pairs_of(case, folder, lambda s, t, n=number, c=case.name: progress((n + s) / len(CASES), f"Groups against overlay, {c}: {t}"))
    return [told(found), exhibit_of(found)]


def pairs_of(case: Case, folder: Path, say: Callable[[float, str], object]) -> list[Pair]:
    with baked_case(case, SIZE, folder, lambda s, t: say(0.6 * s, t)) as (judged, baked, job):
        job = replace(job, settings=(), timed=False)
        _, drawn = native.draw(job, judged.ray_map, partial(draw_apart, say=lambda s, t: say(0.6 + 0.4 * s, t)))
        mask, out = judged.ray_map.covered(), []
        for one in drawn:
            if one.error is not None:
                out.append(Pair(case.name, one.method, None, 1.0, (one.error,)))
                continue
            overlay = GpuBackend(judged.snapshot, baked[one.method].assets, judged.look, judged.camera, judged.ray_map).answer()
            pictures = [judged.look.apply(placed(judged.truth.frame, mask, a.radiance)) for a in (one.answer, overlay)]
            out.append(Pair(case.name, one.method, eye.flip(*pictures, mask)[0], float(np.mean(one.answer.status == 0)), one.notes, *pictures))
    return out


def told(found: list[Pair]) -> dict:
    """The target's row: each method's largest difference."""
    drawn = [pair for pair in found if pair.flip is not None]
    most = {pair.method: pair for pair in sorted(drawn, key=lambda pair: pair.flip)}  # the last of a method stays
    most = [most[method] for method in ALL if method in most]
    without = [f"{pair.case}, {pair.method}: {' '.join(pair.notes)}" for pair in found if pair.flip is None]
    words = "; ".join(f"{pair.method} {pair.flip:.4f} in {pair.case}" for pair in most) or "nothing was drawn"
    holds = bool(most) and max(pair.flip for pair in most) <= MOST and not without
    return row(
        "I7-overlay", [pair.flip for pair in most] or [0.0], [MOST] * max(len(most), 1), holds,
        f"Largest FLIP between node group and overlay on the reflectors' pixels, {SIZE[0]}x{SIZE[1]}: {words}."
        f"{' Without a group: ' + ' '.join(without) if without else ''}",
    )  # fmt: skip


def exhibit_of(found: list[Pair]) -> Exhibit:
    cases = list(dict.fromkeys(pair.case for pair in found))
    cells = {(pair.method, pair.case): "none" if pair.flip is None else f"{pair.flip:.4f}" for pair in found}
    worst = max((pair for pair in found if pair.flip is not None), key=lambda pair: pair.flip, default=None)
    bare = ", ".join(f"{100 * pair.missing:.1f} % in {pair.case}, {pair.method}" for pair in found if pair.flip is not None and pair.missing)
    return Exhibit(
        "Node groups against the overlay",
        f"FLIP between both on the reflectors' pixels, {SIZE[0]}x{SIZE[1]}; at most {MOST} is asked. Pixels where EEVEE shows no group: {bare or 'none'}.",
        ("method", *cases),
        tuple((method, *(cells.get((method, case), "") for case in cases)) for method in ALL),
        () if worst is None else tuple((f"{worst.case}, {worst.method}: {who}", p) for who, p in (("group", worst.group), ("overlay", worst.overlay))),
    )
