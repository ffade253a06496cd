"""One HTML page from results.json files: pictures side by side, tables, error against time and memory. Self-contained.

What ./dev bench left in the folders stands in it too (bench_table.py), alone where nothing else was measured.
"""

import base64
from html import escape
from pathlib import Path

from ..core import methods as registry
from ..core.errors import ReflectError
from ..core.safe_write import write_whole
from . import bench_table, maps
from .page import CSS, TEMPLATE
from .plot import Point, scatter
from .report_table import PEER, label_of, results_table, value_text
from .rows import FILE_NAME, Row, is_software, read_rows

PICTURES = ("answer", "difference", "hit_error", "composite")
CAPTIONS = {"answer": "its rays", "difference": "difference", "hit_error": "hit-point error", "composite": "as the viewport draws it"}
HEAD = "<header><h1>Reflect: how wrong, for what it costs</h1></header>"
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
        results_table(rows),
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
    left_out = [f"{label_of(r)} (RMSE {value_text(r.rmse, 3)})" for r in rows if not getattr(r, field)]
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
        score = "" if row.flip is None else f"<span>FLIP {value_text(row.flip, 3)}</span>"
        hit = "" if row.hit_p95 is None else f"<span>hit p95 {value_text(row.hit_p95, 4)}</span>"
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
