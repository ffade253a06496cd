"""Draws docs/pictures/demo.png from the demo's own results: the truth and each method above their difference maps.

    ./dev demo
    ./dev python tools/readme_picture.py [RESULTS] [--out PICTURE.png]      RESULTS: out/demo/teapots

Equal results give an equal picture.
"""

import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
from PIL import Image  # noqa: E402

from reflect_addon.core.errors import ReflectError  # noqa: E402
from reflect_addon.core.safe_write import write_whole  # noqa: E402
from reflect_addon.evaluation.report_table import label_of  # noqa: E402
from reflect_addon.evaluation.rows import read_rows  # noqa: E402
from tools.figures.sheet import DIFFERENCE, Panel, draw as draw_sheet, short  # noqa: E402

LARGEST = 200_000  # bytes: a README's picture is fetched by everyone who looks
TILE = 240, 180  # the demo's pictures
COLOURS = 256  # of the palette
# The baseline of all, the best that was published for no ray tracing, ours, and Blender's own.
SHOWN = ("environment", "layered_distance", "billboards", "depth_maps", "eevee")


def chosen(rows):
    """The rows to show: of the methods SHOWN those that there are, and of a peer's rows the better one."""
    best = {}
    for row in rows:
        if row.method in SHOWN and (row.method not in best or _flip(row) < _flip(best[row.method])):
            best[row.method] = row
    return list(best.values())


def draw(rows, folder: Path) -> bytes:
    """PNG of the rows, which share one frame."""
    first = rows[0]
    top = [Panel("truth", _read(folder, first, "truth"), "Cycles, along the shader's rays")]
    below = [Panel("the frame", _read(folder, first, "frame"), "Cycles, with Fresnel and tint")]
    for row in rows:
        top.append(Panel(label_of(row), _read(folder, row, "answer"), _numbers(row)))
        below.append(Panel("its difference", _read(folder, row, "difference"), f"RMSE {short(row.rmse)}"))
    words = f"{DIFFERENCE} FLIP: 0 = looks equal. hit p95: hit-point error / scene diagonal, 95 % are below."
    return draw_sheet([top, below], TILE, words, colours=COLOURS)


def _numbers(row) -> str:
    hit = "no hit points" if row.hit_p95 is None else f"hit p95 {short(row.hit_p95)}"
    return f"FLIP {short(row.flip)}, {hit}"


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
