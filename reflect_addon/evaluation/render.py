"""One picture: Cycles' frame without its mirror part, and a method's reflections in its place. Or without Cycles: the
background from the method's assets (core/background.py), and over it what the reflectors mirror; or EEVEE's frame (eevee_picture.py)."""

from pathlib import Path

import bpy
import numpy as np

from ..core import lobe_rays, pixel_rays
from ..core import methods as registry
from ..core.asset import Asset
from ..core.background import background_of, can_show
from ..core.background import why_none as why_no_background
from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.focus import can_focus, refocused
from ..core.look import Look
from ..core.progress import teller
from ..core.snapshot import SceneSnapshot
from ..scene.bake import chosen_reflectors
from ..scene.camera import camera_of
from ..scene.exr import write_exr
from ..scene.freshness import remarks
from ..scene.look import read_look
from ..scene.native_draw import why_none
from ..scene.raytrace import Primary, primary
from .assets import assets_for, complete_in
from .eevee_picture import eevee_picture
from .frame import open_frame
from .judged import named_camera
from .png import write_png


def render_picture(
    scene: bpy.types.Scene,
    method: str,
    size: tuple[int, int],
    out: Path,
    *,
    camera: str | None = None,
    frame: int | None = None,
    samples: int = 16,
    assets: Path | None = None,
    settings: dict | None = None,
    background: bool = False,
    focus: float = 0.0,
    backend: str = "gpu",
    progress=None,
) -> None:
    """Writes `out`: .png through the scene's view transform, .exr scene-linear. Assets come from the folder `assets`, or
    are those beside the .blend, baked when they are missing or stale. background: it comes from the assets, too; of the
    reflectors only what they mirror is then drawn. ReflectError where no asset holds the camera. focus: m from the assets' middle
    to what is sharp, 0 = found by the bake. backend: 'gpu', or 'eevee' for the method's node groups in EEVEE, which takes `samples` itself."""
    from ..gpu.device import ensure

    ensure()  # before minutes of work
    say = teller(progress, "The picture")
    if background and not can_show(method):
        raise ReflectError(*why_no_background(method))
    if backend == "eevee" and (background or focus):
        raise ReflectError("EEVEE draws the background itself and knows no focus plane.", "Leave --background and --focus out.")
    if backend == "eevee" and (reason := why_none(method)):
        raise ReflectError(reason, f"Choose among: {', '.join(registry.gathering())}.")
    if focus and not can_focus(method):
        raise ReflectError(f"The method {method} has no focus.", "Leave --focus out, or choose light_field.")
    with open_frame(scene, frame, say) as snapshot:
        chosen_reflectors(snapshot, ())
        view = camera_of(scene, named_camera(scene, camera), *size)
        if assets is None:
            baked = assets_for(scene, snapshot, method, out.parent, settings, lambda s, t: say(0.5 * s, t))
        else:
            baked = complete_in(assets, snapshot, method)
        loaded = baked.assets
        for asset in {id(a): a for a in loaded.values()}.values():
            for sentence in remarks(asset, snapshot):
                say(0.5, f"Warning: {sentence}")
        space = "linear" if out.suffix.lower() == ".exr" else "display"
        if backend == "eevee":
            name = (named_camera(scene, camera) or scene.camera).name
            picture = eevee_picture(scene, snapshot, name, view, method, baked.folder, samples, lambda s, t: say(0.5 + 0.5 * s, t))
            _write(out, picture if space == "linear" else read_look(scene).apply(picture), say)
            return
        loaded = refocused(loaded, focus)
        behind = _background(loaded, snapshot, method, view) if background else None
        if not background:
            say(0.5, "tracing the frame")
            seen = primary(view, samples=samples, scene=scene, progress=lambda s, t: say(0.5 + 0.4 * s, t))
        picture, _ = drawn_over(snapshot, loaded, baked.surfaces, read_look(scene), view, behind if background else seen, space)
    _write(out, picture, say)


def drawn_over(
    snapshot: SceneSnapshot, assets: dict[str, Asset], surfaces: Asset | None, look: Look, view: Camera, behind: Asset | Primary, space: str
) -> tuple[np.ndarray, np.ndarray | Asset]:
    """((H, W, 3) the picture in `space`, 'linear' or 'display'; what was behind its reflections). behind: an asset that is the background, or Cycles' frame, whose
    mirror part is taken away where reflectors are."""
    from ..gpu.renderer import Renderer

    renderer = Renderer(snapshot, assets, look=look, surfaces=surfaces, most_rays=lobe_rays.MOST, most_along=pixel_rays.MOST)
    if not isinstance(behind, Asset):
        covered = renderer.ray_map(view).covered()[..., None]
        behind = np.where(covered, np.maximum(behind.combined - behind.glossy, 0.0), behind.combined)
    renderer.settle(view)
    picture = renderer.picture(view, behind, space)[..., :3]
    renderer.free()
    return picture, behind


def _write(out: Path, picture: np.ndarray, say) -> None:
    if out.suffix.lower() == ".exr":
        out.parent.mkdir(parents=True, exist_ok=True)
        write_exr(out, picture)
    else:
        write_png(out, picture)
    say(1.0, f"wrote {out}")


def _background(assets: dict[str, Asset], snapshot: SceneSnapshot, method: str, view: Camera) -> Asset:
    found = background_of(assets, snapshot, view)
    if found is None:
        raise ReflectError(*why_no_background(method, view))
    return found
