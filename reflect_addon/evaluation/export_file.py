"""An export from the command line: the scene, its baked stand-ins and, where a size is given, what Cycles and `render` show of a camera.

What is named is baked where it is missing or stale, as `render` bakes; without names all that lies there is taken as it is. Methods that draw in every frame
cannot leave Blender: they are refused by name, and a plan that has one is made again without mirrored views, or left out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import bpy

from ..core import methods as registry
from ..core.asset import asset_of
from ..core.errors import ReflectError
from ..core.exchange.folder import check_target, whole_folder
from ..core.look import Look
from ..core.planning.plan import Plan
from ..core.progress import teller
from ..core.snapshot import SceneSnapshot
from ..scene.bake import chosen_reflectors
from ..scene.camera import camera_of
from ..scene.export_gltf import export_gltf
from ..scene.export_scene import SceneExport
from ..scene.freshness import is_stale, remarks
from ..scene.ktx2 import find_ktx
from ..scene.load import load_assets, plan_in
from ..scene.look import read_look
from ..scene.places import assets_of
from ..scene.raytrace import primary
from .assets import Baked, assets_for
from .frame import open_frame
from .judged import named_camera
from .png import png_bytes
from .render import drawn_over

WITHOUT_VIEWS = {"mirrored_views": False}  # settings of `auto` for what has no pictures of its own
BAKED = 0.6  # share of the work


@dataclass(frozen=True)
class Shot:
    """The pictures that go with an export."""

    size: tuple[int, int]
    camera: str | None = None  # None: the scene's
    samples: int = 64


def write_export(
    scene: bpy.types.Scene, wanted: tuple[str, ...], out: Path, *, shot: Shot | None = None, assets: Path | None = None, settings: dict | None = None, ktx2: bool = False,
    progress=None,
) -> list[str]:  # fmt: skip
    """Writes the folder `out`, whole or not at all; an earlier export there is replaced. wanted: methods, () for all that lie there; assets: their folder, else
    those beside the .blend. ktx2: float images as KTX2, by a program that is looked for on PATH. Returns what an artist should know, as sentences. ReflectError: a
    method that draws, nothing baked, a folder that is not ours, no such program."""
    check_target(out)
    for name in wanted:
        if name != registry.AUTO and name not in registry.gathering():
            raise ReflectError(f"{name} draws the scene again in every frame, which an export cannot.", f"Choose among: {', '.join(registry.gathering())}, {registry.AUTO}.")
    ktx = find_ktx() if ktx2 else None
    if shot:
        from ..gpu.device import ensure

        ensure()  # before minutes of work
    say = teller(progress, "The export")
    with open_frame(scene, None, say) as snapshot:
        chosen_reflectors(snapshot, ())
        view = camera_of(scene, named_camera(scene, shot.camera), *shot.size) if shot else None
        found, sentences = _found(scene, snapshot, wanted, out, assets, settings or {}, lambda s, t: say(BAKED * s, t))
        with whole_folder(out) as folder:
            made = SceneExport(snapshot, export_gltf(scene, folder), ktx)
            reflectors = made.answers({name: baked.assets for name, baked in found.items()}, lambda s, t: say(BAKED + 0.1 * s, t))
            if not reflectors:
                raise ReflectError(" ".join(made.sentences) or f"No reflector of {scene.name} has an asset.", "Show the reflectors in renders, and bake again.")
            look = read_look(scene)
            if shot:
                camera = (named_camera(scene, shot.camera) or scene.camera).name
                sentences += _draw(made, scene, snapshot, camera, view, found, look, shot, lambda s, t: say(BAKED + 0.1 + 0.3 * s, t))
            made.finish(reflectors, look, _plan(found))
    say(1.0, f"wrote {out}")
    return sentences + made.sentences


def _found(scene, snapshot: SceneSnapshot, wanted, out: Path, assets: Path | None, settings: dict, say) -> tuple[dict[str, Baked], list[str]]:
    """(method -> what it answers from, sentences)."""
    folder, sentences, found = assets or assets_of(scene), [], {}
    for k, name in enumerate(wanted or (*registry.gathering(), registry.AUTO)):
        if wanted and assets is None:
            found[name] = _baked(scene, snapshot, name, out, folder, settings, lambda s, t, k=k: say((k + s) / len(wanted), t))
            continue
        if name == registry.AUTO and _draws(plan_in(folder)):
            sentences.append(f"{registry.AUTO} is left out: its plan has mirrored views. Name it with --methods to have one made without.")
        elif found_assets := load_assets(snapshot, name, folder):
            found[name] = Baked(found_assets, None, folder)
        elif wanted:
            raise ReflectError(f"{folder} has no {name} asset.", f"Make it with: reflect bake FILE.blend --methods {name} --out {folder}.")
    if not found:
        raise ReflectError(f"Nothing is baked in {folder}.", "Bake first, or name the methods to bake with --methods.")
    for name, baked in found.items():
        old = [r.name for r in snapshot.reflectors() if (asset := asset_of(baked.assets, r)) is not None and is_stale(snapshot, asset)]
        if old:
            sentences.append(f"{name} of {', '.join(old)} was baked from another state of the scene.")
        sentences += dict.fromkeys(said for asset in baked.assets.values() for said in remarks(asset, snapshot))
    return found, sentences


def _baked(scene, snapshot: SceneSnapshot, name: str, out: Path, beside: Path, settings: dict, say: Callable) -> Baked:
    """As `render` has it, of `auto` without mirrored views."""
    place = Path(out).absolute().parent
    if name != registry.AUTO:
        return assets_for(scene, snapshot, name, place, settings, say)
    if (plan := plan_in(beside)) and not _draws(plan):
        baked = assets_for(scene, snapshot, name, place, settings, say)
        if not _draws(plan_in(baked.folder)):
            return baked
    return assets_for(scene, snapshot, name, place, {**settings, **WITHOUT_VIEWS}, say)


def _draws(plan: Plan | None) -> bool:
    return plan is not None and any(row.method not in registry.gathering() for row in plan.rows)


def _plan(found: dict[str, Baked]) -> Plan | None:
    return plan_in(found[registry.AUTO].folder) if registry.AUTO in found else None


def _draw(made: SceneExport, scene, snapshot, camera: str, view, found: dict[str, Baked], look: Look, shot: Shot, say) -> list[str]:
    """Adds the camera's pictures; of methods that every reflector has an asset of."""
    say(0.0, "tracing the frame")
    seen = primary(view, samples=shot.samples, scene=scene, progress=lambda s, t: say(0.8 * s, t))
    drawn, behind, sentences = {}, None, []
    for name, baked in found.items():
        if missing := [r.name for r in snapshot.reflectors() if asset_of(baked.assets, r) is None]:
            sentences.append(f"There is no picture of {name}: {', '.join(missing)} has no asset of it.")
            continue
        say(0.8, f"drawing {name}")
        picture, behind = drawn_over(snapshot, baked.assets, None, look, view, seen, "display")
        drawn[name] = png_bytes(picture)
    if behind is not None:
        made.picture(camera, view, behind, png_bytes(look.apply(seen.combined)), drawn)
    return sentences


