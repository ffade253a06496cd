"""Targets of popescu-2006 on reflective billboards (5.1, Figs 1, 2, 4, 5): second-order reflections, counted and timed.

Counts are the shader's own and exact. Times are ratios within this run, of processor time where the processor draws. What
is compared is timed in turns, each piece about equally long: a short frame is disturbed less often than a long one.
"""

from dataclasses import replace

import numpy as np

from ..core.kernel import counted
from ..core.methods import billboards, environment
from ..core.mirrors import second_order_pairs
from ..core.rays import Rays
from . import bench_mirrors_scene as scenes
from .bench_row import row

# P5, P9: (D, R) of the scenes; the first three are the paper's Figs 4, 1 and 5, with its counts.
FIGURES = {(2, 2): 5, (1, 4): 5, (1, 9): 10}
OTHERS = ((8, 2), (4, 4), (8, 9), (16, 9))
STRAIGHT = 0.15  # P5: largest departure from a line, share of the largest time
# P7: reflectors and the paper's frames per second.
ENABLED = {1: 166, 2: 125, 4: 66, 9: 11}
# P8: the paper's resolutions (640x480, ...) times 0.4, and its frames per second.
RESOLUTIONS = {(256, 192): 46, (320, 240): 36, (384, 288): 31, (448, 336): 25, (512, 384): 11}
LEVEL = 0.15
LOOK = (256, 192)  # P1, P2
FADES = 5.0  # m, half distance of P2
RAYS = 8000  # of one pass over many rays
TURNS = 7
CLOSE_TURNS = 40  # where a few percent are asked for


def measure(progress) -> list[dict]:
    """Rows for targets.json."""
    progress(0.0, "popescu: four teapots")
    pots, name = scenes.teapots()
    frame = scenes.baked(pots, (billboards, environment), (LOOK, *RESOLUTIONS))
    rows = [*_teapots(frame, name)]
    progress(0.3, "popescu: resolutions")
    rows.append(_resolutions(frame, name))
    progress(0.45, "popescu: one to nine reflectors")
    frames = {count: scenes.baked(scenes.balls(count)) for count in ENABLED}
    rows += _enabled(frames)
    progress(0.75, "popescu: intersections")
    rows += _intersections(frames[max(ENABLED)])
    progress(1.0, "popescu: mirrors done")
    return rows


def _teapots(frame: scenes.Frame, name: str) -> list[dict]:
    """P1, P2."""
    from ..gpu.timing import close_ratio, processor_clock, time_in_turns
    from .plain_resolve import PlainResolve

    pairs = len(second_order_pairs(frame.snapshot))
    shown = sum(asset.options["mirrors"] for asset in frame.assets[billboards.NAME].values())
    clock = processor_clock()
    own, plain = frame.work(), frame.work(resolve=PlainResolve)
    times = time_in_turns([own, frame.work(environment.NAME)], TURNS, 1, clock)
    over = times.ratio(0, 1)
    fresnel, both = (close_ratio(w, plain, CLOSE_TURNS, 2, clock) for w in (own, frame.work(attenuation=FADES)))
    what = f"Four {name}, {LOOK[0]}x{LOOK[1]}, {frame.covered()} pixels covered"
    return [
        row("P1", [pairs, shown], [12, 12], pairs == shown == 12,
            f"Second-order reflections of the scene, and mirrors in the tables of its reflectors: R(R-1). {what}.", paper=[12, 12]),
        row("P1-time", over, None, True, f"Time over environment at equal coverage, reported. {what}; {times.median(0):.3g} ms here."),
        row("P2", both - 1, 0.05, both - 1 < 0.05,
            f"What Fresnel and attenuation add to the same frame without both (Fresnel alone {fresnel - 1:.1%}). {what}."),
    ]  # fmt: skip


def _resolutions(frame: scenes.Frame, name: str) -> dict:
    """P8."""
    covered = np.array([frame.covered(1 + i) for i in range(len(RESOLUTIONS))], float)
    works = [(frame.work(camera=1 + i), covered[i]) for i in range(len(RESOLUTIONS))]
    rates, spread = _rates(works)
    rates /= np.mean(rates)
    off = float(np.abs(rates - 1).max())
    paper = np.array([w * h * fps / 1e6 for (w, h), fps in RESOLUTIONS.items()])
    sizes = ", ".join(f"{w}x{h}" for w, h in RESOLUTIONS)
    return row(
        "P8", rates.tolist(), 1.0, off <= LEVEL,
        f"Pixels a second over the mean of five resolutions ({sizes}), within {LEVEL:.0%}; four {name}; "
        f"turns differ by {spread:.0%}.",
        paper=(paper / paper.mean()).tolist(),
    )  # fmt: skip


def _enabled(frames: dict[int, scenes.Frame]) -> list[dict]:
    """P5's count, P7."""
    pairs = len(second_order_pairs(frames[9].snapshot))
    shown = sum(asset.options["mirrors"] for asset in frames[9].assets[billboards.NAME].values())
    covered = np.array([frame.covered() for frame in frames.values()], float)
    empty = replace(frames[1], snapshot=replace(frames[1].snapshot, instances=()))
    # The frame without reflectors is as long as a tenth of what the nine cover, or so.
    pieces = [(empty.work(), 0.1 * covered[-1]), *((f.work(), c) for f, c in zip(frames.values(), covered, strict=True))]
    times = _times(pieces)
    ms = times.ms[:, times.ms[1] > times.ms[0]]  # turns in which the one reflector took a measurable time
    each = np.median(ms[1:] / ms[1], axis=1) * covered[0] / covered
    net = np.median((ms[1:] - ms[0]) / (ms[1] - ms[0]), axis=1) * covered[0] / covered
    fps = np.array(list(ENABLED.values()), float)
    what = f"R = {', '.join(map(str, ENABLED))}, D = 1, {scenes.SIZE[0]}x{scenes.SIZE[1]}, covering {', '.join(f'{c:.0f}' for c in covered)} pixels"
    return [
        row("P5", [pairs, shown], [72, 72], pairs == shown == 72,
            "Second-order reflections of nine balls, and mirrors in the tables of its reflectors: R(R-1).", paper=[72, 72]),
        row("P7", each.tolist(), 6.0, each[-1] <= 6,
            f"Time of a frame per covered pixel over that with R = 1; {what}. The paper's are of whole frames, growing coverage included.",
            paper=(fps[0] / fps).tolist()),
        row("P7-net", net.tolist(), 6.0, net[-1] <= 6, "The same without what a frame takes that shows no reflector."),
    ]  # fmt: skip


def _intersections(nine: scenes.Frame) -> list[dict]:
    """P5's cost, P9: the middle ball's rays, answered from tables of other scenes that have it at the same place."""
    from ..gpu.fill import RayBundle
    from ..gpu.timing import processor_clock, time_in_turns

    seen = nine.rays_of("Ball 0")
    some = np.arange(RAYS) % len(seen)
    bundle = RayBundle(Rays(seen.origin[some], seen.direction[some]))
    tables = {}
    for things, mirrors in (*FIGURES, *OTHERS):
        frame = nine if (things, mirrors) == (1, 9) else scenes.baked(scenes.balls(mirrors, things), only="Ball 0")
        tables[things, mirrors] = frame.assets[billboards.NAME]["Ball 0"]
    most, exact = [], True
    for (things, mirrors), asset in tables.items():
        exact &= (asset.options["count"], asset.options["mirrors"]) == (things, mirrors - 1)
        steps = bundle.answer(asset, counted(billboards.trace)).radiance[:, 0]
        exact &= set(np.unique(steps)) == {things + mirrors - 1, 2 * things + mirrors - 1}
        most.append(int(steps.max()))
    paper = list(FIGURES.values())
    cost = np.array([2 * things + mirrors - 1 for things, mirrors in tables], float)
    times = time_in_turns([bundle.work(asset, billboards.trace) for asset in tables.values()], TURNS, 1, processor_clock())
    series = np.array([times.ratio(i, 0) for i in range(len(tables))])
    slope, start = np.polyfit(cost, series, 1)
    bend = float(np.abs(series - (start + slope * cost)).max() / series.max())
    listed = ", ".join(f"{c:.0f}" for c in cost)
    return [
        row("P5-linear", bend, STRAIGHT, bend <= STRAIGHT and slope > 0,
            f"Largest departure from a line of the time over 2D+R-1 = {listed}, share of the largest; the same {RAYS} rays, R from 2 to 9."),
        row("P9", most[: len(FIGURES)], paper, exact and most[: len(FIGURES)] == paper,
            "Intersections counted by the shader, the most of any ray: 2D+R-1 where it meets a mirror, D+R-1 elsewhere, "
            f"nothing else, here and for 2D+R-1 = {listed}. Figs 4, 1 and 5.", paper=paper),
    ]  # fmt: skip


def _times(pieces):
    """Times of (work, about how long), in turns; short ones several times over, so that all are interrupted alike."""
    from ..gpu.timing import Times, Work, processor_clock, time_in_turns

    longest = max(long for _, long in pieces)
    counts = [max(round(longest / long), 1) for _, long in pieces]

    def several(work, count):
        return Work(lambda: [work.submit() for _ in range(count)], work.finish)

    times = time_in_turns([several(work, n) for (work, _), n in zip(pieces, counts, strict=True)], TURNS, 1, processor_clock())
    return Times(times.ms / np.array(counts)[:, None])


def _rates(pieces) -> tuple[np.ndarray, float]:
    """(pixels a second of each (work, pixels), median over the turns of their share of the turn's mean; half the quartiles'
    range of that at most)."""
    times = _times(pieces)
    rates = np.array([pixels for _, pixels in pieces])[:, None] / times.ms
    rates /= rates.mean(0)
    low, high = np.percentile(rates, [25, 75], axis=1)
    return np.median(rates, axis=1), float(((high - low) / 2).max())
