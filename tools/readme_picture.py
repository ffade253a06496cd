"""Draws docs/pictures/demo.png from the demo's own results: the truth and each method above their difference maps.

    ./dev demo
    ./dev python tools/readme_picture.py [RESULTS] [--out PICTURE.png]      RESULTS: out/demo/teapots

Equal results give an equal picture. matplotlib's own font, no date or version in the file.
"""

import argparse
import io
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import matplotlib  # noqa: E402

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from PIL import Image  # noqa: E402

from reflect_addon.core.errors import ReflectError  # noqa: E402
from reflect_addon.core.safe_write import write_whole  # noqa: E402
from reflect_addon.evaluation.maps import DIFFERENCE_FULL, false_colour  # noqa: E402
from reflect_addon.evaluation.report import label_of  # noqa: E402
from reflect_addon.evaluation.rows import read_rows  # noqa: E402

LARGEST = 200_000  # bytes: a README's picture is fetched by everyone who looks
TILE = 240 / 100, 180 / 100  # inches at DPI: one pixel of the demo's pictures is one of ours
DPI = 100
GAP, LABEL, FOOT = 0.08, 0.42, 0.34  # inches
COLOURS = 256  # of the palette


def chosen(rows):
    """The rows to show: every method, and of a peer's rows the better one."""
    best = {}
    for row in rows:
        if row.method not in best or _flip(row) < _flip(best[row.method]):
            best[row.method] = row
    return list(best.values())


def draw(rows, folder: Path) -> bytes:
    """PNG of the rows, which share one frame."""
    columns = len(rows) + 1
    width, height = columns * (TILE[0] + GAP) + GAP, 2 * TILE[1] + GAP + 2 * LABEL + FOOT
    figure = plt.figure(figsize=(width, height), dpi=DPI, facecolor="white")

    def place(column, row, picture, title, detail):
        left = GAP + column * (TILE[0] + GAP)
        bottom = FOOT + (1 - row) * (TILE[1] + GAP + LABEL)
        axes = figure.add_axes((left / width, bottom / height, TILE[0] / width, TILE[1] / height))
        axes.imshow(picture, interpolation="nearest", aspect="auto")
        axes.set_axis_off()
        figure.text(left / width, (bottom + TILE[1] + 0.23) / height, title, fontsize=9, weight="bold", va="bottom")
        figure.text(left / width, (bottom + TILE[1] + 0.06) / height, detail, fontsize=8, color="#555", va="bottom")

    first = rows[0]
    place(0, 0, _read(folder, first, "truth"), "truth", "Cycles, along the shader's rays")
    for column, row in enumerate(rows, 1):
        place(column, 0, _read(folder, row, "answer"), label_of(row), _numbers(row))
        place(column, 1, _read(folder, row, "difference"), "its difference", f"RMSE {_short(row.rmse)}")
    place(0, 1, _read(folder, first, "frame"), "the frame", "Cycles, with Fresnel and tint")
    _scale(figure, width, height)
    plain = io.BytesIO()
    figure.savefig(plain, dpi=DPI, format="png", metadata={"Software": None})
    plt.close(figure)
    small, out = Image.open(plain).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE), io.BytesIO()
    small.save(out, "PNG", optimize=True)
    return out.getvalue()


def _scale(figure, width: float, height: float) -> None:
    """The colours of the difference maps, below them."""
    left = 2 * GAP + TILE[0]
    axes = figure.add_axes((left / width, 0.12 / height, 1.5 / width, 0.12 / height))
    axes.imshow(false_colour(np.linspace(0, 1, 256))[None], aspect="auto")
    axes.set_axis_off()
    text = f"difference: 0 to {DIFFERENCE_FULL:g} of the display range. FLIP: 0 = looks equal. "
    text += "hit p95: hit-point error / scene diagonal, 95 % are below."
    figure.text((left + 1.6) / width, 0.18 / height, text, fontsize=8, color="#555", va="center")


def _numbers(row) -> str:
    hit = "no hit points" if row.hit_p95 is None else f"hit p95 {_short(row.hit_p95)}"
    return f"FLIP {_short(row.flip)}, {hit}"


def _short(value) -> str:
    return "–" if value is None else f"{value:.2g}" if value < 10 else f"{value:.0f}"


def _flip(row) -> float:
    return float("inf") if row.flip is None else row.flip


def _read(folder: Path, row, what: str) -> np.ndarray:
    return np.asarray(Image.open(folder / row.pictures[what]).convert("RGB"))


def main(argv=None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", nargs="?", type=Path, default=ROOT / "out" / "demo" / "teapots")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "pictures" / "demo.png")
    arguments = parser.parse_args(argv)
    try:
        content = draw(chosen(read_rows(arguments.results)), arguments.results)
        if len(content) > LARGEST:
            raise ReflectError(f"The picture would be {len(content):,} bytes.", "Lower COLOURS in this script.")
        write_whole(arguments.out, content)
    except ReflectError as error:
        print(f"readme_picture: {error}", file=sys.stderr)
        return 1
    print(arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
