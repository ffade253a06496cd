"""A folder of figures: their strips, and index.html with the words and numbers of each."""

from html import escape
from pathlib import Path

from reflect_addon.core.safe_write import write_whole
from reflect_addon.evaluation.page import CSS, TEMPLATE

from .studio import Figure


def write_sheets(figure: Figure, out: Path) -> None:
    for name, content in figure.sheets:
        write_whole(out / name, content)


def write_index(figures: list[Figure], device: str, out: Path) -> Path:
    """Writes index.html, which shows the figures' sheets beside it; returns the page."""
    parts = [
        "<h1>Reflected-scene impostors: the paper's figures, ours</h1>",
        "<p class='lead'>Popescu, Mei, Dauble, Sacks 2006, remade: each method's picture beside Cycles' truth for the same rays.</p>",
        f"<p class='device'>{escape(device)}</p>",
    ]
    for figure in figures:
        parts.append(f"<section><h2>{escape(figure.title)}</h2><p class='lead'>{escape(figure.words)}</p>")
        for name, _ in figure.sheets:
            source = f"<img src='{escape(name, True)}' alt='{escape(figure.title, True)}'>"
            parts.append(f"<figure class='wide'><a href='{escape(name, True)}'>{source}</a></figure>")
        if figure.rows:
            rows = "".join(_row(row, "td" if i else "th") for i, row in enumerate(figure.rows))
            parts.append(f"<div class='wide'><table>{rows}</table></div>")
        parts.append("</section>")
    page = out / "index.html"
    write_whole(page, TEMPLATE.format(css=CSS, body="\n".join(parts)).encode())
    return page


def _row(values: list[str], tag: str) -> str:
    return "<tr>" + "".join(f"<{tag}>{escape(value)}</{tag}>" for value in values) + "</tr>"
