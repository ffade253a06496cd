"""One HTML page from results.json files: pictures side by side, tables, error against time and memory. Self-contained.

What ./dev bench left in the folders stands in it too (bench_table.py), alone where nothing else was measured.
"""

import base64
from html import escape
from pathlib import Path

from ..core import methods as registry
from ..core.errors import ReflectError
from ..core.pareto import pareto_front
from ..core.safe_write import write_whole
from . import bench_table, maps
from .page import CSS, TEMPLATE
from .plot import Point, scatter
from .rows import FILE_NAME, Row, is_software, read_rows, set_up_of

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
PICTURES = ("answer", "difference", "hit_error", "composite")
CAPTIONS = {"answer": "its rays", "difference": "difference", "hit_error": "hit-point error", "composite": "as the viewport draws it"}
HEAD = "<header><h1>Reflect: how wrong, for what it costs</h1></header>"
PEER = "eevee"  # evaluation/peer.py
EEVEE = (
    "EEVEE's own picture of the frame, a peer and no method of ours: screen tracing cannot show what is off screen or hidden, "
    "and the sphere probes that stand in for it take the scene to lie on a sphere about the reflector (or, in a room, on the room's box); plane probes "
    "draw what planar mirrors show. It tells no hit points, and its time and memory cannot be told apart from those of the frame."
)


def report(folders: list[Path], out: Path) -> Path:
    """Writes out/index.html from the results of the folders and returns its path. ReflectError names what is wrong."""
    measured = {Path(folder): bench_table.sections(folder) for folder in folders}
    # A folder of ./dev bench alone need not have results.
    evaluated = [f for f, bench in measured.items() if not bench or (f / FILE_NAME).exists()]
    found = [(folder, row) for folder in evaluated for row in read_rows(folder)]
    benches = [section for bench in measured.values() for section in bench]
    if not found and not benches:
        raise ReflectError(
            f"There are no rows in {', '.join(map(str, folders))}.", "Evaluate a scene that has a reflector first."
        )
    frames = _frames(found)
    rows = [row for _, row in found]
    body = [HEAD]
    if rows:
        body = [_head(rows), _methods(rows), *(_frame(key, part) for key, part in frames.items()), _legend()]
    body += benches
    path = Path(out) / "index.html"
    write_whole(path, TEMPLATE.format(css=CSS, body="\n".join(body)).encode())
    return path


def _frames(found: list[tuple[Path, Row]]) -> dict[tuple, list[tuple[Path, Row]]]:
    """Rows that belong side by side. A peer's row stands beside every device's rows of its frame in its folder."""
    frames: dict[tuple, list[tuple[Path, Row]]] = {}

    def add(folder: Path, row: Row, backend: str, device: str) -> None:
        frames.setdefault((row.scene, row.camera, row.frame, row.size, backend, device), []).append((folder, row))

    for folder, row in found:
        if row.method != PEER:
            add(folder, row, row.backend, row.device)
    for folder, row in found:
        if row.method == PEER:
            frame = (row.scene, row.camera, row.frame, row.size)
            hosts = [k for k, part in frames.items() if k[:4] == frame and part[0][0] == folder]
            for backend, device in [k[4:] for k in hosts] or [(row.backend, row.device)]:
                add(folder, row, backend, device)
    return frames


def label_of(row: Row) -> str:
    """The method's name, and what tells a peer's rows apart."""
    if row.method != PEER or "sphere_probe" not in row.settings:
        return row.method
    return f"{row.method}, {set_up_of(row.settings)}"


def _head(rows: list[Row]) -> str:
    devices = sorted({f"{r.device}, {r.backend}, Blender {r.blender}" for r in rows})
    scenes, names = {r.scene for r in rows}, {r.method for r in rows}
    peer = " and EEVEE's own picture" if PEER in names else ""
    names.discard(PEER)
    out = [
        HEAD.removesuffix("</header>"),
        f"<p class='lead'>{len(scenes)} {'scene' if len(scenes) == 1 else 'scenes'}, {len(names)} "
        f"{'method' if len(names) == 1 else 'methods'}{peer}, judged against Cycles along exactly the rays that the shader "
        "answers. Both sides answer single rays: no footprint filtering on either. Mirror radiance is judged, before "
        "Fresnel and tint; only pixels of reflectors count.</p>",
        *(f"<p class='device'>Drawn by {escape(d)}</p>" for d in devices),
    ]
    if any(is_software(f"{r.device} {r.backend}") for r in rows):
        out.append(
            "<p class='warning'><strong>Software device.</strong> Ratios and counts count, milliseconds do not: this device "
            "draws on the CPU.</p>"
        )
    if sum(r.nonfinite or 0 for r in rows):
        out.append("<p class='warning'><strong>Values that are no number were found</strong>: see the last columns.</p>")
    return "".join(out) + "</header>"


def _methods(rows: list[Row]) -> str:
    items = []
    for name in dict.fromkeys(r.method for r in rows):
        items.append(f"<dt>{escape(name)}</dt><dd>{escape(_leaves_out(name))}</dd>")
    return f"<section><h2>What each method leaves out</h2><dl>{''.join(items)}</dl></section>"


def _leaves_out(name: str) -> str:
    """The 'Limits.' of the method's own module, which say it first and best."""
    if name == PEER:
        return EEVEE
    if name not in (*registry.names(), registry.AUTO):
        return "This version of Reflect does not know the method."
    text = registry.get(name).__doc__ or ""
    _, found, rest = text.partition("Limits.")
    paragraph = " ".join((rest if found else text).split("\n\n")[0].split())
    for end in (" Hit points:", " [", " Problem."):
        paragraph = paragraph.split(end)[0]
    return paragraph or "Its module states no limits."


def _frame(key: tuple, part: list[tuple[Path, Row]]) -> str:
    scene, camera, frame, size, backend, _ = key
    rows = [row for _, row in part]
    floor = next((r.floor_rmse for r in rows if r.floor_rmse), None)
    out = [
        f"<section class='scene'><h2>{escape(scene)}</h2><p class='meta'>{escape(camera)}, frame {frame}, {escape(size)}, "
        f"{escape(backend)}, {rows[0].pixels:,} reflector pixels</p>",
        _strip(part),
        "<div class='plots'>",
        _plot(rows, "ms", 1, "milliseconds", floor),
        _plot(rows, "bytes", 1e-6, "MB on the GPU", floor),
        "</div>",
        _table(rows),
        _notes(rows),
        "</section>",
    ]
    return "".join(out)


def _plot(rows: list[Row], field: str, factor: float, label: str, floor: float | None) -> str:
    order = list(dict.fromkeys(r.method for r in rows))
    points = [
        Point(label_of(r), None if getattr(r, field) is None else getattr(r, field) * factor, r.rmse, order.index(r.method) % 6)
        for r in rows
    ]
    left_out = [f"{label_of(r)} (RMSE {_value(r.rmse, 3)})" for r in rows if not getattr(r, field)]
    caption = f"<figcaption>Not in this plot, no {escape(label)}: {escape('; '.join(left_out))}.</figcaption>" if left_out else ""
    return f"<figure>{scatter(points, label, 'RMSE', floor)}{caption}</figure>"


def _strip(part: list[tuple[Path, Row]]) -> str:
    folder, first = part[0]
    out = ["<div class='truths'>"]
    for what, caption in (("frame", "Cycles, the frame"), ("truth", "truth of the rays")):
        out.append(_figure(folder, first, what, f"{first.scene}: {caption}", caption))
    out.append("</div>")
    for folder, row in part:
        name = label_of(row)
        captions = CAPTIONS | ({"answer": "its pixels"} if row.method == PEER else {})
        pictures = "".join(_figure(folder, row, w, f"{name}: {captions[w]}", captions[w]) for w in PICTURES)
        if row.method == PEER:
            pictures += "<figure><p class='none'>It tells no hit points.</p></figure>"
        score = "" if row.flip is None else f"<span>FLIP {_value(row.flip, 3)}</span>"
        hit = "" if row.hit_p95 is None else f"<span>hit p95 {_value(row.hit_p95, 4)}</span>"
        out.append(f"<div class='method'><h3>{escape(name)} {score}{hit}</h3><div class='strip'>{pictures}</div></div>")
    return "".join(out)


def _figure(folder: Path, row: Row, what: str, alt: str, caption: str) -> str:
    if what not in row.pictures:
        return ""
    base = (folder if folder.is_dir() else folder.parent).resolve()
    path = (base / row.pictures[what]).resolve()
    caption = f"<figcaption>{escape(caption)}</figcaption></figure>"
    if not path.is_relative_to(base) or path.suffix.lower() != ".png":
        return f"<figure><p class='none'>not a picture of this folder</p>{caption}"
    try:
        data = base64.b64encode(path.read_bytes()).decode()
    except OSError:
        return f"<figure><p class='none'>{escape(path.name)} is missing</p>{caption}"
    return f"<figure><img alt='{escape(alt, True)}' src='data:image/png;base64,{data}'>{caption}"


def _table(rows: list[Row]) -> str:
    shown = [c for c in COLUMNS if any(getattr(r, c[0]) is not None for r in rows)]
    fronts = pareto_front([(r.ms, r.rmse) for r in rows]), pareto_front([(r.bytes, r.rmse) for r in rows])
    head = "".join(f"<th title='{escape(c[4], True)}'>{escape(c[1])}</th>" for c in shown)
    body = []
    for i, row in enumerate(rows):
        marks = ("<abbr title='nothing else is as fast and as right'>◆</abbr>" if i in fronts[0] else "") + (
            "<abbr title='nothing else is as small and as right'>■</abbr>" if i in fronts[1] else ""
        )
        cells = "".join(
            f"<td{' class=bad' if f == 'nonfinite' and getattr(row, f) else ''}>{_value(getattr(row, f), d, k)}</td>"
            for f, _, d, k, _ in shown
        )
        body.append(f"<tr><th>{escape(label_of(row))} {marks}</th>{cells}</tr>")
    counts = list(dict.fromkeys(k for r in rows for k in r.counts))
    more = ""
    if counts:
        work = "".join(
            f"<tr><th>{escape(label_of(r))}</th>"
            + "".join(f"<td>{_value(r.counts.get(k), 4)}</td>" for k in counts)
            + f"<td class='settings'>{escape(', '.join(f'{k} {v}' for k, v in r.settings.items()))}</td></tr>"
            for r in rows
        )
        names = "".join(f"<th>{escape(k.replace('_', ' '))}</th>" for k in counts)
        more = (
            "<details><summary>Work per frame, and settings</summary><div class='wide'><table><tr><th>method</th>"
            f"{names}<th>settings</th></tr>{work}</table></div></details>"
        )
    return f"<div class='wide'><table><tr><th>method</th>{head}</tr>{''.join(body)}</table></div>{more}"


def _value(value, digits: int, factor: float = 1) -> str:
    if value is None:
        return "–"
    if not isinstance(value, (int, float)):
        return escape(str(value))
    if isinstance(value, int) and factor == 1:
        return f"{value:,}"
    value *= factor
    return "0" if value == 0 else f"{value:.{digits}g}" if 1e-4 <= abs(value) < 1e5 else f"{value:.2e}"


def _notes(rows: list[Row]) -> str:
    notes = dict.fromkeys(f"{label_of(r)}: {n}" for r in rows for n in r.notes)
    return f"<ul class='notes'>{''.join(f'<li>{escape(n)}</li>' for n in notes)}</ul>" if notes else ""


def _legend() -> str:
    stops = ", ".join(_css(maps.false_colour(i / 8)) for i in range(9))
    low, high = maps.HIT_DECADES
    return (
        "<section><h2>How to read this</h2><div class='legend'>"
        f"<p><span class='bar' style='background:linear-gradient(90deg,{stops})'></span>"
        f"difference: 0 to {maps.DIFFERENCE_FULL:g} of the display range; hit-point error: 10<sup>{low:g}</sup> to "
        f"10<sup>{high:g}</sup> of the scene's diagonal, logarithmic</p>"
        f"<p><span class='chip' style='background:{_css(maps.FALSE_HIT)}'></span>false hit: shows a surface where there is sky"
        f"<span class='chip' style='background:{_css(maps.MISSED_HIT)}'></span>missed hit: shows sky where there is a surface</p>"
        "<p>◆ nothing else is as fast and as right; ■ nothing else is as small and as right. Ringed points of a plot are its "
        "Pareto front. Hover over a heading for its meaning.</p></div></section>"
    )


def _css(colour) -> str:
    return "#" + "".join(f"{round(float(c) * 255):02x}" for c in colour)
