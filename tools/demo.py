"""`./dev demo`: evaluate every method that answers rays on the sample scenes, or on the files named, and write one report.

Each file runs in its own process, so that a file that cannot be evaluated leaves the others their place in the report.
"""

import argparse
import subprocess
import sys
import time
from pathlib import Path

from reflect_addon.core.methods import gathering

ROOT = Path(__file__).resolve().parents[1]
SAMPLES = ("teapots", "columns", "contact", "kitchen")
CLI = "import sys; from reflect_addon.cli import main; sys.exit(main(sys.argv[1:]))"
# What two cores do in a quarter of an hour, most of it depth maps, and the eye can still judge.
SIZE, CYCLES_SAMPLES = "240x180", 32
# Below the methods' defaults, which take several times as long to bake.
BAKE = ("--resolution", "128", "--set", "samples=8", "--set", "view_texels=64")
# 34 mirrors, most of them a few pixels wide: a quarter of the rays, or it would take longer than all the others together.
BAKE_OF = {ROOT / "sample_blends" / "kitchen.blend": (
    "--resolution", "64", *(w for s in ("samples=8", "texels=64", "maps=1", "self_detail=1", "turns=18", "views=4", "view_texels=16") for w in ("--set", s))
)}  # fmt: skip


def reflect(*arguments):
    """Run one `reflect` verb in its own process; returns its exit status."""
    return subprocess.run([sys.executable, "-c", CLI, *map(str, arguments)]).returncode


def names_for(files):
    """A folder name for each file, numbered where two files share a stem."""
    names = []
    for file in files:
        same = sum(name == file.stem or name.startswith(f"{file.stem}-") for name in names)
        names.append(file.stem if not same else f"{file.stem}-{same + 1}")
    return names


def main(argv=None):
    parser = argparse.ArgumentParser(prog="./dev demo", description=__doc__)
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE.blend", help="instead of the samples")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "demo")
    parser.add_argument(
        "--no-eevee", action="store_true", help="without EEVEE's own picture beside the methods (some minutes a file on two cores)"
    )
    arguments = parser.parse_args(argv)
    files = arguments.files or [ROOT / "sample_blends" / f"{name}.blend" for name in SAMPLES]
    missing = [str(file) for file in files if not file.is_file()]
    if missing:
        parser.error(f"no such file: {', '.join(missing)}")

    # Without virtual objects, until they cost software OpenGL less than seconds a frame (docs/decisions.md).
    methods = ",".join((*gathering(), *(() if arguments.no_eevee else ("eevee",))))
    done, failed = [], []
    begun = time.monotonic()
    for number, (file, name) in enumerate(zip(files, names_for(files)), 1):
        print(f"demo: {file.name} ({number} of {len(files)})", file=sys.stderr, flush=True)
        out = arguments.out / name
        status = reflect(
            "evaluate", file, "--methods", methods, "--size", SIZE, "--samples", CYCLES_SAMPLES, "--out", out,
            *BAKE_OF.get(file.absolute(), BAKE),
        )
        (failed if status else done).append((file, out))
    if not done:
        print("demo: no file could be evaluated; the reasons are above.", file=sys.stderr)
        return 1
    status = reflect("report", *(out for _, out in done), "--out", arguments.out)
    pages = sorted(arguments.out.glob("*.html"))
    if status or not pages:
        print("demo: the report could not be written; the reason is above.", file=sys.stderr)
        return 1
    for file, _ in failed:
        print(f"demo: {file} is NOT in the report; the reason is above.", file=sys.stderr)
    print(f"demo: {time.monotonic() - begun:.0f} s. Open the report in a browser:", file=sys.stderr)
    print(*pages, sep="\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
