"""A small scene of two reflectors with what edits need, and bakes of it that take no light."""

import bpy
import numpy as np
from blender_scenes import add_mesh

from reflect_addon.core.asset_files import load_asset
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.scene.bake import bake_assets
from reflect_addon.scene.geometric_trace import geometric_tracer
from reflect_addon.scene.intersect import first_hits
from sample_blends import scene_parts as parts

SMALL = {
    "resolution": 8, "texels": 8, "samples": 1, "sky_error": 0, "views": 2, "view_texels": 16, "layers": 2, "map_texels": 16, "maps": 1, "turns": 6,
    "points": 4, "self_detail": 1, "self_reflections": False, "surface_samples": 1, "surface_levels": 1, "surface_cuts": 0, "surface_noise": 0,
}  # fmt: skip


def build() -> bpy.types.Scene:
    """Left and Right mirror; a crate with UVs and a colour ramp, a floor, a leaf with holes, a lamp with a size and a sun; and what no bake sees."""
    scene = parts.prepare(bpy.context.scene, "stale")
    parts.set_world(scene, (0.2, 0.3, 0.4))
    scene.frame_start = scene.frame_end = 1
    mirror = parts.mirror()
    for name, x in (("Left", -1.0), ("Right", 1.2)):
        parts.sphere(name, 0.4, mirror if name == "Left" else mirror.copy(), 8, location=(x, 0, 0.5))
    bpy.data.materials["Mirror.001"].name = "Chrome"
    parts.box("Crate", (0.5, 0.5, 0.5), (0.2, 1.2, 0.25), parts.material("Red", (0.8, 0.1, 0.1)))
    parts.box("Floor", (6.0, 6.0, 0.1), (0, 0, -0.05), parts.material("Grey", (0.5, 0.5, 0.5)))
    leaf = add_mesh("Leaf", [(-1, 2, 0), (1, 2, 0), (1, 2, 1), (-1, 2, 1)], [(0, 1, 2, 3)], material=parts.material("Green", (0.1, 0.6, 0.1)))
    _bsdf("Green").inputs["Alpha"].default_value = 0.5
    crate = bpy.data.objects["Crate"].data
    crate.uv_layers.new(name="UVMap")
    tree = bpy.data.materials["Red"].node_tree
    ramp, coordinate = tree.nodes.new("ShaderNodeValToRGB"), tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinate.outputs["Object"], ramp.inputs[0])
    tree.links.new(ramp.outputs[0], _bsdf("Red").inputs["Base Color"])
    for name, kind in (("Lamp", "AREA"), ("Sun", "SUN")):
        lamp = bpy.data.objects.new(name, bpy.data.lights.new(name, kind))
        lamp.location = (0, 0, 4)
        scene.collection.objects.link(lamp)
    for name in ("Empty", "Anchor"):
        scene.collection.objects.link(bpy.data.objects.new(name, None))
    coordinate.object = bpy.data.objects["Anchor"]
    ghost = bpy.data.objects.new("Ghost", crate.copy())
    ghost.hide_render, ghost.location = True, (0, -2, 0.5)
    scene.collection.objects.link(ghost)
    parts.camera((0, -6, 2), (0, 0, 0.5))
    bpy.data.materials.new("Unused").use_fake_user = True
    bpy.context.view_layer.update()
    assert leaf.name == "Leaf" and {o.name for o in scene.objects} >= {"Left", "Right", "Crate", "Floor", "Ghost", "Camera"}
    return scene


def _bsdf(material: str):
    return next(n for n in bpy.data.materials[material].node_tree.nodes if n.type == "BSDF_PRINCIPLED")


def bake(folder, kinds, **more) -> list[str]:
    """Bakes without light; the names of the folders whose asset was made anew."""
    before = {path.parent.name: path.stat().st_mtime_ns for path in folder.glob("*/asset.json")}
    with open_frame(bpy.context.scene, None) as snapshot:
        bake_assets(snapshot, kinds, folder, settings=SMALL, tracer=geometric_tracer(snapshot, first_hits(snapshot)), **more)
    return sorted(path.parent.name for path in folder.glob("*/asset.json") if path.stat().st_mtime_ns != before.get(path.parent.name))


def loaded(folder) -> dict[tuple[str, str], object]:
    """(kind, reflector) -> asset of all that lies there."""
    found = [load_asset(path.parent) for path in sorted(folder.glob("*/asset.json"))]
    return {(asset.kind, asset.reflector): asset for asset in found}


def same_content(one, other) -> bool:
    """Whether two assets show the same: images, numbers and options."""
    alike = one.images.keys() == other.images.keys() and all(np.array_equal(one.images[n], other.images[n]) for n in one.images)
    return alike and one.uniforms == other.uniforms and one.options == other.options
