"""`./dev exports [NAME ...] --out DIR`: the samples exported, drawn by other programs, and held against `render`; ./dev report DIR shows it."""

import argparse
import sys
from pathlib import Path

import bpy  # noqa: F401  the pip module makes mathutils known

from reflect_addon.cli_values import setting
from reflect_addon.core import methods as registry
from reflect_addon.core.errors import ReflectError
from reflect_addon.evaluation import bench_table, exhibit
from reflect_addon.evaluation.bench import write_targets
from reflect_addon.evaluation.export_file import Shot

from tools import godot

from .measured import exported, in_a_browser, in_godot
from .node_package import Failed, Missing

ROOT = Path(__file__).resolve().parents[2]
METHODS = (*registry.gathering(), registry.AUTO)
SAMPLES = tuple(sorted(path.stem for path in (ROOT / "sample_blends").glob("*.blend")))


def main(argv=None) -> int:
    parser = argparse.ArgumentParser(prog="./dev exports", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"samples or .blend files: {', '.join(SAMPLES)}; all samples when none is named")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "exports")
    parser.add_argument("--methods", default="", metavar="A,B", help=f"default: all of {', '.join(METHODS)}")
    parser.add_argument("--size", default="320x240", help="of the pictures, WxH")
    parser.add_argument("--samples", type=int, default=16, help="Cycles' paths per pixel behind the reflectors")
    parser.add_argument("--set", type=setting, action="append", default=[], metavar="NAME=VALUE", help="a setting of bakes, for all methods that have it")
    arguments = parser.parse_args(argv)
    shot = Shot(tuple(int(part) for part in arguments.size.split("x")), samples=arguments.samples)
    wanted = tuple(filter(None, arguments.methods.split(","))) or METHODS
    rows, exhibits, wrong = [], [], 0
    try:
        for name in arguments.names or SAMPLES:
            blend = Path(name) if name.endswith(".blend") else ROOT / "sample_blends" / f"{name}.blend"
            export = exported(blend, arguments.out / blend.stem, wanted, shot, dict(arguments.set), _say(name))
            for program, drawn in (("a browser", in_a_browser), ("Godot", in_godot)):
                try:
                    more, table = drawn(export)
                except (Missing, godot.NoGodot) as missing:
                    print(f"exports: NOT DRAWN by {program}: {missing}", file=sys.stderr)
                    wrong = 1
                    continue
                rows, exhibits = rows + more, [*exhibits, table]
                written = write_targets(rows, exhibits, arguments.out)
    except (Failed, ReflectError) as error:
        print(f"exports: {error}", file=sys.stderr)
        wrong = 1
    if rows:
        print(bench_table.text(written[0]), exhibit.text(written[1]), *written, sep="\n")
    return wrong or int(not all(row.holds for row in rows))


def _say(name: str):
    return lambda share, what: print(f"exports: {name}: {100 * share:3.0f} % {what}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
