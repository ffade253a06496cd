"""What each verb of the command line does: open the file, call one function, print what came of it."""

import json
import os
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from . import unsuitable
from .core import methods as registry
from .core.camera import Camera
from .core.errors import ReflectError
from .core.safe_write import check_folder, check_writable, write_whole


def analyse(arguments) -> None:
    from .evaluation.analyse import analyse_scene, as_text

    settings = _given(arguments, (registry.AUTO,))
    found = analyse_scene(_scene(arguments), settings, arguments.plan)
    _print(arguments, json.dumps(found, indent=1) if arguments.json else as_text(found))


def bake(arguments) -> None:
    from .evaluation.frame import open_frame
    from .scene.auto import bake_auto
    from .scene.bake import bake_assets
    from .scene.places import assets_of
    from .scene.raytrace import trace

    wanted = _methods(arguments.methods)
    named = tuple(name for name in wanted if name != registry.AUTO)
    settings = _given(arguments, wanted)
    scene = _scene(arguments)
    folder = arguments.out or assets_of(scene)
    names = [n for n in (arguments.objects or "").split(",") if n] + arguments.object
    say = (_json_progress if arguments.json_progress else _progress)(arguments)
    check_folder(folder)
    with open_frame(scene, None, say) as snapshot:
        paths, more = [], {"reflectors": names, "settings": settings, "progress": say, "again": arguments.again}
        if named:
            paths += bake_assets(snapshot, named, folder, tracer=partial(trace, scene=scene), **more)
        if named != wanted:
            views = [Camera.of(view) for view in json.loads(arguments.views.read_text())] if arguments.views else []
            paths += bake_auto(scene, snapshot, folder, views=views, **more)
    if arguments.json_progress:
        _print(arguments, json.dumps({"done": [str(p) for p in paths]}))
    else:
        _print(arguments, "\n".join(map(str, paths)))


def render(arguments) -> None:
    from .evaluation.render import render_picture

    _methods(arguments.method)
    settings = _given(arguments, (arguments.method,))
    check_writable(arguments.out)
    render_picture(
        _scene(arguments), arguments.method, arguments.size, arguments.out, camera=arguments.camera,
        frame=arguments.frame, samples=arguments.samples, assets=arguments.assets, settings=settings,
        background=arguments.background, focus=arguments.focus, backend=arguments.backend, progress=_progress(arguments),
    )  # fmt: skip
    _print(arguments, arguments.out)


def native(arguments) -> None:
    from .evaluation.native_file import write_native, write_without
    from .scene.places import assets_of

    check_writable(arguments.out)
    if arguments.remove:
        done = write_without(_scene(arguments), arguments.out)
    elif arguments.method:
        _methods(arguments.method)
        scene = _scene(arguments)
        folder = arguments.assets or assets_of(scene)
        done = write_native(
            scene, arguments.method, folder, arguments.out, pack=not arguments.unpacked, progress=_progress(arguments)
        )
    else:
        raise ReflectError("No method was named.", f"Add --method, one of {', '.join(registry.gathering())}, or --remove.")
    for sentence in done.sentences:
        _warn(sentence)
    _print(arguments, f"{arguments.out}: {done.counts()}")


def export(arguments) -> None:
    from .evaluation.export_file import Shot, write_export

    wanted = _methods(arguments.methods) if arguments.methods else ()
    settings = _given(arguments, wanted or (registry.AUTO,))
    if arguments.camera and not arguments.size:
        raise ReflectError("A camera was named, but no size of its pictures.", "Add --size, for example --size 640x480.")
    if settings and not wanted:
        raise ReflectError("Settings of a bake were given, but no methods.", "Name them with --methods, or leave --set and --resolution out.")
    shot = Shot(arguments.size, arguments.camera, arguments.samples) if arguments.size else None
    say = (_json_progress if arguments.json_progress else _progress)(arguments)
    said = write_export(
        _scene(arguments), wanted, arguments.out, shot=shot, assets=arguments.assets, settings=settings, ktx2=arguments.ktx2, progress=say
    )  # fmt: skip
    for sentence in said:
        _warn(sentence)
    _print(arguments, json.dumps({"done": [str(arguments.out)], "said": said}) if arguments.json_progress else arguments.out)


def import_(arguments) -> None:
    from .core.exchange.reading import read_export
    from .scene.import_assets import import_assets

    check_folder(arguments.out)
    for path in import_assets(read_export(arguments.export), arguments.out, _progress(arguments)):
        _print(arguments, path)


def evaluate(arguments) -> None:
    from .evaluation.evaluate import evaluate as run

    wanted = _methods(arguments.methods, peers=(EEVEE,))
    settings = _given(arguments, wanted)
    check_folder(arguments.out)
    run(
        _scene(arguments), wanted, arguments.size, arguments.out, camera=arguments.camera, frame=arguments.frame,
        samples=arguments.samples, backend=arguments.backend, settings=settings, progress=_progress(arguments),
    )  # fmt: skip
    _print(arguments, arguments.out / "results.json")


def shader(arguments) -> None:
    from .core.kernel import emit_glsl, record
    from .evaluation.frame import open_frame
    from .scene.load import load_assets
    from .scene.places import assets_of

    _methods(arguments.method)
    scene = _scene(arguments)
    folder = arguments.assets or assets_of(scene)
    with open_frame(scene, None, _progress(arguments)) as snapshot:
        found = load_assets(snapshot, arguments.method, folder)
    if not found:
        raise ReflectError(
            f"No asset of {arguments.method} was found in {folder}.",
            f"Make one with: reflect bake FILE.blend --methods {arguments.method}.",
        )
    wanted = ("radiance", "coverage", "position", "status")
    sources: dict[str, list[str]] = {}
    for name, asset in found.items():
        kernel = emit_glsl(record(registry.get(asset.kind).trace, asset), wanted, "answer", push_bytes=0)
        sources.setdefault(kernel.typedef + "\n" + kernel.source, []).append(name)
    for source, names in sources.items():
        _print(arguments, f"// {arguments.method} of {' '.join(', '.join(names).split())}\n{source}")


def draw_eevee(arguments) -> None:
    """EEVEE's pictures of a job (scene/eevee_job.py); the file is a copy that is changed and never saved."""
    from .gpu.device import describe
    from .scene import eevee_draw
    from .scene.eevee_job import Job

    open_blend(arguments.file)
    job = Job.from_plain(json.loads(arguments.job.read_text()))
    said = eevee_draw.render(job, arguments.out, _json_progress(arguments))
    found = describe()
    said["device"] = f"{found['renderer']} ({found['device']})"
    write_whole(arguments.out / "said.json", json.dumps(said).encode())
    _print(arguments, json.dumps({"done": [str(arguments.out)]}))


def trace_view(arguments) -> None:
    """The truth of a window's view (scene/view_truth.py)."""
    from .evaluation.frame import open_frame
    from .scene import view_truth
    from .scene.raytrace import trace

    scene, camera = _scene(arguments), Camera.of(json.loads(arguments.view.read_text()))
    with open_frame(scene, None) as snapshot:
        picture = view_truth.trace_view(snapshot, camera, view_truth.SAMPLES, partial(trace, scene=scene), _json_progress(arguments))
    view_truth.write_picture(arguments.out, picture)
    _print(arguments, json.dumps({"done": [str(arguments.out)]}))


def report(arguments) -> None:
    from .evaluation.report import report as write

    check_folder(arguments.out)
    _print(arguments, write(arguments.folders, arguments.out))


def bench(arguments) -> None:
    from .evaluation.bench import bench as measure
    from .evaluation.bench_table import text

    check_folder(arguments.out)
    for path in measure(arguments.which, arguments.out, _progress(arguments), tuple(filter(None, arguments.only.split(",")))):
        _print(arguments, text(path))
        _print(arguments, path)


def check_blender() -> None:
    """ReflectError when this is no Blender of a version that Reflect works in."""
    try:
        import bpy
    except ImportError as error:
        raise ReflectError(
            f"This Python has no Blender in it ({error}).",
            "Use ./dev reflect ..., which sets it up, or blender -b FILE.blend --command reflect ...",
        ) from error
    if reason := unsuitable(bpy.app):
        raise ReflectError(reason, "Update Blender.")


def open_blend(path: Path | None):
    """Opens the file unless it is open already. ReflectError when it is missing, no .blend, damaged or too new."""
    import bpy

    if path is None:
        if not bpy.data.filepath and bpy.app.module:
            raise ReflectError("No file was named.", "Put the .blend after the verb: reflect analyse FILE.blend.")
        return bpy
    if not os.path.isfile(path):
        raise ReflectError(f"There is no file {path}.", "Check the path; it should name a .blend.")
    try:
        with path.open("rb") as file:
            start = file.read(12)
    except OSError as error:
        raise ReflectError(f"{path} cannot be read ({error.strerror or error}).", "Check its permissions.") from error
    if len(start) < 12:
        raise ReflectError(f"{path} is empty or cut short.", "Restore it from a backup (.blend1).")
    # Plain, gzip (to 2.93) and zstd (since 3.0).
    if not (start.startswith(b"BLENDER") or start[:2] == b"\x1f\x8b" or start[:4] == b"\x28\xb5\x2f\xfd"):
        raise ReflectError(f"{path} is not a .blend file.", "Name a file that Blender saved.")
    if not (bpy.data.filepath and os.path.samefile(bpy.data.filepath, path)):
        try:
            bpy.ops.wm.open_mainfile(filepath=str(path.absolute()), load_ui=False, use_scripts=False)
        except RuntimeError as error:
            reason = str(error).strip().removeprefix("Error: ").splitlines()[0]
            raise ReflectError(
                f"{path} could not be opened: {reason}", "Save it again with Blender 5.2, or restore a backup (.blend1)."
            ) from error
    for library in bpy.data.libraries:
        if library.is_missing:
            where = bpy.path.abspath(library.filepath)
            _warn(f"The library {where} is missing, and with it what is linked from there. Put it back, or relocate it.")
    if tuple(bpy.data.version) > bpy.app.version[:2] + (9999,):
        _warn(f"{path} was saved by a newer Blender ({bpy.data.version[0]}.{bpy.data.version[1]}); parts of it may be lost.")
    return bpy


def _warn(sentence: str) -> None:
    print(f"reflect: Warning: {sentence}", file=sys.stderr, flush=True)


def _scene(arguments):
    bpy = open_blend(arguments.file)
    if arguments.scene is None:
        return bpy.context.scene
    scene = bpy.data.scenes.get(arguments.scene)
    if scene is None:
        there = ", ".join(s.name for s in bpy.data.scenes)
        raise ReflectError(f"There is no scene named '{arguments.scene}' in the file.", f"Choose among: {there}.")
    if bpy.context.window is not None:
        bpy.context.window.scene = scene
    return scene


EEVEE = "eevee"  # evaluation/peer.py; named here so that reading a command loads no evaluation


def _methods(text: str, peers: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Names of methods in a list, each once; `all` stands for every method, but for no peer."""
    names = []
    for name in (n.strip() for n in text.split(",") if n.strip()):
        names += registry.names() if name == "all" else [name]
    if not names:
        raise ReflectError("No method was named.", f"Choose among: {', '.join(registry.names())}.")
    for name in names:
        if name == EEVEE and name not in peers:
            raise ReflectError(
                "eevee is EEVEE's own picture, to compare methods with: only evaluate makes it, and there is nothing to bake.",
                f"Choose among: {', '.join(registry.names())}.",
            )
        if name not in peers:
            registry.get(name)
    return tuple(dict.fromkeys(names))


def _given(arguments, wanted: tuple[str, ...]) -> dict[str, object]:
    """Settings of the bake that were asked for, checked; `evaluate --samples` are the truth's and not among them."""
    given = dict(arguments.set)
    if arguments.resolution:
        given["resolution"] = arguments.resolution
    if arguments.verb in ("analyse", "bake") and arguments.samples:
        given["samples"] = arguments.samples
    registry.check_settings(tuple(n for n in wanted if n != EEVEE), dict(arguments.set))
    return given


def _progress(arguments) -> Callable[[float, str], bool]:
    """Progress as lines on standard error, each once: who waits for something repeats itself. False asks the work to end:
    see cli.Interruption."""
    last = ""

    def say(share: float, text: str) -> bool:
        nonlocal last
        line = f"reflect: {share * 100:3.0f} % {text}"
        if line != last:
            print(line, file=sys.stderr, flush=True)
        last = line
        return not arguments.interruption.came

    return say


def _json_progress(arguments) -> Callable[[float, str], bool]:
    """The same as JSON on standard output, for the process that started this one."""

    def say(share: float, text: str) -> bool:
        _print(arguments, json.dumps({"progress": round(share, 4), "message": text}))
        return not arguments.interruption.came

    return say


def _print(arguments, result) -> None:
    """To standard output, which cli.py keeps free of everything else."""
    print(result, file=arguments.results, flush=True)
