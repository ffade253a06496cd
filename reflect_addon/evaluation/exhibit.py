"""What one number cannot show: tables and pictures beside targets.json, for the report.

A part of ./dev bench returns Exhibits among its rows. They are kept as DIR/exhibits.json, their pictures as files in DIR/pictures, and
stand in the report below the targets. Pictures are arrays (PNG) or a plot of plot.py (SVG, with the report's own style).
"""

import base64
import json
import re
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np

from ..core.errors import ReflectError
from ..core.safe_write import write_whole
from .page import CSS
from .png import write_png

FORMAT = 1
FILE_NAME = "exhibits.json"
TEXTS = ("title", "lead")
TYPES = {".png": "image/png", ".svg": "image/svg+xml"}


@dataclass(frozen=True)
class Exhibit:
    """A table, pictures, or both."""

    title: str
    lead: str
    heads: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()  # as many cells as heads
    pictures: tuple[tuple[str, np.ndarray | str], ...] = ()  # (caption, (H, W, 3) display-encoded, row 0 at the bottom; or SVG text)


def write(exhibits: list[Exhibit], out: Path) -> Path | None:
    """Writes out/exhibits.json and its pictures, and returns its path; without exhibits an earlier run's file goes."""
    path = Path(out) / FILE_NAME
    if not exhibits:
        path.unlink(missing_ok=True)
        return None
    data = []
    for exhibit in exhibits:
        files = []
        for number, (caption, picture) in enumerate(exhibit.pictures):
            stem = "pictures/bench-" + re.sub(r"[^a-z0-9]+", "-", exhibit.title.lower()).strip("-")
            name = f"{stem}-{number}{'.svg' if isinstance(picture, str) else '.png'}"
            if isinstance(picture, str):
                write_whole(Path(out) / name, _alone(picture).encode())
            else:
                write_png(Path(out) / name, picture)
            files.append([caption, name])
        texts = {name: getattr(exhibit, name) for name in TEXTS}
        data.append({**texts, "heads": list(exhibit.heads), "rows": [*map(list, exhibit.rows)], "pictures": files})
    write_whole(path, (json.dumps({"format": FORMAT, "exhibits": data}, indent=1) + "\n").encode())
    return path


def _alone(svg: str) -> str:
    """The same as a file that needs no page around it."""
    return svg.replace("<svg ", "<svg xmlns='http://www.w3.org/2000/svg' ", 1).replace(">", f"><style>{escape(CSS, False)}</style>", 1)


def read(path: Path) -> list[dict]:
    """The exhibits of a file of ./dev bench, pictures as [caption, path below its folder]. ReflectError naming what is wrong."""
    remedy = "Measure again with ./dev bench."
    try:
        data = json.loads(Path(path).read_bytes().decode("utf-8"))
    except OSError as error:
        raise ReflectError(f"{path} cannot be read ({error.strerror}).", "Check the path and its permissions.") from error
    except (ValueError, RecursionError) as error:
        raise ReflectError(f"{path} is not valid JSON ({error}).", remedy) from error
    if not isinstance(data, dict) or data.get("format") != FORMAT or not isinstance(data.get("exhibits"), list):
        raise ReflectError(f"{path} is no file of format {FORMAT} with exhibits.", remedy)
    for one in data["exhibits"]:
        if not isinstance(one, dict) or one.keys() != {*TEXTS, "heads", "rows", "pictures"} or not _fits(one):
            raise ReflectError(f"{path} has an exhibit that is none of ours: {str(one)[:80]}.", remedy)
    return data["exhibits"]


def _fits(one: dict) -> bool:
    lists = (one["heads"], *one["rows"], *one["pictures"]) if isinstance(one["rows"], list) and isinstance(one["pictures"], list) else (None,)
    if not all(isinstance(part, list) and all(isinstance(text, str) for text in part) for part in lists):
        return False
    return (
        all(isinstance(one[name], str) for name in TEXTS)
        and all(len(row) == len(one["heads"]) for row in one["rows"])
        and all(len(picture) == 2 for picture in one["pictures"])
    )


def text(path: Path) -> str:
    """The tables for a terminal."""
    out = []
    for one in read(path):
        lines = [one["heads"], *one["rows"]]
        widths = [max(len(line[i]) for line in lines) for i in range(len(one["heads"]))]
        out += ["", one["title"], *("  ".join(t.ljust(w) for t, w in zip(line, widths, strict=True)).rstrip() for line in lines if line)]
    return "\n".join(out[1:])


def sections(folder: Path) -> list[str]:
    """HTML sections of the exhibits in a folder, none where there are none."""
    path = Path(folder) / FILE_NAME
    return [_section(Path(folder), one) for one in read(path)] if path.is_file() else []


def _section(folder: Path, one: dict) -> str:
    def line(cells, tag):
        return f"<tr>{''.join(f'<{tag}>{escape(text)}</{tag}>' for text in cells)}</tr>"

    table = f"<div class='wide'><table>{line(one['heads'], 'th')}{''.join(line(row, 'td') for row in one['rows'])}</table></div>"
    shown = "".join(_figure(folder, *picture) for picture in one["pictures"])
    return (
        f"<section class='bench'><h2>{escape(one['title'])}</h2><p class='lead'>{escape(one['lead'])}</p>{table if one['heads'] else ''}"
        f"{f'<div class=exhibit>{shown}</div>' if shown else ''}</section>"
    )


def _figure(folder: Path, caption: str, name: str) -> str:
    base = folder.resolve()
    path = (base / name).resolve()
    said = f"<figcaption>{escape(caption)}</figcaption></figure>"
    if not path.is_relative_to(base) or path.suffix.lower() not in TYPES:
        return f"<figure><p class='none'>not a picture of this folder</p>{said}"
    try:
        data = base64.b64encode(path.read_bytes()).decode()
    except OSError:
        return f"<figure><p class='none'>{escape(path.name)} is missing</p>{said}"
    return f"<figure><img alt='{escape(caption, True)}' src='data:{TYPES[path.suffix.lower()]};base64,{data}'>{said}"
