"""What each verb of the command line does: open the file, call one function, print what came of it."""

import json
import os
import sys
from functools import partial
from pathlib import Path

from .core import methods as registry
from .core.errors import ReflectError
from .core.safe_write import write_whole


def analyse(arguments) -> None:
    from .evaluation.analyse import analyse_scene, as_text

    found = analyse_scene(_scene(arguments))
    print(json.dumps(found, indent=1) if arguments.json else as_text(found))


def bake(arguments) -> None:
    from .evaluation.frame import open_frame
    from .scene.bake import bake_assets
    from .scene.places import assets_of
    from .scene.raytrace import trace

    wanted = _methods(arguments.methods)
    scene = _scene(arguments)
    folder = arguments.out or assets_of(scene)
    names = [n for n in (arguments.objects or "").split(",") if n]
    say = _json_progress if arguments.json_progress else _progress
    _check_writable(folder)
    with open_frame(scene, None) as snapshot:
        paths = bake_assets(
            snapshot, wanted, folder, reflectors=names, settings=_given(arguments), tracer=partial(trace, scene=scene),
            progress=say, again=arguments.again,
        )  # fmt: skip
    if arguments.json_progress:
        print(json.dumps({"done": [str(p) for p in paths]}), flush=True)
    else:
        print("\n".join(map(str, paths)))


def render(arguments) -> None:
    from .evaluation.render import render_picture

    _methods(arguments.method)
    _check_writable(arguments.out.parent)
    render_picture(
        _scene(arguments), arguments.method, arguments.size, arguments.out, camera=arguments.camera,
        frame=arguments.frame, samples=arguments.samples, assets=arguments.assets, settings=_given(arguments),
        progress=_progress,
    )  # fmt: skip
    print(arguments.out)


def evaluate(arguments) -> None:
    from .evaluation.evaluate import evaluate as run

    if arguments.backend == "eevee":
        raise ReflectError(
            "Methods cannot be evaluated as EEVEE nodes yet.",
            "Use --backend gpu or --backend numpy. EEVEE's own picture is asked for with --methods all,eevee.",
        )
    wanted = _methods(arguments.methods, peers=(EEVEE,))
    _check_writable(arguments.out)
    run(
        _scene(arguments), wanted, arguments.size, arguments.out, camera=arguments.camera, frame=arguments.frame,
        samples=arguments.samples, backend=arguments.backend, settings=_given(arguments), progress=_progress,
    )  # fmt: skip
    print(arguments.out / "results.json")


def shader(arguments) -> None:
    from .core.kernel import emit_glsl, record
    from .evaluation.frame import open_frame
    from .scene.bake import load_assets
    from .scene.places import assets_of

    _methods(arguments.method)
    scene = _scene(arguments)
    folder = arguments.assets or assets_of(scene)
    with open_frame(scene, None) as snapshot:
        found = load_assets(snapshot, arguments.method, folder)
    if not found:
        raise ReflectError(
            f"No asset of {arguments.method} was found in {folder}.",
            f"Make one with: reflect bake FILE.blend --methods {arguments.method}.",
        )
    wanted = ("radiance", "coverage", "position", "status")
    sources: dict[str, list[str]] = {}
    for name, asset in found.items():
        kernel = emit_glsl(record(registry.get(arguments.method).trace, asset), wanted, "answer", push_bytes=0)
        sources.setdefault(kernel.typedef + "\n" + kernel.source, []).append(name)
    for source, names in sources.items():
        print(f"// {arguments.method} of {', '.join(names)}\n{source}")


def draw_eevee(arguments) -> None:
    """EEVEE's pictures of a job of evaluation/peer.py; the file is a copy that is changed and never saved."""
    from .gpu.device import describe
    from .scene import peer_render

    open_blend(arguments.file)
    job = peer_render.Job.from_plain(json.loads(arguments.job.read_text()))
    said = peer_render.render(job, arguments.out, _json_progress)
    found = describe()
    said["device"] = f"{found['renderer']} ({found['device']})"
    write_whole(arguments.out / "said.json", json.dumps(said).encode())
    print(json.dumps({"done": [str(arguments.out)]}), flush=True)


def report(arguments) -> None:
    from .evaluation.report import report as write

    _check_writable(arguments.out)
    print(write(arguments.folders, arguments.out))


def bench(arguments) -> None:
    from .evaluation.bench import bench as measure

    _check_writable(arguments.out)
    print(measure(arguments.which, arguments.out, _progress))


def open_blend(path: Path | None):
    """Opens the file unless it is open already. ReflectError when it is missing, no .blend, damaged or too new."""
    import bpy

    if path is None:
        if not bpy.data.filepath and bpy.app.module:
            raise ReflectError("No file was named.", "Put the .blend after the verb: reflect analyse FILE.blend.")
        return bpy
    if not path.is_file():
        raise ReflectError(f"There is no file {path}.", "Check the path; it should name a .blend.")
    if path.stat().st_size < 12:
        raise ReflectError(f"{path} is empty or cut short.", "Restore it from a backup (.blend1).")
    with path.open("rb") as file:
        start = file.read(7)
    # Plain, gzip (to 2.93) and zstd (since 3.0).
    if not (start == b"BLENDER" or start[:2] == b"\x1f\x8b" or start[:4] == b"\x28\xb5\x2f\xfd"):
        raise ReflectError(f"{path} is not a .blend file.", "Name a file that Blender saved.")
    if bpy.data.filepath and os.path.samefile(bpy.data.filepath, path):
        return bpy
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.absolute()), load_ui=False, use_scripts=False)
    except RuntimeError as error:
        reason = str(error).strip().removeprefix("Error: ").splitlines()[0]
        raise ReflectError(
            f"{path} could not be opened: {reason}", "Save it again with Blender 5.2, or restore a backup (.blend1)."
        ) from error
    if tuple(bpy.data.version) > bpy.app.version[:2] + (9999,):
        print(f"reflect: {path} was saved by a newer Blender ({bpy.data.version[:2]}).", file=sys.stderr)
    return bpy


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


def _given(arguments) -> dict[str, object]:
    """Settings of the bake that were asked for; `evaluate --samples` are the truth's and not among them."""
    given = dict(arguments.set)
    if arguments.resolution:
        given["resolution"] = arguments.resolution
    if arguments.verb == "bake" and arguments.samples:
        given["samples"] = arguments.samples
    return given


def _check_writable(folder: Path) -> None:
    """Before minutes of work: can the result be written there at all?"""
    probe = Path(folder) / ".reflect-probe"
    write_whole(probe, b"")
    probe.unlink()


_said = ""


def _progress(share: float, text: str) -> None:
    """One line on standard error; who waits for something repeats itself, and is printed once."""
    global _said
    line = f"reflect: {share * 100:3.0f} % {text}"
    if line != _said:
        print(line, file=sys.stderr, flush=True)
    _said = line


def _json_progress(share: float, text: str) -> None:
    print(json.dumps({"progress": round(share, 4), "message": text}), flush=True)
