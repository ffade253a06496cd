"""The command line: `./dev reflect VERB FILE ...`, `python -m reflect_addon.cli`, `blender -b FILE --command reflect VERB ...`.

Exit status: 0 done, 1 the work failed, 2 wrong usage. Progress goes to standard error, results to standard output.
"""

import argparse
import ctypes
import json
import os
import re
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from .core.errors import ReflectError
from .core.spaces import FAR

LARGEST_SIDE = 16384  # px: what graphics cards take
LARGEST_AREA = 1 << 26  # px: 64 million float4 pixels are 1 GiB
LAST_FRAME = 1048574  # Blender's own limit
EXAMPLE = "for example 240x180"


def main(argv: list[str] | None = None) -> int:
    """Runs one verb and returns the exit status; wrong usage exits with 2 as argparse does."""
    arguments = parser().parse_args(sys.argv[1:] if argv is None else list(argv))
    with own_output() as arguments.results, Interruption() as arguments.interruption:
        return _run(arguments)


def _run(arguments) -> int:
    try:
        from . import verbs

        verb = getattr(verbs, {"import": "import_"}.get(arguments.verb, arguments.verb.replace("-", "_")))
        if arguments.verb == "report":  # the one that needs no Blender
            verb(arguments)
            return 0
        verbs.check_blender()
        from .scene.properties import object_properties

        with object_properties():  # else what users set on objects would be lost where the add-on is not on
            verb(arguments)
    except ReflectError as error:
        return _failed(arguments, error.message, error.remedy)
    except KeyboardInterrupt:
        return _failed(arguments, "Cancelled.", "Nothing half-written was left behind.")
    except BrokenPipeError:
        return 1  # the reader of our output has gone
    except Exception as error:  # a bug, or a machine in trouble: one line for the user, the whole story on request
        if arguments.debug:
            traceback.print_exc()
        what = " ".join(str(error).split()) or "no reason given"
        return _failed(arguments, f"{arguments.verb} failed: {type(error).__name__}: {what}.", "Add --debug for details.")
    return 0


def parser() -> argparse.ArgumentParser:
    """One parser for every way in."""
    top = argparse.ArgumentParser(prog="reflect", description="Bake, draw and judge reflections of a .blend.")
    verbs = top.add_subparsers(dest="verb", required=True, metavar="VERB")

    analyse = _verb(verbs, "analyse", "what is shiny in the scene, and which reflections are baked")
    analyse.add_argument("--json", action="store_true", help="machine-readable output")
    analyse.add_argument("--plan", action="store_true", help="which method `auto` would give each reflector, and why")
    _settings(analyse)

    bake = _verb(verbs, "bake", "make the assets of methods")
    bake.add_argument("--methods", required=True, metavar="A,B", help="methods, separated by commas, or all")
    bake.add_argument("--objects", metavar="NAMES", help="only these reflectors, separated by commas")
    bake.add_argument("--object", action="append", default=[], metavar="NAME", help="one more reflector, commas and all")
    bake.add_argument("--out", type=Path, metavar="DIR", help="folder of the assets; default: beside the .blend")
    bake.add_argument("--views", type=Path, help=argparse.SUPPRESS)  # for the window's worker: what its 3D views see
    bake.add_argument("--again", action="store_true", help="bake what is fresh too")
    bake.add_argument("--json-progress", action="store_true", help="progress as JSON lines on standard output")
    _settings(bake)

    render = _verb(verbs, "render", "one picture")
    render.add_argument("--method", required=True, metavar="A")
    render.add_argument("--out", type=_picture, required=True, metavar="PICTURE.png|.exr")
    render.add_argument("--assets", type=Path, metavar="DIR", help="folder of the assets; default: beside the .blend")
    render.add_argument("--background", action="store_true", help="from the method's assets too, not from Cycles (light_field)")
    render.add_argument("--focus", type=_metres, default=0.0, metavar="M", help="sharp this far from the cell's middle (light_field)")
    render.add_argument("--backend", choices=("gpu", "eevee"), default="gpu", help="eevee: as node groups in EEVEE's own frame")
    _view(render, default_samples=16)
    _settings(render, samples=False)

    evaluate = _verb(verbs, "evaluate", "how wrong, how fast, how large: results.json and pictures")
    evaluate.add_argument(
        "--methods", required=True, metavar="A,B|all",
        help="methods, separated by commas, or all; eevee adds EEVEE's own picture of the frame: all,eevee",
    )  # fmt: skip
    evaluate.add_argument("--out", type=Path, required=True, metavar="DIR")
    evaluate.add_argument("--backend", choices=("gpu", "numpy", "eevee"), default="gpu")
    _view(evaluate, default_samples=64)
    _settings(evaluate, samples=False)

    native = _verb(verbs, "native", "a .blend whose materials show baked reflections in EEVEE, without this add-on")
    native.add_argument("--method", metavar="A")
    native.add_argument("--remove", action="store_true", help="give the reflectors their own materials back instead")
    native.add_argument("--assets", type=Path, metavar="DIR", help="folder of the assets; default: beside the .blend")
    native.add_argument("--unpacked", action="store_true", help="images beside the new file, not in it")
    native.add_argument("--out", type=_blend, required=True, metavar="NEW.blend")

    export = _verb(verbs, "export", "the scene and its baked stand-ins as a folder that other programs can show")
    export.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the export; an earlier export there is replaced")
    export.add_argument("--methods", metavar="A,B", help="methods, baked where they are missing or stale; default: all that are baked")
    export.add_argument("--assets", type=Path, metavar="DIR", help="folder of the assets; default: beside the .blend")
    export.add_argument("--size", type=_size, metavar="WxH", help="with pictures of a camera: Cycles' without reflections, the truth, and each method's")
    export.add_argument("--camera", metavar="NAME", help="whose pictures; default: the scene's")
    export.add_argument("--samples", type=_positive, default=64, metavar="N", help="Cycles' paths per pixel of the pictures")
    export.add_argument("--ktx2", action="store_true", help="float images as KTX2 in place of EXR, by KTX-Software's program ktx on PATH")
    export.add_argument("--json-progress", action="store_true", help="progress as JSON lines on standard output")
    _settings(export, samples=False)

    back = verbs.add_parser("import", help="the baked stand-ins of an export, as a bake would have written them")
    back.add_argument("export", type=Path, metavar="DIR", help="folder of the export")
    back.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="folder of the assets: reflect render FILE.blend --assets FOLDER")

    shader = _verb(verbs, "shader", "print the GLSL that a method becomes")
    shader.add_argument("--method", required=True, metavar="A")
    shader.add_argument("--assets", type=Path, metavar="DIR", help="folder of the assets; default: beside the .blend")

    report = verbs.add_parser("report", help="one HTML page from results.json files")
    report.add_argument("folders", nargs="+", type=Path, metavar="DIR")
    report.add_argument("--out", type=Path, required=True, metavar="DIR")

    bench = verbs.add_parser("bench", help="the papers' targets and the numerical stability, measured")
    bench.add_argument("which", choices=("popescu", "yu", "nielsen", "estalella", "planner", "eevee", "eevee-overlay", "eevee-farm", "stability", "all"))
    bench.add_argument("--out", type=Path, required=True, metavar="DIR")
    bench.add_argument("--only", default="", metavar="SCENES", help="of planner and eevee, which take hours, these scenes, separated by commas")

    # Without help text: for evaluate alone, which calls it on a copy of the file.
    draw = verbs.add_parser("draw-eevee", description="Draw a job of evaluate's with EEVEE.")
    draw.add_argument("file", nargs="?", type=Path, metavar="COPY.blend")
    draw.add_argument("--job", type=Path, required=True, metavar="JOB.json")
    draw.add_argument("--out", type=Path, required=True, metavar="DIR")
    draw.set_defaults(json_progress=True)

    # As well: for a window, which compares the view of another process with its own.
    view = verbs.add_parser("trace-view", description="Trace the mirror rays of a window's view.")
    view.add_argument("file", nargs="?", type=Path, metavar="COPY.blend")
    view.add_argument("--scene", metavar="NAME")
    view.add_argument("--view", type=Path, required=True, metavar="VIEW.json")
    view.add_argument("--out", type=Path, required=True, metavar="FILE.npy")
    view.set_defaults(json_progress=True)

    for verb in verbs.choices.values():
        verb.add_argument("--debug", action="store_true", help="show where an unexpected error came from")
    return top


def _verb(verbs, name: str, text: str) -> argparse.ArgumentParser:
    verb = verbs.add_parser(name, help=text, description=text.capitalize() + ".")
    verb.add_argument("file", nargs="?", type=Path, metavar="FILE.blend", help="may be left out when a file is open")
    verb.add_argument("--scene", metavar="NAME", help="default: the file's active scene")
    return verb


def _view(verb, default_samples: int) -> None:
    verb.add_argument("--size", type=_size, required=True, metavar="WxH")
    verb.add_argument("--camera", metavar="NAME", help="default: the scene's")
    verb.add_argument("--frame", type=_frame, metavar="N", help="default: the file's current frame")
    verb.add_argument("--samples", type=_positive, default=default_samples, metavar="N", help="paths per pixel, of Cycles (of EEVEE: render --backend eevee)")


def _settings(verb, samples: bool = True) -> None:
    verb.add_argument("--resolution", type=_resolution, metavar="N", help="of the baked images, texels")
    verb.add_argument("--set", type=_setting, action="append", default=[], metavar="NAME=VALUE", help="a method's setting")
    if samples:
        verb.add_argument("--samples", type=_positive, metavar="N", help="Cycles' paths per texel")


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,9})x(\d{1,9})", text.strip().lower())
    if not match:
        raise argparse.ArgumentTypeError(f"'{text}' is not a size; write WIDTHxHEIGHT, {EXAMPLE}")
    width, height = int(match[1]), int(match[2])
    if not (1 <= width <= LARGEST_SIDE and 1 <= height <= LARGEST_SIDE and width * height <= LARGEST_AREA):
        raise argparse.ArgumentTypeError(
            f"{width}x{height} is not possible; sides are 1 to {LARGEST_SIDE} and at most {LARGEST_AREA:,} pixels, {EXAMPLE}"
        )
    return width, height


def _frame(text: str) -> int:
    if not re.fullmatch(r"-?\d{1,7}", text) or abs(int(text)) > LAST_FRAME:
        raise argparse.ArgumentTypeError(f"'{text}' is not a frame; Blender's go from -{LAST_FRAME} to {LAST_FRAME}")
    return int(text)


def _positive(text: str) -> int:
    if not re.fullmatch(r"\d{1,6}", text) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 1 to 999999")
    return int(text)


def _metres(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value < FAR:
        raise argparse.ArgumentTypeError(f"'{text}' is not a distance in metres, 0 or more")
    return value


def _resolution(text: str) -> int:
    value = _positive(text)
    if value & (value - 1) or not 4 <= value <= 8192:
        raise argparse.ArgumentTypeError(f"'{text}' is not a power of two from 4 to 8192")
    return value


def _setting(text: str) -> tuple[str, object]:
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise argparse.ArgumentTypeError(f"'{text}' is not NAME=VALUE")
    try:
        given = json.loads(value)
    except ValueError:
        return name, value  # a word
    return name, tuple(given) if isinstance(given, list) else given


def _picture(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in {".png", ".exr"}:
        raise argparse.ArgumentTypeError(f"'{text}' must end in .png or .exr")
    return path


def _blend(text: str) -> Path:
    if Path(text).suffix.lower() != ".blend":
        raise argparse.ArgumentTypeError(f"'{text}' must end in .blend")
    return Path(text)


class Interruption:
    """For the length of a block Ctrl-C, SIGTERM and a closed terminal only set `came`: raised inside Blender's render, a
    KeyboardInterrupt would be printed and lost. Progress reports answer False then, which ends the work in order. The
    second one ends it where it is."""

    def __init__(self):
        self.came = False
        self._before: dict[int, object] = {}

    def __enter__(self) -> "Interruption":
        if threading.current_thread() is threading.main_thread():
            for name in ("SIGINT", "SIGTERM", "SIGHUP"):
                if number := getattr(signal, name, None):
                    self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *_exception) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler or signal.SIG_DFL)

    def _note(self, _number, _frame) -> None:
        if self.came:
            raise KeyboardInterrupt
        self.came = True


@contextmanager
def own_output() -> Iterator[TextIO]:
    """Yields standard output for results. For the length of the block all else that is written there goes to standard
    error: what Blender prints of files it reads and saves, and what its operators report through Python's print."""
    sys.stdout.flush()
    _flush_c()
    kept, before = os.dup(1), sys.stdout
    results = os.fdopen(kept, "w", encoding="utf-8", errors="backslashreplace")
    sys.stdout = sys.stderr
    os.dup2(2, 1)
    try:
        yield results
    finally:
        _flush_c()  # what Blender printed is still in C's buffer when standard output is a pipe
        os.dup2(kept, 1)
        sys.stdout = before
        try:
            results.close()
        except BrokenPipeError:
            pass  # nobody reads the rest


def _flush_c() -> None:
    ctypes.CDLL("ucrtbase" if os.name == "nt" else None).fflush(None)


def _failed(arguments, message: str, remedy: str) -> int:
    if getattr(arguments, "json_progress", False):
        print(json.dumps({"error": message, "remedy": remedy}), file=arguments.results, flush=True)
    print(f"reflect: {message} {remedy}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
