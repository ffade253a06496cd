"""Targets of popescu-2006 for building simplified rotated depth maps: P11, P12, P13, and issue 3's compute build.

One depth map of a figure of balls, 256 x 256 texels, a third of them covered. NumPy and the device build it in turns,
upload and read-back counted; ratios are medians of the turns' own. The work of a build is counted exactly, and says what a
graphics card needs where there is none to ask.
"""

from collections.abc import Callable, Sequence
from functools import partial
from time import perf_counter

import numpy as np

from ..core import srdm, srdm_greedy
from .bench_row import row

W, N, M = 256, 60, 8
POINTS = (8, 16, 32, 64)
ANGLES = (18, 36, 60, 90, 180)
TURNS = 5
ANGLE_TURNS = 45  # of a few milliseconds each
FASTER = 5.0  # issue 3: compute over NumPy
GROWTH = 4.7  # P11: 980 ms over 210 ms
STRAIGHT = 0.15  # P12
REDRAW = 1000 / 60  # ms
# A small graphics card, as the prediction takes it: 32-wide groups in step, 40 schedulers (10 multiprocessors) that issue
# one instruction a clock at 1 GHz. A step is one sample, texel, priority or point; none takes more instructions, and a
# group alone waits this long for what it read.
WARP, SCHEDULERS, CLOCK = 32, 40, 1e9
INSTRUCTIONS, LATENCY = 30, 200
# Centre (x, y), height and radius of the balls, in half map sides.
BALLS = ((0.0, -0.2, 0.0, 0.5), (0.35, 0.3, 0.1, 0.3), (0.3, 0.65, 0.1, 0.12), (0.5, 0.62, 0.0, 0.1), (-0.5, -0.4, 0.1, 0.15))


def measure(progress: Callable[[float, str], object]) -> list[dict]:
    """Rows for targets.json."""
    depth = figure(W)
    progress(0.0, "srdm: tables compared")
    rows = [_equal(depth), _bytes(), _half(depth)]
    progress(0.2, "srdm: NumPy against the device")
    rows += _speed(depth)
    progress(0.7, "srdm: angles")
    rows.append(_linear(depth))
    progress(0.9, "srdm: a graphics card")
    rows.append(_card(depth))
    progress(1.0, "srdm: done")
    return rows


def figure(w: int) -> np.ndarray:
    """(w, w) float32: q of some balls with a relief, NaN beside them; no straight row, so that m = 64 finds work."""
    y, x = (np.mgrid[:w, :w] + 0.5) / w * 2 - 1
    z = np.full((w, w), -np.inf)
    for cx, cy, height, radius in BALLS:
        inside = radius**2 - (x - cx) ** 2 - (y - cy) ** 2
        z = np.where(inside > 0, np.maximum(z, height + np.sqrt(np.maximum(inside, 0))), z)
    z = np.where(np.isfinite(z), z + 0.01 * np.sin(40 * x) * np.cos(37 * y), np.nan)
    return ((z - np.nanmin(z)) / (np.nanmax(z) - np.nanmin(z))).astype(np.float32)


def reference(depth: np.ndarray, n: int, m: int) -> np.ndarray:
    """(n, w, m, 2) float32: the table by NumPy."""
    rows = srdm.with_spans(srdm.rotated_rows(depth, n), m)
    return srdm_greedy.simplify(rows, m).reshape(n, len(depth), m, 2)


def counted(depth: np.ndarray, n: int, m: int) -> dict[str, int]:
    """What a build does: texels read, samples compared, priorities compared (at most), points written; `steps`: the same
    for groups of WARP rows in step, each as slow as its slowest."""
    rows = srdm.with_spans(srdm.rotated_rows(depth, n), m)
    count, w = rows.depth.shape
    work = {"texels": count * w, "samples": 0, "priorities": count * m * (m - 1) // 2, "points": count * m}
    groups = -(-count // WARP)
    work["steps"] = groups * (w + m * (m - 1) // 2 + m)

    def seen(row, samples):
        slowest = np.zeros(groups, np.int64)
        np.maximum.at(slowest, row // WARP, samples)
        work["samples"] += int(samples.sum())
        # The two halves of a split are two loops: a group may wait in both.
        work["steps"] += 2 * int(slowest.sum())

    srdm_greedy.simplify(rows, m, seen)
    return work


def predicted_ms(work: dict[str, int], n: int) -> float:
    """Milliseconds on the card above: all instructions issued, then all reads of one group waited for."""
    groups = n * W / WARP
    issued = work["steps"] * INSTRUCTIONS / SCHEDULERS
    waited = work["steps"] / groups * LATENCY
    return (issued + waited) / CLOCK * 1e3


def _equal(depth: np.ndarray) -> dict:
    from ..gpu.srdm_build import build

    random = np.random.default_rng(1)
    holes = np.where(random.random((W, W)) < 0.9, random.random((W, W)), np.nan).astype(np.float32)
    cases = [(depth, N, m) for m in POINTS] + [(holes, 6, m) for m in POINTS]
    differ = [int((build(*case).view(np.uint32) != reference(*case).view(np.uint32)).sum()) for case in cases]
    how = f"Words of the device's tables that differ from NumPy's: a figure, n = {N}, and holes, n = 6, m = {_list(POINTS)}."
    return row("I3-compute-equal", sum(differ), 0, sum(differ) == 0, how)


def _bytes() -> dict:
    from ..gpu.counts import Counts
    from ..gpu.srdm_build import Builder

    width, height = Builder(W, N, M, Counts()).size
    kib = width * height * 16 / 1024
    how = f"KiB of the texture of a {W}x{W} map, n = {N}, m = {M}: {width}x{height} texels of four floats."
    return row("P13", kib, 960.0, kib == 960, how, paper=960.0)


def _half(depth: np.ndarray) -> dict:
    table = reference(depth, N, M)
    full, half = srdm.packed(table), srdm.halved(table)
    off = np.abs(half.astype(np.float64) - full)
    exact = not off[..., 0::2].any() and 2 * half.nbytes == full.nbytes
    worst = float(off[..., 1::2].max())
    u = "exact" if exact else "not exact"
    how = f"Largest error of q in half floats, of the hither-yon range; {half.nbytes / 1024:g} KiB; u is {u}."
    return row("I3-half", worst, 2.0**-12, exact and worst <= 2.0**-12, how)


def _speed(depth: np.ndarray) -> list[dict]:
    from ..gpu.srdm_build import build

    # Beside each other for every m, so that what else the machine does falls on both.
    times = _in_turns([partial(make, depth, N, m) for m in POINTS for make in (build, reference)], TURNS)
    last = 2 * (len(POINTS) - 1)
    faster = [times.ratio(2 * i + 1, 2 * i) for i in range(len(POINTS))]
    growth = [times.ratio(last, 0), times.ratio(last + 1, 1)]
    what = f"{W}x{W}, n = {N}, median of {TURNS} turns"
    device, numpy = (_list(f"{times.median(2 * i + at):.0f}" for i in range(len(POINTS))) for at in (0, 1))
    return [
        row(
            "I3-compute",
            faster,
            FASTER,
            min(faster) >= FASTER,
            f"NumPy's time over the device's, m = {_list(POINTS)}, upload and read-back counted, {what}: {device} against {numpy} ms.",
        ),
        row(
            "P11",
            growth,
            GROWTH,
            max(growth) < GROWTH,
            f"Time at m = {POINTS[-1]} over m = {POINTS[0]}, on the device and in NumPy, {what}.",
            paper=GROWTH,
        ),
    ]


def _linear(depth: np.ndarray) -> dict:
    times = _in_turns([_remake(depth, n) for n in ANGLES], ANGLE_TURNS)
    series = np.array([times.ratio(i, ANGLES.index(N)) for i in range(len(ANGLES))])
    slope, start = np.polyfit(ANGLES, series, 1, w=1 / series)
    bend = float(np.abs(series / (start + slope * np.array(ANGLES)) - 1).max())
    how = f"Largest relative departure from a line of the time over n = {_list(ANGLES)}, m = {M}, median of {ANGLE_TURNS} turns."
    return row("P12", bend, STRAIGHT, bend <= STRAIGHT, how)


def _card(depth: np.ndarray) -> dict:
    """Measured where a graphics card draws, else predicted."""
    from ..gpu.device import describe

    work = counted(depth, N, M)
    figures = ", ".join(f"{work[name] / 1e6:.1f} M {name}" for name in ("texels", "samples", "priorities", "points"))
    if describe()["device"] != "SOFTWARE":
        ms = _in_turns([_remake(depth, N)], ANGLE_TURNS).median(0)
        how = f"Milliseconds of a full build on {describe()['renderer']}, {W}x{W}, n = {N}, m = {M}: {figures}."
    else:
        ms = predicted_ms(work, N)
        how = (
            f"Predicted, not measured: ms of a full build, {W}x{W}, n = {N}, m = {M}. Counted: {figures}; "
            f"{work['steps'] / 1e6:.2f} M steps of {WARP} rows in step. Assumed: {INSTRUCTIONS} instructions a step, "
            f"{SCHEDULERS} schedulers at {CLOCK / 1e9:g} GHz, and {LATENCY} clocks for every read of a group, one after the other."
        )
    return row("I3-compute-card", ms, REDRAW, ms <= REDRAW, how)


def _remake(depth: np.ndarray, n: int) -> Callable[[], object]:
    """Builds into a texture that stays on the device, and waits for it."""
    from ..gpu.counts import Counts
    from ..gpu.device import ensure
    from ..gpu.srdm_build import Builder, upload

    builder, depth_img = Builder(W, n, M, Counts()), upload(depth, Counts())
    texture = builder.texture()
    framebuffer = ensure().types.GPUFrameBuffer(color_slots=[texture])

    def remake():
        builder.build(depth_img, texture)
        with framebuffer.bind():
            framebuffer.read_color(0, 0, 1, 1, 4, 0, "FLOAT")

    return remake


def _in_turns(works: Sequence[Callable[[], object]], turns: int):
    """Times of works that wait for their result, so that each can be timed by itself; after one of each to warm up."""
    from ..gpu.timing import Times

    def ms(work):
        start = perf_counter()
        work()
        return (perf_counter() - start) * 1e3

    return Times(np.array([[ms(work) for work in works] for _ in range(turns + 1)])[1:].T)


def _list(values) -> str:
    return ", ".join(str(value) for value in values)
