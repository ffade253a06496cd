"""Small plots as inline SVG on logarithmic axes: cost against error with the front of the best marked, and curves."""

import math
from dataclasses import dataclass
from html import escape

from ..core.pareto import pareto_front

WIDTH, HEIGHT = 460, 300
LEFT, RIGHT, TOP, BOTTOM = 62, 18, 14, 46
LETTER = 6.8  # mean width of a label's letter


@dataclass(frozen=True)
class Point:
    label: str
    x: float | None
    y: float | None
    series: int = 0  # which colour (CSS class s0, s1, ...)


def scatter(points: list[Point], x_label: str, y_label: str, floor: float | None = None) -> str:
    """SVG text; points without a positive x and y are left out, and without any a sentence stands there instead."""
    points = [p for p in points if _positive(p.x) and _positive(p.y)]
    if not points:
        return f"<p class='none'>Nothing was measured for {escape(y_label)} against {escape(x_label)}.</p>"
    ys = [p.y for p in points] + ([floor] if _positive(floor) else [])
    out, sx, sy = _axes([p.x for p in points], ys, x_label, y_label)
    if _positive(floor):
        out.append(f"<path class='floor' d='M{LEFT} {sy(floor):.1f}H{WIDTH - RIGHT}'/>")
        out.append(f"<text class='floor' x='{LEFT + 5}' y='{sy(floor) - 5:.1f}'>noise of the truth</text>")
    front = pareto_front([(p.x, p.y) for p in points])
    steps = "L".join(f"{sx(points[i].x):.1f} {sy(points[i].y):.1f}" for i in front)
    if len(front) > 1:
        out.append(f"<path class='front' d='M{steps}'/>")
    taken: list[float] = []
    for i, p in sorted(enumerate(points), key=lambda item: sy(item[1].y)):
        x, y = sx(p.x), sy(p.y)
        ring = f"<circle class='best' cx='{x:.1f}' cy='{y:.1f}' r='8'/>" if i in front else ""
        text_y = max([y + 4, *(t + 13 for t in taken if t + 13 > y + 4)])  # labels never lie on each other
        taken.append(text_y)
        flip = x + 12 + LETTER * len(p.label) > WIDTH
        anchor = f"x='{x - 12:.1f}' text-anchor='end'" if flip else f"x='{x + 12:.1f}'"
        out.append(
            f"{ring}<circle class='dot s{p.series}' cx='{x:.1f}' cy='{y:.1f}' r='5'>"
            f"<title>{escape(p.label)}: {p.x:.4g}, {p.y:.4g}</title></circle>"
            f"<text class='name' {anchor} y='{text_y:.1f}'>{escape(p.label)}</text>"
        )
    return "".join(out) + "</svg>"


def curves(series: dict[str, list[tuple[float, float]]], x_label: str, y_label: str) -> str:
    """SVG text: a line of dots each, named at its last; points without a positive x and y are left out."""
    kept = {name: [p for p in points if _positive(p[0]) and _positive(p[1])] for name, points in series.items()}
    kept = {name: points for name, points in kept.items() if points}
    if not kept:
        return f"<p class='none'>Nothing was measured for {escape(y_label)} against {escape(x_label)}.</p>"
    out, sx, sy = _axes(*zip(*(p for points in kept.values() for p in points), strict=True), x_label, y_label)
    taken: list[tuple[float, float]] = []
    for number, (name, points) in enumerate(kept.items()):
        path = "L".join(f"{sx(x):.1f} {sy(y):.1f}" for x, y in points)
        out.append(f"<path class='curve l{number % 6}' d='M{path}'/>")
        out += [f"<circle class='dot s{number % 6}' cx='{sx(x):.1f}' cy='{sy(y):.1f}' r='3'><title>{x:.4g}, {y:.4g}</title></circle>" for x, y in points]
        x, at = sx(points[-1][0]), sy(points[-1][1]) - 8
        while any(abs(at - y) < 13 and abs(x - other) < LETTER * len(name) for other, y in taken):  # labels never lie on each other
            at -= 13
        taken.append((x, at))
        out.append(f"<text class='name' x='{x:.1f}' y='{at:.1f}' text-anchor='end'>{escape(name)}</text>")
    return "".join(out) + "</svg>"


def _axes(xs, ys, x_label: str, y_label: str):
    """(SVG's first parts: axes with their ticks and labels, x -> px, y -> px)."""
    x_range, y_range = _decades(xs), _decades(ys)

    def sx(v):
        return LEFT + (math.log10(v) - x_range[0]) / (x_range[1] - x_range[0]) * (WIDTH - LEFT - RIGHT)

    def sy(v):
        return HEIGHT - BOTTOM - (math.log10(v) - y_range[0]) / (y_range[1] - y_range[0]) * (HEIGHT - TOP - BOTTOM)

    out = [
        f"<svg class='plot' viewBox='0 0 {WIDTH} {HEIGHT}' role='img' "
        f"aria-label='{escape(y_label, True)} against {escape(x_label, True)}'>"
    ]
    for value in _ticks(x_range):
        out.append(f"<path class='grid' d='M{sx(value):.1f} {TOP}V{HEIGHT - BOTTOM}'/>")
        out.append(f"<text x='{sx(value):.1f}' y='{HEIGHT - BOTTOM + 16}' text-anchor='middle'>{_number(value)}</text>")
    for value in _ticks(y_range):
        out.append(f"<path class='grid' d='M{LEFT} {sy(value):.1f}H{WIDTH - RIGHT}'/>")
        out.append(f"<text x='{LEFT - 7}' y='{sy(value) + 4:.1f}' text-anchor='end'>{_number(value)}</text>")
    out.append(f"<path class='axis' d='M{LEFT} {TOP}V{HEIGHT - BOTTOM}H{WIDTH - RIGHT}'/>")
    middle = (TOP + HEIGHT - BOTTOM) / 2
    out.append(f"<text class='label' x='{(LEFT + WIDTH - RIGHT) / 2}' y='{HEIGHT - 8}' text-anchor='middle'>{escape(x_label)}</text>")
    out.append(
        f"<text class='label' transform='translate(15 {middle}) rotate(-90)' text-anchor='middle'>{escape(y_label)}</text>"
    )
    return out, sx, sy


def _positive(value) -> bool:
    return value is not None and math.isfinite(value) and value > 0


def _decades(values: list[float]) -> tuple[float, float]:
    """log10 limits with a margin; at least half a decade."""
    low, high = math.log10(min(values)), math.log10(max(values))
    margin = max(0.12 * (high - low), 0.25)
    return low - margin, high + margin


def _ticks(limits: tuple[float, float]) -> list[float]:
    """1, 2 and 5 of each decade; decades alone when there are many."""
    low, high = limits
    steps = (1, 2, 5) if high - low < 2.2 else (1,)
    values = [s * 10.0**d for d in range(math.floor(low), math.ceil(high) + 1) for s in steps]
    return [v for v in values if low <= math.log10(v) <= high]


def _number(value: float) -> str:
    return f"{value:g}" if 1e-3 <= value < 1e5 else f"{value:.0e}".replace("e-0", "e-").replace("e+0", "e")
