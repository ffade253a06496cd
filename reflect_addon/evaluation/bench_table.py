"""What ./dev bench measured, as a table: in the terminal and in the report. Reading is strict, as of results.json (rows.py)."""

import json
from collections.abc import Callable
from dataclasses import fields
from html import escape
from pathlib import Path

from ..core.errors import ReflectError
from . import exhibit
from .bench import FILE_NAME, FORMAT, Target
from .stability import FILE_NAME as STABILITY_FILE
from .stability import FORMAT as STABILITY_FORMAT
from .stability import OTHER, Stability

KINDS = {FILE_NAME: (FORMAT, Target), STABILITY_FILE: (STABILITY_FORMAT, Stability)}
Column = tuple[str, str, Callable]  # heading, what it is, row -> text


def _number(value) -> str:
    if value is None:
        return "–"
    if isinstance(value, list):
        return ", ".join(map(_number, value))
    if abs(value) >= 1000:
        return f"{value:,.0f}" if abs(value) < 1e9 else f"{value:.3g}"
    return f"{value:.3g}"


TARGETS: tuple[Column, ...] = (
    ("target", "its number in the list of targets", lambda r: r.id),
    ("paper", "what the paper measured", lambda r: _number(r.paper)),
    ("ours", "measured in this run", lambda r: _number(r.ours)),
    ("asked", "what is asked of it; – = reported only", lambda r: _number(r.target)),
    ("holds", "whether it does", lambda r: "–" if r.target is None else "yes" if r.holds else "NO"),
    ("how", "what was measured", lambda r: r.how),
)
STABILITY: tuple[Column, ...] = (
    ("case", "scene and rays", lambda r: r.case),
    ("method", "its kernel", lambda r: r.method),
    ("rays", "asked", lambda r: f"{r.rays:,}"),
    ("hits", "rays that report a hit on a surface", lambda r: f"{r.hits:,}"),
    ("NaN/inf", "rays with a value that is no number: must be 0", lambda r: str(r.nonfinite)),
    ("wrong hits", "hits farther from every surface than the method promises, in float32: must be 0", lambda r: str(r.wrong)),
    ("in float64", "the same in float64", lambda r: str(r.wrong64)),
    ("other place %", "rays that show another place in float32 than in float64", lambda r: _number(100 * r.other)),
    ("ulps, 99.9 %", "difference of positions in float32 steps of the largest coordinate", lambda r: _number(r.ulps_999)),
    ("ulps, worst", "the worst of rays that show the same place", lambda r: _number(r.ulps_worst)),
    ("worst relative", "the same over the scene's diagonal", lambda r: _number(r.relative_worst)),
)  # fmt: skip


def read(path: Path) -> list:
    """Targets or Stability rows of a file of ./dev bench. ReflectError naming the file and what is wrong."""
    number, kind = KINDS[Path(path).name]
    remedy = "Measure again with ./dev bench."
    try:
        data = json.loads(Path(path).read_bytes().decode("utf-8"))
    except OSError as error:
        raise ReflectError(f"{path} cannot be read ({error.strerror}).", "Check the path and its permissions.") from error
    except (ValueError, RecursionError) as error:
        raise ReflectError(f"{path} is not valid JSON ({error}).", remedy) from error
    if not isinstance(data, dict) or data.get("format") != number or not isinstance(data.get("rows"), list):
        raise ReflectError(f"{path} is no file of format {number} with rows.", remedy)
    known = {f.name for f in fields(kind)}
    for row in data["rows"]:
        if not isinstance(row, dict) or row.keys() != known or not all(map(_fits, row.values())):
            raise ReflectError(f"{path} has a row that is none of ours: {str(row)[:80]}.", remedy)
    return [kind(**row) for row in data["rows"]]


def _fits(value) -> bool:
    return value is None or isinstance(value, (str, int, float)) or isinstance(value, list) and all(map(_is_number, value))


def _is_number(value) -> bool:
    return isinstance(value, (int, float))


def text(path: Path) -> str:
    """The table for a terminal; the last column may run on."""
    if Path(path).name == exhibit.FILE_NAME:
        return exhibit.text(path)
    columns = _columns(path)
    rows = [[c[0] for c in columns], *([c[2](row) for c in columns] for row in read(path))]
    widths = [max(len(row[i]) for row in rows) for i in range(len(columns) - 1)]
    return "\n".join("  ".join([*(t.ljust(w) for t, w in zip(row, widths, strict=False)), row[-1]]) for row in rows)


def sections(folder: Path) -> list[str]:
    """HTML sections of what ./dev bench left in a folder, none where there is nothing."""
    titles = {
        FILE_NAME: ("The papers' targets", "Measured in one run; times are ratios within it."),
        STABILITY_FILE: (
            "Numerical stability",
            "Every method's kernel in float32 beside the same kernel in float64, on the same rays and tables. Ulps are float32 "
            "steps of the largest coordinate of ray and hit. A ray that shows a place farther off than "
            f"{OTHER:g} of the scene's diagonal took another texel or passed an edge on the other side: it is counted, and "
            "judged like all others by how far its hit lies from the nearest surface.",
        ),
    }
    made = {name: _section(Path(folder) / name, *titles[name]) for name in KINDS if (Path(folder) / name).is_file()}
    return [*(made[n] for n in (FILE_NAME,) if n in made), *exhibit.sections(folder), *(made[n] for n in (STABILITY_FILE,) if n in made)]


def _section(path: Path, title: str, lead: str) -> str:
    columns, rows = _columns(path), read(path)
    head = "".join(f"<th title='{escape(about, True)}'{_left(name)}>{escape(name)}</th>" for name, about, _ in columns)
    body = "".join(f"<tr>{''.join(_cell(row, column) for column in columns)}</tr>" for row in rows)
    bad = [r for r in rows if _is_bad(r)]
    said = f"{len(rows) - len(bad)} of {len(rows)} rows hold." if path.name == FILE_NAME else (
        "Nothing non-finite and no wrong hit." if not bad else f"{len(bad)} rows have values or hits that are wrong."
    )  # fmt: skip
    warning = " class='warning'" if bad else ""
    return (
        f"<section class='bench'><h2>{title}</h2><p class='lead'>{lead}</p><p{warning}>{said}</p>"
        f"<div class='wide'><table><tr>{head}</tr>{body}</table></div></section>"
    )


def _cell(row, column: Column) -> str:
    name, _, shown = column
    value = shown(row)
    bad = value == "NO" or name in ("NaN/inf", "wrong hits", "in float64") and value != "0"
    return f"<td{' class=bad' if bad else _left(name)}>{escape(value)}</td>"


def _left(name: str) -> str:
    """Texts stand left, numbers right."""
    return " class=settings" if name in ("how", "method") else ""


def _is_bad(row) -> bool:
    return not row.holds if isinstance(row, Target) else bool(row.nonfinite or row.wrong)


def _columns(path: Path) -> tuple[Column, ...]:
    return TARGETS if Path(path).name == FILE_NAME else STABILITY
