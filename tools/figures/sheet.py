"""Labelled pictures in rows as one PNG: the figures' strips and the README's picture.

Equal panels give an equal file: matplotlib's own font, no date or version in it.
"""

import io
from collections.abc import Callable
from dataclasses import dataclass

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from PIL import Image  # noqa: E402

from reflect_addon.evaluation.maps import DIFFERENCE_FULL, false_colour  # noqa: E402

DPI = 100  # one pixel of a picture is one of the sheet
GAP, LABEL, FOOT, LINE = 0.08, 0.42, 0.34, 0.16  # inches
DIFFERENCE = f"difference: 0 to {DIFFERENCE_FULL:g} of the display range, {1 / DIFFERENCE_FULL:g} times amplified."


@dataclass(frozen=True)
class Panel:
    """picture: (H, W, 3) 0..1 or bytes, top row first; or a function that draws into matplotlib's axes."""

    title: str
    picture: np.ndarray | Callable[[object], None]
    detail: str = ""


def draw(
    rows: list[list[Panel | None]],
    tile: tuple[int, int],
    words: str = "",
    legend: bool = True,
    colours: int | None = None,
) -> bytes:
    """PNG of the rows of panels, each `tile` (width, height) pixels; None is an empty place. words: below them, beside the
    colours of difference maps, which legend=False leaves out. colours: of a palette that makes the file small."""
    columns, tile_w, tile_h = max(len(row) for row in rows), tile[0] / DPI, tile[1] / DPI
    lines = words.split("\n") if words else []
    foot = max(FOOT, LINE * len(lines) + 0.18)
    width, height = columns * (tile_w + GAP) + GAP, len(rows) * (tile_h + GAP + LABEL) - GAP + foot
    figure = plt.figure(figsize=(width, height), dpi=DPI, facecolor="white")
    for r, row in enumerate(rows):
        bottom = height - (r + 1) * (tile_h + LABEL) - r * GAP
        for c, panel in enumerate(row):
            if panel is None:
                continue
            left = GAP + c * (tile_w + GAP)
            if callable(panel.picture):
                x, y = left + 0.12 * tile_w, bottom + 0.13 * tile_h  # room for the ticks' numbers
                axes = figure.add_axes((x / width, y / height, 0.85 * tile_w / width, 0.85 * tile_h / height))
                panel.picture(axes)
            else:
                axes = figure.add_axes((left / width, bottom / height, tile_w / width, tile_h / height))
                axes.imshow(panel.picture, interpolation="nearest", aspect="auto")
                axes.set_axis_off()
            figure.text(
                left / width, (bottom + tile_h + 0.23) / height, panel.title, fontsize=9, weight="bold", va="bottom"
            )
            figure.text(
                left / width, (bottom + tile_h + 0.06) / height, panel.detail, fontsize=8, color="#555", va="bottom"
            )
    left = 2 * GAP
    if legend:
        axes = figure.add_axes((left / width, (foot / 2 - 0.06) / height, 1.5 / width, 0.12 / height))
        axes.imshow(false_colour(np.linspace(0, 1, 256))[None], aspect="auto")
        axes.set_axis_off()
        left += 1.6
    figure.text(
        left / width, foot / 2 / height, "\n".join(lines), fontsize=8, color="#555", va="center", linespacing=1.3
    )
    plain = io.BytesIO()
    figure.savefig(plain, dpi=DPI, format="png", metadata={"Software": None})
    plt.close(figure)
    picture, out = Image.open(plain).convert("RGB"), io.BytesIO()
    if colours is not None:
        picture = picture.quantize(colours, dither=Image.Dither.NONE)
    picture.save(out, "PNG", optimize=True)
    return out.getvalue()


def short(value: float | None) -> str:
    return "–" if value is None else f"{value:.2g}" if value < 10 else f"{value:.0f}"
