"""The command line: `./dev reflect VERB FILE ...`, `python -m reflect_addon.cli`, `blender -b FILE --command reflect VERB ...`.

Exit status: 0 done, 1 the work failed, 2 wrong usage. Progress goes to standard error, results to standard output.
"""

import argparse
import ctypes
import json
import os
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from . import cli_values as values
from . import opened
from .core.errors import ReflectError


def main(argv: list[str] | None = None) -> int:
    """Runs one verb and returns the exit status; wrong usage exits with 2 as argparse does."""
    arguments = parser().parse_args(sys.argv[1:] if argv is None else list(argv))
    with own_output() as arguments.results, Interruption() as arguments.interruption:
        return _run(arguments)


def _run(arguments) -> int:
    try:
        from . import verbs

        verb = getattr(verbs, {"import": "import_"}.get(arguments.verb, arguments.verb.replace("-", "_")))
        if arguments.verb in ("report", "merge"):  # those that need no Blender
            verb(arguments)
            return 0
        opened.check_blender()
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
    bake.add_argument("--part", type=values.part, metavar="I/N", help="the I-th of N parts alone, into a folder of its own; merge puts them together")
    bake.add_argument("--again", action="store_true", help="bake what is fresh too")
    bake.add_argument("--json-progress", action="store_true", help="progress as JSON lines on standard output")
    _settings(bake)

    render = _verb(verbs, "render", "one picture")
    render.add_argument("--method", required=True, metavar="A")
    render.add_argument("--out", type=values.picture, required=True, metavar="PICTURE.png|.exr")
    render.add_argument("--assets", type=Path, metavar="DIR", help="folder of the assets; default: beside the .blend")
    render.add_argument("--background", action="store_true", help="from the method's assets too, not from Cycles (light_field)")
    render.add_argument("--focus", type=values.metres, default=0.0, metavar="M", help="sharp this far from the cell's middle (light_field)")
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
    evaluate.add_argument("--assets", type=Path, metavar="DIR", help="folder of the assets, none of which is baked then; default: beside the .blend")
    evaluate.add_argument("--part", type=values.part, metavar="I/N", help="the I-th of N parts alone, from --assets; merge puts them together")
    _view(evaluate, default_samples=64)
    _settings(evaluate, samples=False)

    merge = verbs.add_parser("merge", help="the parts of a bake or an evaluation put together: what one process would have made")
    merge.add_argument("parts", nargs="+", type=Path, metavar="DIR", help="folders of all parts, in any order")
    merge.add_argument("--out", type=Path, required=True, metavar="DIR")

    native = _verb(verbs, "native", "a .blend whose materials show baked reflections in EEVEE, without this add-on")
    native.add_argument("--method", metavar="A")
    native.add_argument("--remove", action="store_true", help="give the reflectors their own materials back instead")
    native.add_argument("--assets", type=Path, metavar="DIR", help="folder of the assets; default: beside the .blend")
    native.add_argument("--unpacked", action="store_true", help="images beside the new file, not in it")
    native.add_argument("--out", type=values.blend, required=True, metavar="NEW.blend")

    export = _verb(verbs, "export", "the scene and its baked stand-ins as a folder that other programs can show")
    export.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the export; an earlier export there is replaced")
    export.add_argument("--methods", metavar="A,B", help="methods, baked where they are missing or stale; default: all that are baked")
    export.add_argument("--assets", type=Path, metavar="DIR", help="folder of the assets; default: beside the .blend")
    export.add_argument("--size", type=values.size, metavar="WxH", help="with pictures of a camera: Cycles' without reflections, the truth, and each method's")
    export.add_argument("--camera", metavar="NAME", help="whose pictures; default: the scene's")
    export.add_argument("--samples", type=values.positive, default=64, metavar="N", help="Cycles' paths per pixel of the pictures")
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
    verb.add_argument("--size", type=values.size, required=True, metavar="WxH")
    verb.add_argument("--camera", metavar="NAME", help="default: the scene's")
    verb.add_argument("--frame", type=values.frame, metavar="N", help="default: the file's current frame")
    verb.add_argument("--samples", type=values.positive, default=default_samples, metavar="N", help="paths per pixel, of Cycles (of EEVEE: render --backend eevee)")


def _settings(verb, samples: bool = True) -> None:
    verb.add_argument("--resolution", type=values.resolution, metavar="N", help="of the baked images, texels")
    verb.add_argument("--set", type=values.setting, action="append", default=[], metavar="NAME=VALUE", help="a method's setting")
    if samples:
        verb.add_argument("--samples", type=values.positive, metavar="N", help="Cycles' paths per texel")


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
