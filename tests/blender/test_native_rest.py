"""What native materials leave of the artist's: below the mirror lobe, through it, and around it.

In a furnace, light of 1 from everywhere, a mirror ray brings 1 wherever it goes. So when the asset has seen nothing but white, a material
with the group in it must send out what the artist's own sent out before in EEVEE: its diffuse colour, what it lets through, its alpha, all that
its normals turn.
"""

import bpy
import numpy as np
import pytest
import test_native_drawn as drawn
from native_scene import apply, principled, room_asset
from test_native_drawn import file  # noqa: F401
from tolerances_nodes import NATIVE_FURNACE


def one_node(kind: str, **values):
    """A material of one shader node, smooth; blanks in the inputs' names as underscores."""
    material = bpy.data.materials.new(kind)
    tree = material.node_tree
    made = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in {"Roughness": 0.0, **values}.items():
        made.inputs[name.replace("_", " ")].default_value = value
    tree.links.new(made.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    return material


def bumpy():
    """Plastic whose normals are a pattern's."""
    material = principled("Bumpy", Base_Color=(0.2, 0.6, 0.3, 1), Roughness=0.0)
    tree = material.node_tree
    wave, bump = tree.nodes.new("ShaderNodeTexWave"), tree.nodes.new("ShaderNodeBump")
    tree.links.new(wave.outputs[1], bump.inputs["Height"])
    tree.links.new(bump.outputs[0], tree.nodes["Principled BSDF"].inputs["Normal"])
    return material


CASES = {
    "dull": lambda: principled("Dull", Base_Color=(0.8, 0.3, 0.1, 1), Roughness=0.0),
    "clear": lambda: principled("Clear", Base_Color=(0.5, 0.8, 0.9, 1), Roughness=0.0, Transmission_Weight=1.0),
    "alpha": lambda: principled("Alpha", Metallic=1.0, Base_Color=(0.9, 0.5, 0.2, 1), Roughness=0.0, Alpha=0.4),
    "glass": lambda: one_node("BsdfGlass", Color=(0.5, 0.8, 0.9, 1)),
    "metallic": lambda: one_node("BsdfMetallic", Base_Color=(0.9, 0.5, 0.2, 1), Edge_Tint=(0.9, 0.9, 0.5, 1)),
    "specular": lambda: one_node("EeveeSpecular", Base_Color=(0.1, 0.3, 0.1, 1), Specular=(0.5, 0.2, 0.4, 1), Transparency=0.3),
    "bumpy": bumpy,
}


@pytest.mark.parametrize("cases", [("alpha", "glass"), pytest.param(tuple(CASES), marks=pytest.mark.slow)], ids=("two", "all"))
def test_in_a_furnace_materials_are_as_before(file, cases, tmp_path, monkeypatch):  # noqa: F811
    monkeypatch.setattr(drawn, "CASES", CASES)
    scene = drawn.set_up(cases)
    before = drawn.picture(scene, "BLENDER_EEVEE", 1.0, tmp_path / "before.exr")
    done = apply(scene, assets={name: drawn.white(room_asset()) for name in cases})
    assert done.materials == len(cases) and not done.sentences
    after = drawn.picture(scene, "BLENDER_EEVEE", 1.0, tmp_path / "after.exr")
    assert not np.array_equal(before, after), "the groups answer now"
    middle = slice(drawn.ROW // 4, -drawn.ROW // 4)
    differs = {name: float(np.abs(after[k, middle, middle] - before[k, middle, middle]).max()) for k, name in enumerate(cases)}
    print(differs)
    assert max(differs.values()) < NATIVE_FURNACE, differs
    assert all(after[k, middle, middle].mean() > 0.1 for k in range(len(cases))), "nothing is black"
