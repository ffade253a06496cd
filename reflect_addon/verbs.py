"""What each verb of the command line does: open the file, call one function, print what came of it."""

import json
from functools import partial

from .asked import EEVEE, answer, json_progress, methods_of, progress, settings_of
from .core import methods as registry
from .core.camera import Camera
from .core.errors import ReflectError
from .core.safe_write import check_folder, check_writable, write_whole
from .opened import open_blend, scene_of, warn


def analyse(arguments) -> None:
    from .evaluation.analyse import analyse_scene, as_text

    settings = settings_of(arguments, (registry.AUTO,))
    found = analyse_scene(scene_of(arguments), settings, arguments.plan)
    answer(arguments, json.dumps(found, indent=1) if arguments.json else as_text(found))


def bake(arguments) -> None:
    from .evaluation.frame import open_frame
    from .scene.auto import bake_auto
    from .scene.bake import bake_assets
    from .scene.bake_part import bake_part
    from .scene.places import assets_of
    from .scene.raytrace import trace

    wanted = methods_of(arguments.methods)
    named = tuple(name for name in wanted if name != registry.AUTO)
    settings = settings_of(arguments, wanted)
    scene = scene_of(arguments)
    if arguments.part and not arguments.out:
        raise ReflectError("A part of a bake has a folder of its own.", "Name it with --out DIR; merge puts the parts together.")
    folder = arguments.out or assets_of(scene)
    names = [n for n in (arguments.objects or "").split(",") if n] + arguments.object
    say = (json_progress if arguments.json_progress else progress)(arguments)
    check_folder(folder)
    with open_frame(scene, None, say) as snapshot:
        paths, more = [], {"reflectors": names, "settings": settings, "progress": say, "again": arguments.again}
        if arguments.part:
            paths += bake_part(scene, snapshot, wanted, folder, arguments.part, **more)
        elif named:
            paths += bake_assets(snapshot, named, folder, tracer=partial(trace, scene=scene), **more)
        if named != wanted and not arguments.part:
            views = [Camera.of(view) for view in json.loads(arguments.views.read_text())] if arguments.views else []
            paths += bake_auto(scene, snapshot, folder, views=views, **more)
    if arguments.json_progress:
        answer(arguments, json.dumps({"done": [str(p) for p in paths]}))
    else:
        answer(arguments, "\n".join(map(str, paths)))


def render(arguments) -> None:
    from .evaluation.render import render_picture

    methods_of(arguments.method)
    settings = settings_of(arguments, (arguments.method,))
    check_writable(arguments.out)
    render_picture(
        scene_of(arguments), arguments.method, arguments.size, arguments.out, camera=arguments.camera,
        frame=arguments.frame, samples=arguments.samples, assets=arguments.assets, settings=settings,
        background=arguments.background, focus=arguments.focus, backend=arguments.backend, progress=progress(arguments),
    )  # fmt: skip
    answer(arguments, arguments.out)


def native(arguments) -> None:
    from .evaluation.native_file import write_native, write_without
    from .scene.places import assets_of

    check_writable(arguments.out)
    if arguments.remove:
        done = write_without(scene_of(arguments), arguments.out)
    elif arguments.method:
        methods_of(arguments.method)
        scene = scene_of(arguments)
        folder = arguments.assets or assets_of(scene)
        done = write_native(
            scene, arguments.method, folder, arguments.out, pack=not arguments.unpacked, progress=progress(arguments)
        )
    else:
        raise ReflectError("No method was named.", f"Add --method, one of {', '.join(registry.gathering())}, or --remove.")
    for sentence in done.sentences:
        warn(sentence)
    answer(arguments, f"{arguments.out}: {done.counts()}")


def export(arguments) -> None:
    from .evaluation.export_file import Shot, write_export

    wanted = methods_of(arguments.methods) if arguments.methods else ()
    settings = settings_of(arguments, wanted or (registry.AUTO,))
    if arguments.camera and not arguments.size:
        raise ReflectError("A camera was named, but no size of its pictures.", "Add --size, for example --size 640x480.")
    if settings and not wanted:
        raise ReflectError("Settings of a bake were given, but no methods.", "Name them with --methods, or leave --set and --resolution out.")
    shot = Shot(arguments.size, arguments.camera, arguments.samples) if arguments.size else None
    say = (json_progress if arguments.json_progress else progress)(arguments)
    said = write_export(
        scene_of(arguments), wanted, arguments.out, shot=shot, assets=arguments.assets, settings=settings, ktx2=arguments.ktx2, progress=say
    )  # fmt: skip
    for sentence in said:
        warn(sentence)
    answer(arguments, json.dumps({"done": [str(arguments.out)], "said": said}) if arguments.json_progress else arguments.out)


def import_(arguments) -> None:
    from .core.exchange.reading import read_export
    from .scene.import_assets import import_assets

    check_folder(arguments.out)
    for path in import_assets(read_export(arguments.export), arguments.out, progress(arguments)):
        answer(arguments, path)


def evaluate(arguments) -> None:
    from .evaluation.evaluate import evaluate as run
    from .evaluation.evaluate_part import evaluate_part

    wanted = methods_of(arguments.methods, peers=(EEVEE,))
    settings = settings_of(arguments, wanted)
    if arguments.assets and settings:
        raise ReflectError("Settings of a bake were given, and assets that are baked already.", "Leave --set and --resolution out, or --assets.")
    if arguments.part and not arguments.assets:
        raise ReflectError("A part of an evaluation bakes nothing.", "Name baked assets with --assets DIR: bake first, in parts or whole.")
    check_folder(arguments.out)
    (partial(evaluate_part, part=arguments.part) if arguments.part else partial(run, settings=settings))(
        scene_of(arguments), wanted, arguments.size, arguments.out, camera=arguments.camera, frame=arguments.frame,
        samples=arguments.samples, backend=arguments.backend, assets=arguments.assets, progress=progress(arguments),
    )  # fmt: skip
    answer(arguments, arguments.out / ("part.json" if arguments.part else "results.json"))


def merge(arguments) -> None:
    from .evaluation.merge import merge as put_together

    answer(arguments, "\n".join(map(str, put_together(arguments.parts, arguments.out))))


def shader(arguments) -> None:
    from .core.kernel import emit_glsl, record
    from .evaluation.frame import open_frame
    from .scene.load import load_assets
    from .scene.places import assets_of

    methods_of(arguments.method)
    scene = scene_of(arguments)
    folder = arguments.assets or assets_of(scene)
    with open_frame(scene, None, progress(arguments)) as snapshot:
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
        answer(arguments, f"// {arguments.method} of {' '.join(', '.join(names).split())}\n{source}")


def draw_eevee(arguments) -> None:
    """EEVEE's pictures of a job (scene/eevee_job.py); the file is a copy that is changed and never saved."""
    from .gpu.device import describe
    from .scene import eevee_draw
    from .scene.eevee_job import Job

    open_blend(arguments.file)
    job = Job.from_plain(json.loads(arguments.job.read_text()))
    said = eevee_draw.render(job, arguments.out, json_progress(arguments))
    found = describe()
    said["device"] = f"{found['renderer']} ({found['device']})"
    write_whole(arguments.out / "said.json", json.dumps(said).encode())
    answer(arguments, json.dumps({"done": [str(arguments.out)]}))


def trace_view(arguments) -> None:
    """The truth of a window's view (scene/view_truth.py)."""
    from .evaluation.frame import open_frame
    from .scene import view_truth
    from .scene.raytrace import trace

    scene, camera = scene_of(arguments), Camera.of(json.loads(arguments.view.read_text()))
    with open_frame(scene, None) as snapshot:
        picture = view_truth.trace_view(snapshot, camera, view_truth.SAMPLES, partial(trace, scene=scene), json_progress(arguments))
    view_truth.write_picture(arguments.out, picture)
    answer(arguments, json.dumps({"done": [str(arguments.out)]}))


def report(arguments) -> None:
    from .evaluation.report import report as write

    check_folder(arguments.out)
    answer(arguments, write(arguments.folders, arguments.out))


def bench(arguments) -> None:
    from .evaluation.bench import bench as measure
    from .evaluation.bench_table import text

    check_folder(arguments.out)
    for path in measure(arguments.which, arguments.out, progress(arguments), tuple(filter(None, arguments.only.split(",")))):
        answer(arguments, text(path))
        answer(arguments, path)
