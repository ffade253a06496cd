"""What EEVEE draws of native materials, against Cycles' picture of the artist's own under the same light.

Under one colour from everywhere a mirror ray brings that colour wherever it goes: what is left to compare is what materials make of it.
EEVEE's world is black, so that all its light comes from the groups; Cycles' is white.
"""

from dataclasses import replace

import bpy
import numpy as np
import pytest
from blender_scenes import set_world
from native_scene import apply, ball, grouped, mixed, principled, room_asset
from tolerances_nodes import NATIVE_REFLECTANCE

from reflect_addon.scene import properties
from reflect_addon.scene.exr import read_exr

ROW = 24  # pixels a ball
BLACK = (0, 0, 0, 1)


def white(asset):
    """The asset as if all it had seen were white."""
    image = asset.images["radiance_tx"].copy()
    image[..., :3] = 1.0
    return replace(asset, images={**asset.images, "radiance_tx": image}, uniforms={**asset.uniforms, **_plain_scale(asset)})


def _plain_scale(asset):
    return {name: 1.0 for name in asset.uniforms if "scale" in name}


def glossy(name, color):
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeBsdfGlossy")
    node.inputs["Color"].default_value, node.inputs["Roughness"].default_value = color, 0.0
    tree.links.new(node.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    return material


def black_mixed():
    material = mixed("Mixed")
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = BLACK
    return material


CASES = {
    "metal": lambda: principled("Metal", Metallic=1.0, Base_Color=(0.9, 0.5, 0.2, 1), Roughness=0.0),
    "plastic": lambda: principled("Plastic", Base_Color=BLACK, Roughness=0.0),
    "level": lambda: principled("Level", Base_Color=BLACK, Roughness=0.0, Specular_IOR_Level=0.9, Specular_Tint=(1, 0.6, 0.6, 1)),
    "coat": lambda: principled("Coat", Base_Color=BLACK, Roughness=0.9, Specular_IOR_Level=0.0, Coat_Weight=1.0, Coat_Roughness=0.0),
    "glow": lambda: principled("Glow", Base_Color=BLACK, Roughness=0.0, Emission_Color=(0, 0.5, 0, 1), Emission_Strength=1.0),
    "mixed": black_mixed,
    "grouped": lambda: grouped("Grouped"),
    "glossy": lambda: glossy("Glossy", (0.3, 0.9, 0.6, 1)),
}


def set_up(cases) -> bpy.types.Scene:
    """The balls in a row, seen from above."""
    for k, name in enumerate(cases):
        ball(name, CASES[name](), at=(k, 0, 0), segments=24)
    scene = bpy.context.scene
    eye = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    eye.data.type, eye.data.ortho_scale, eye.location = "ORTHO", len(cases), ((len(cases) - 1) / 2, 0, 5)
    scene.collection.objects.link(eye)
    scene.camera = eye
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = ROW * len(cases), ROW, 100
    settings = render.image_settings
    settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "NONE"
    settings.use_exr_interleave = True
    return scene


@pytest.fixture
def file(fresh_file):
    properties.register()
    yield fresh_file
    properties.unregister()


def picture(scene, engine: str, world: float, path) -> np.ndarray:
    """(cases, ROW, ROW, 3) linear."""
    scene.render.engine, scene.render.filepath = engine, str(path)
    scene.cycles.samples, scene.cycles.use_denoising, scene.eevee.taa_render_samples = 32, False, 16
    set_world((1, 1, 1), world)
    bpy.ops.render.render(write_still=True)
    planes = read_exr(path)
    name = next(n for n in planes if n.endswith("Combined.R"))[:-1]
    full = np.stack([planes[name + letter] for letter in "RGB"], -1)
    return full.reshape(ROW, -1, ROW, 3).swapaxes(0, 1)


@pytest.mark.parametrize("cases", [("metal", "mixed"), pytest.param(tuple(CASES), marks=pytest.mark.slow)], ids=("two", "all"))
def test_shares_of_light_are_cycles(file, cases, tmp_path):
    scene = set_up(cases)
    truth = picture(scene, "CYCLES", 1.0, tmp_path / "cycles.exr")
    apply(scene, assets={name: white(room_asset()) for name in cases})
    drawn = picture(scene, "BLENDER_EEVEE", 0.0, tmp_path / "eevee.exr")
    again = picture(scene, "CYCLES", 1.0, tmp_path / "again.exr")
    assert np.array_equal(truth, again), "Cycles draws the artist's shader as before"
    middle = slice(ROW // 4, -ROW // 4)
    differs = {}
    for k, name in enumerate(cases):
        ours, theirs = drawn[k, middle, middle], truth[k, middle, middle]
        differs[name] = float(np.abs(ours.mean((0, 1)) - theirs.mean((0, 1))).max())
    print(differs)
    assert max(differs.values()) < NATIVE_REFLECTANCE, differs
