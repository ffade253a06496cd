"""A frame's rows as a table of the report: what was measured, to how many digits, and what nothing else is as good as."""

from html import escape

from ..core.pareto import pareto_front
from .rows import Row, set_up_of

# field, heading, digits, factor, what it is
COLUMNS = (
    ("rmse", "RMSE", 4, 1, "root mean squared radiance error, scene-linear, reflector pixels only"),
    ("floor_rmse", "floor", 4, 1, "the same between two truths with different seeds: nothing can be judged below it"),
    ("relmse", "relMSE", 4, 1, "squared error relative to the truth"),
    ("median_relative", "median rel.", 3, 100, "median relative difference, %"),
    ("flip", "FLIP", 3, 1, "perceived difference on the view-transformed picture, 0 = equal"),
    ("ssim", "SSIM", 3, 1, "structural similarity on the view-transformed picture, 1 = equal"),
    ("hit_p50", "hit p50", 4, 1, "median distance between shown and true hit point / scene diagonal"),
    ("hit_p95", "hit p95", 4, 1, "95th percentile of the same"),
    ("angle_p50", "angle p50 °", 3, 1, "median angle between shown and true hit point from the ray's origin"),
    ("angle_p95", "angle p95 °", 3, 1, "95th percentile of the same"),
    ("false_hit", "false hit %", 2, 100, "share of rays that show a surface where there is sky"),
    ("missed_hit", "missed hit %", 2, 100, "share of rays that show sky where there is a surface"),
    ("ms", "ms", 3, 1, "reflection passes per frame, median after warm-up"),
    ("ms_spread", "± ms", 2, 1, "half the interquartile range of that"),
    ("ms_vs_environment", "× env.", 3, 1, "time as a multiple of `environment` in the same run"),
    ("bake_s", "bake s", 3, 1, "seconds to bake"),
    ("upload_ms", "upload ms", 3, 1, "milliseconds to upload and compile"),
    ("bytes", "MB", 3, 1e-6, "memory of the assets on the GPU"),
    ("nonfinite", "NaN/inf", 6, 1, "values that are no number: must be 0"),
)
PEER = "eevee"  # evaluation/peer.py


def label_of(row: Row) -> str:
    """The method's name, and what tells a peer's rows apart."""
    if row.method != PEER or "sphere_probe" not in row.settings:
        return row.method
    return f"{row.method}, {set_up_of(row.settings)}"


def results_table(rows: list[Row]) -> str:
    """Rows of one frame; below it what they cost in counts, and their settings."""
    shown = [c for c in COLUMNS if any(getattr(r, c[0]) is not None for r in rows)]
    fronts = pareto_front([(r.ms, r.rmse) for r in rows]), pareto_front([(r.bytes, r.rmse) for r in rows])
    head = "".join(f"<th title='{escape(c[4], True)}'>{escape(c[1])}</th>" for c in shown)
    body = []
    for i, row in enumerate(rows):
        marks = ("<abbr title='nothing else is as fast and as right'>◆</abbr>" if i in fronts[0] else "") + (
            "<abbr title='nothing else is as small and as right'>■</abbr>" if i in fronts[1] else ""
        )
        cells = "".join(
            f"<td{' class=bad' if f == 'nonfinite' and getattr(row, f) else ''}>{value_text(getattr(row, f), d, k)}</td>"
            for f, _, d, k, _ in shown
        )
        body.append(f"<tr><th>{escape(label_of(row))} {marks}</th>{cells}</tr>")
    counts = list(dict.fromkeys(k for r in rows for k in r.counts))
    more = ""
    if counts:
        work = "".join(
            f"<tr><th>{escape(label_of(r))}</th>"
            + "".join(f"<td>{value_text(r.counts.get(k), 4)}</td>" for k in counts)
            + f"<td class='settings'>{escape(', '.join(f'{k} {v}' for k, v in r.settings.items()))}</td></tr>"
            for r in rows
        )
        names = "".join(f"<th>{escape(k.replace('_', ' '))}</th>" for k in counts)
        more = (
            "<details><summary>Work per frame, and settings</summary><div class='wide'><table><tr><th>method</th>"
            f"{names}<th>settings</th></tr>{work}</table></div></details>"
        )
    return f"<div class='wide'><table><tr><th>method</th>{head}</tr>{''.join(body)}</table></div>{more}"


def value_text(value, digits: int, factor: float = 1) -> str:
    """A cell; "–" for None."""
    if value is None:
        return "–"
    if not isinstance(value, (int, float)):
        return escape(str(value))
    if isinstance(value, int) and factor == 1:
        return f"{value:,}"
    value *= factor
    return "0" if value == 0 else f"{value:.{digits}g}" if 1e-4 <= abs(value) < 1e5 else f"{value:.2e}"
