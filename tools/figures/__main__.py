"""`./dev figures [NAME ...] --out DIR`: the figures of popescu-2006, truth beside them, and an index with their numbers."""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import bpy  # noqa: F401  the pip module makes mathutils known

from reflect_addon.core.errors import ReflectError
from reflect_addon.gpu.device import describe

from . import bunnies, extremes, ground, nine, page, shading, teapots
from .studio import Studio

# Those that share a scene stand beside each other.
FIGURES = {
    "1": teapots.fig1,
    "2": shading.fig2,
    "15": shading.fig15,
    "3": bunnies.fig3,
    "13": bunnies.fig13,
    "14": bunnies.fig14,
    "5": nine.fig5,
    "6-7": ground.fig6_7,
    "16": extremes.fig16,
}
ROOT = Path(__file__).resolve().parents[2]


def main(argv=None) -> int:
    parser = argparse.ArgumentParser(prog="./dev figures", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"which: {', '.join(FIGURES)}; all when none is named")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "figures")
    parser.add_argument("--size", default="320x240", help="of one picture, WxH")
    parser.add_argument("--samples", type=int, default=32, help="Cycles' paths a ray of the truth")
    parser.add_argument("--texels", type=int, default=512, help="nothing that is baked is finer: a power of two")
    arguments = parser.parse_args(argv)
    unknown = [name for name in arguments.names if name not in FIGURES]
    if unknown:
        parser.error(f"no figure {', '.join(unknown)}; there are: {', '.join(FIGURES)}")
    try:
        size = tuple(int(part) for part in arguments.size.split("x"))
        if len(size) != 2 or min(size) < 16:
            raise ValueError
    except ValueError:
        parser.error(f"a size is WxH with 16 pixels or more, not {arguments.size}")
    made, failed = {}, []
    with tempfile.TemporaryDirectory(prefix="reflect-figures-") as folder:
        with Studio(size, arguments.samples, arguments.texels, Path(folder)) as studio:
            for name in [n for n in FIGURES if n in arguments.names or not arguments.names]:
                begun = time.monotonic()
                try:
                    made[name] = FIGURES[name](studio)
                    page.write_sheets(made[name], arguments.out)
                except ReflectError as error:
                    failed.append(name)
                    print(f"figures: {name} could not be made: {error}", file=sys.stderr)
                    continue
                print(f"figures: {name}, {time.monotonic() - begun:.0f} s", file=sys.stderr, flush=True)
    if not made:
        return 1
    device = describe()
    words = f"Answers: {device['renderer']}; truth: Cycles of Blender {bpy.app.version_string}, {arguments.samples} paths a ray."
    in_order = sorted(made, key=lambda name: int(name.partition("-")[0]))
    print(page.write_index([made[name] for name in in_order], words, arguments.out))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
