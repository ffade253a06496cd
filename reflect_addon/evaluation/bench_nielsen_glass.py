"""Targets for refraction, the future work of nielsen-2002: a ball, a cube and a pane of glass before a striped wall, against Cycles.

Each is judged by itself, where the eye sees it and where a mirror on the side shows any of them. Before there was refraction, the eye saw what glass mirrors
on black, and mirrors showed glass as a surface with the colours that it has from straight above: both are drawn again as the rival. Things glow and
reflect nothing, so that nothing but the glass is judged. `curved` answers the rays that leave the ball from a live cube map.
"""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import numpy as np

from ..core import glass_shapes, metrics
from ..core.methods import recursive
from ..core.rays import Rays
from ..scene.camera import camera_of
from ..scene.look import read_look
from ..scene.raytrace import trace
from . import eye
from .assets import assets_for
from .bench_mirrors_scene import look, new_file
from .bench_nielsen_scene import block, panel, quad
from .bench_row import row
from .exhibit import Exhibit
from .frame import open_frame

SIZE = (160, 120)
SAMPLES = 128  # of Cycles, a pixel
HALF = 0.5  # of what it was without
BAKE = {"resolution": 128, "samples": 1}
IOR, TINT = 1.45, (0.85, 0.95, 0.9, 1.0)
GLASS = ("Glass ball", "Glass cube", "Glass pane")
MIRRORED = "Glass in a mirror"


def glass_room() -> bpy.types.Scene:
    """Glass on a floor before stripes; what stands behind the pane, and a mirror on the right."""
    scene = new_file()
    for number in range(12):
        quad((0.5 * number - 2.75, 3.0, 1.2), (0, -1, 0), (0.5, 2.4), number)
    quad((0, 0.1, 0), (0, 0, 1), (6, 5.8), 4)
    quad((0, -2.7, 1.2), (0, 1, 0), (6, 2.4), 1)
    quad((-2.9, 0.1, 1.2), (1, 0, 0), (5.8, 2.4), 3)
    block((0.7, 1.0, 0.35), (0.35, 0.35, 0.7), 0)
    block((1.25, 0.8, 0.15), (0.3, 0.3, 0.3), 5)
    panel((2.3, 1.5, 0.8), (-1, -0.7, 0), (2.0, 1.5))
    for made in bpy.data.materials:
        shader = made.node_tree.nodes["Principled BSDF"]
        if shader.inputs["Emission Strength"].default_value > 0:
            shader.inputs["Base Color"].default_value, shader.inputs["Specular IOR Level"].default_value = (0, 0, 0, 1), 0.0
    glass = bpy.data.materials.new("Glass")
    shader = glass.node_tree.nodes["Principled BSDF"].inputs
    shader["Transmission Weight"].default_value, shader["Roughness"].default_value = 1.0, 0.0
    shader["IOR"].default_value, shader["Base Color"].default_value = IOR, TINT
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=0.45, location=(-1.0, 0.2, 0.55))
    bpy.ops.object.shade_smooth()
    _named("Glass ball", glass)
    bpy.ops.mesh.primitive_cube_add(size=0.6, location=(-0.1, 0.9, 0.35), rotation=(0, 0, 0.6))
    _named("Glass cube", glass)
    bpy.ops.mesh.primitive_cube_add(size=1, location=(1.0, 0.3, 0.55))
    bpy.context.object.scale = (1.1, 0.03, 1.0)
    _named("Glass pane", glass)
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.3, 0.4, 0.5, 1)
    look(scene, (0.0, -2.5, 1.1), (0.4, 1.0, 0.5), 26)
    return scene


def _named(name: str, material) -> None:
    bpy.context.object.name = name
    bpy.context.object.data.materials.append(material)


def measure(progress) -> list:
    """Rows for targets.json, and an Exhibit."""
    from ..gpu.renderer import Renderer

    scene = glass_room()
    with TemporaryDirectory() as folder, open_frame(scene, None) as snapshot:
        baked = assets_for(scene, snapshot, recursive.NAME, Path(folder), BAKE, lambda share, text: progress(0.6 * share, f"nielsen, glass: {text}"))
        camera, developed = camera_of(scene, None, *SIZE), read_look(scene)

        def drawn(snapshot, change):
            assets = {name: change(asset) for name, asset in baked.assets.items()}
            renderer = Renderer(snapshot, assets, surfaces=baked.surfaces)
            renderer.settle(camera)
            picture, counts = renderer.picture(camera)[..., :3], renderer.mirrored_views
            renderer.free()
            return picture, counts

        opaque = replace(snapshot, materials=tuple(replace(m, refracts=False) for m in snapshot.materials))
        progress(0.6, "nielsen, glass: drawing")
        ours, tree = drawn(snapshot, lambda asset: asset)
        live, _ = drawn(snapshot, lambda asset: replace(asset, settings={**asset.settings, "curved": True}))
        before, _ = drawn(opaque, lambda asset: replace(asset, options={n: v for n, v in asset.options.items() if n != "glass"}))
        renderer = Renderer(snapshot, {})
        rays = renderer.ray_map(camera)
        renderer.free()
        progress(0.7, "nielsen, glass: the truth")
        mask, primary = rays.covered(), camera.primary_rays()
        truth = np.zeros((*mask.shape, 3), np.float32)
        chosen = Rays(primary.origin[mask.ravel()], primary.direction[mask.ravel()])
        truth[mask] = trace(chosen, samples=SAMPLES, seed=1, scene=scene).radiance
        masks = _masks(rays, scene)
        left = {name: baked.assets[name].uniforms.get("glass_left", 0.0) for name in GLASS}
    rows, lines = [], []
    for name, where in masks.items():
        (flip, rms), (flip_live, rms_live), (flip_before, rms_before) = (_errors(developed, p, truth, where) for p in (ours, live, before))
        rows.append(
            row(f"N-{name.lower().replace(' ', '-')}", flip, HALF * flip_before, flip <= HALF * flip_before,
                f"FLIP against Cycles of {int(where.sum())} pixels ({name}), asked: half of what it was without refraction, {flip_before:.3f}; RMSE "
                f"{rms:.3f}, without {rms_before:.3f}; answered by live maps FLIP {flip_live:.3f}, RMSE {rms_live:.3f}. {_left(left, name)}".rstrip())
        )  # fmt: skip
        lines.append((name, *(f"{v:.3f}" for v in (flip, flip_before, flip_live, rms, rms_before, rms_live)), f"{left.get(name, 0.0):.0%}"))
    panes = sum(isinstance(tree.mirrors[node.mirror], glass_shapes.Pane) for node in tree.nodes)
    rows.append(row("N-glass-views", float(panes), None, True, f"Views through panes of {len(tree.nodes)} views of the frame, all depths."))
    heads = ("glass", "FLIP", "without", "live maps", "RMSE", "without", "live maps", "left out")
    lead = f"Glass against Cycles ({SAMPLES} paths), {SIZE[0]}x{SIZE[1]}: panes by views through them, solid bodies by rays bent twice."
    pictures = [(what, developed.apply(p)) for what, p in (("Cycles", truth), ("ours", ours), ("without refraction", before))]
    return [*rows, Exhibit("Glass: recursive refraction", lead, heads, tuple(lines), tuple(pictures))]


def _masks(rays, scene) -> dict[str, np.ndarray]:
    """Name -> (H, W) bool of the pixels judged."""
    found = {name: rays.reflector == rays.reflector_names.index(name) for name in GLASS}
    mirror = rays.covered() & ~np.any(list(found.values()), axis=0)
    hits = trace(Rays(rays.origin[mirror] + 1e-4 * rays.normal[mirror], rays.direction[mirror]), scene=scene)
    shown = np.isin(hits.object, [hits.object_names.index(name) for name in GLASS if name in hits.object_names])
    mirror[mirror] = shown
    found[MIRRORED] = mirror
    return found


def _errors(look, picture, truth, where) -> tuple[float, float]:
    """(FLIP, RMSE) of the pixels."""
    ours, other = (look.apply(np.where(where[..., None], p, 0).astype(np.float32)) for p in (picture, truth))
    value, note = eye.flip(ours, other, where)
    if value is None:
        raise RuntimeError(note)
    return value, metrics.rmse(picture[where], truth[where])


def _left(left: dict[str, float], name: str) -> str:
    return f"Of what enters {left[name]:.0%} is left out." if left.get(name) else "No way through it is left out." if name in left else ""
