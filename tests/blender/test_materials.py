"""Shader trees reduced to one lobe: each node, mixes, groups, links, and who counts as a reflector."""

import bpy
import numpy as np
import pytest

from reflect_addon.scene.materials import MAX_ROUGHNESS, reflect_material
from reflect_addon.scene.snapshot import take_snapshot


class Tree:
    """A new material whose surface is built by hand."""

    def __init__(self, tree=None):
        self.material = bpy.data.materials.new("M")
        self.tree = self.material.node_tree
        self.tree.nodes.clear()
        self.output = self.tree.nodes.new("ShaderNodeOutputMaterial")

    def node(self, kind, **values):
        node = self.tree.nodes.new(kind)
        for name, value in values.items():
            node.inputs[name.replace("_", " ")].default_value = value
        return node

    def link(self, source, target, output=0):
        self.tree.links.new(source.outputs[output], target)

    def read(self, surface):
        self.link(surface, self.output.inputs["Surface"])
        return reflect_material(self.material)


@pytest.fixture
def tree(fresh_file):
    return Tree()


def principled(tree, **values):
    return tree.node("ShaderNodeBsdfPrincipled", **values)


def test_principled_metal(tree):
    colors = {"Base_Color": (0.9, 0.5, 0.1, 1), "Specular_Tint": (1, 0.5, 1, 1)}
    m = tree.read(principled(tree, Metallic=1, Roughness=0.2, **colors))
    assert (m.metallic, m.roughness, m.is_reflector) == (1, pytest.approx(0.2), True)
    assert m.base_color == pytest.approx((0.9, 0.5, 0.1)) and m.specular_tint == pytest.approx((1, 0.5, 1))
    assert m.simplified == () and m.specular_weight == 1


def test_the_default_surface_is_no_reflector_and_a_polished_one_is(tree):
    assert not tree.read(principled(tree)).is_reflector
    assert tree.read(principled(tree, Roughness=0.1)).is_reflector
    assert not tree.read(principled(tree, Roughness=MAX_ROUGHNESS + 0.01, Metallic=1)).is_reflector
    assert not tree.read(principled(tree, Roughness=0.1, Specular_IOR_Level=0.0)).is_reflector


def test_specular_level_becomes_an_index_with_the_same_reflectance(tree):
    for ior, level in [(1.5, 0.5), (1.5, 1.0), (1.33, 0.25), (2.4, 0.5)]:
        m = tree.read(principled(tree, IOR=ior, Specular_IOR_Level=level, Roughness=0))
        assert ((m.ior - 1) / (m.ior + 1)) ** 2 == pytest.approx(2 * level * ((ior - 1) / (ior + 1)) ** 2, rel=1e-5)


def test_a_varnished_rough_floor_reflects_by_its_coat(tree):
    m = tree.read(principled(tree, Roughness=0.8, Coat_Weight=1, Coat_Roughness=0.05, Coat_IOR=1.6))
    assert (m.is_reflector, m.metallic) == (True, 0)
    assert (m.roughness, m.ior) == (pytest.approx(0.05), pytest.approx(1.6))
    assert "2 reflecting layers" in m.simplified[-1]


def test_glossy_metallic_and_glass(tree):
    m = tree.read(tree.node("ShaderNodeBsdfAnisotropic", Color=(0.5, 0.6, 0.7, 1), Roughness=0.1))
    assert (m.metallic, m.is_reflector) == (1, True) and m.base_color == pytest.approx((0.5, 0.6, 0.7))
    colors = {"Base_Color": (0.5, 0.6, 0.7, 1), "Edge_Tint": (1, 0.9, 0.8, 1)}
    m = tree.read(tree.node("ShaderNodeBsdfMetallic", Roughness=0, **colors))
    assert m.base_color == pytest.approx((0.5, 0.6, 0.7)) and m.specular_tint == pytest.approx((1, 0.9, 0.8))
    physical = tree.node("ShaderNodeBsdfMetallic")
    physical.fresnel_type = "PHYSICAL_CONDUCTOR"  # only then has the node these inputs
    n, k = np.array([0.2, 0.9, 1.1]), np.array([3.9, 2.4, 2.2])
    physical.inputs["IOR"].default_value, physical.inputs["Extinction"].default_value = n, k
    expected = np.abs((n + 1j * k - 1) / (n + 1j * k + 1)) ** 2  # Fresnel with a complex index
    assert tree.read(physical).base_color == pytest.approx(tuple(expected), rel=1e-5)
    m = tree.read(tree.node("ShaderNodeBsdfGlass", IOR=1.45, Roughness=0))
    assert (m.metallic, m.ior, m.is_reflector) == (0, pytest.approx(1.45), True)
    assert not tree.read(tree.node("ShaderNodeBsdfRefraction", Roughness=0)).is_reflector
    for dull in ("ShaderNodeBsdfDiffuse", "ShaderNodeEmission", "ShaderNodeBsdfTransparent"):
        m = tree.read(tree.node(dull))
        assert (m.is_reflector, m.specular_weight) == (False, 0)


def test_what_refracts(tree):
    """Clear and smooth alone; a crossing's tint is Cycles': the colour's root of a body, the colour itself of a Glass BSDF (measured)."""
    m = tree.read(principled(tree, Transmission_Weight=1, Roughness=0, Base_Color=(0.25, 1, 0.49, 1), IOR=1.4, Specular_IOR_Level=1.0))
    assert m.refracts and not m.thin_wall and m.is_reflector and m.ior == pytest.approx(1.4)
    assert m.base_color == pytest.approx((0.5, 1.0, 0.7))
    assert tree.read(principled(tree, Transmission_Weight=1, Roughness=0, Thin_Wall=True)).thin_wall
    m = tree.read(tree.node("ShaderNodeBsdfGlass", Roughness=0, Color=(0.25, 1, 0.49, 1)))
    assert m.refracts and m.base_color == pytest.approx((0.25, 1.0, 0.49))
    for values in ({"Transmission_Weight": 0.5}, {"Transmission_Weight": 1, "Roughness": 0.3}, {"Transmission_Weight": 1, "Metallic": 1}):
        assert not tree.read(principled(tree, **{"Roughness": 0.0, **values})).refracts


def mixed(tree, factor):
    mix = tree.node("ShaderNodeMixShader", Factor=factor)
    tree.link(tree.node("ShaderNodeBsdfDiffuse"), mix.inputs[1])
    tree.link(tree.node("ShaderNodeBsdfAnisotropic", Color=(1, 1, 1, 1), Roughness=0.1), mix.inputs[2])
    return mix


@pytest.mark.parametrize("factor", [0.0, 0.01, 0.3, 1.0])
def test_mixes_weigh_their_shaders(tree, factor):
    m = tree.read(mixed(tree, factor))
    assert m.specular_weight == pytest.approx(factor)
    assert m.is_reflector == (factor > 0.015)


def test_mixes_driven_by_fresnel_are_dielectric_coats(tree):
    mix = mixed(tree, 0.5)
    tree.link(tree.node("ShaderNodeFresnel", IOR=1.7), mix.inputs[0])
    m = tree.read(mix)
    assert (m.metallic, m.ior, m.specular_weight, m.is_reflector) == (0, pytest.approx(1.7), 1, True)
    mix = mixed(tree, 0.5)
    tree.link(tree.node("ShaderNodeLayerWeight", Blend=0.5), mix.inputs[0])
    assert tree.read(mix).ior == pytest.approx(2.0)


def test_added_shaders_keep_their_weight(tree):
    add = tree.node("ShaderNodeAddShader")
    tree.link(tree.node("ShaderNodeBsdfDiffuse"), add.inputs[0])
    tree.link(tree.node("ShaderNodeBsdfAnisotropic", Roughness=0.2), add.inputs[1])
    assert tree.read(add).specular_weight == 1


def test_groups_reroutes_and_muted_nodes_are_followed(tree):
    inner = bpy.data.node_groups.new("Shiny", "ShaderNodeTree")
    inner.interface.new_socket("Sheen", in_out="INPUT", socket_type="NodeSocketFloat")
    inner.interface.new_socket("Surface", in_out="OUTPUT", socket_type="NodeSocketShader")
    start, end = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
    glossy = inner.nodes.new("ShaderNodeBsdfAnisotropic")
    inner.links.new(start.outputs[0], glossy.inputs["Roughness"])
    inner.links.new(glossy.outputs[0], end.inputs[0])
    group = tree.tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inner
    group.inputs["Sheen"].default_value = 0.125
    muted = tree.node("ShaderNodeMixShader", Factor=0.9)
    muted.mute = True
    route = tree.tree.nodes.new("NodeReroute")
    tree.link(group, route.inputs[0])
    tree.link(route, muted.inputs[1])
    m = tree.read(muted)
    assert (m.roughness, m.specular_weight) == (pytest.approx(0.125), 1)
    value = tree.node("ShaderNodeValue")
    value.outputs[0].default_value = 0.25
    tree.link(value, group.inputs["Sheen"])
    m = tree.read(muted)
    assert m.roughness == pytest.approx(0.25) and not any("roughness" in note for note in m.simplified)


def test_textures_become_their_mean_and_say_so(tree):
    surface = principled(tree, Metallic=1)
    texture = tree.node("ShaderNodeTexImage")
    tree.link(texture, surface.inputs["Roughness"])
    encoded = np.mean([((c + 0.055) / 1.055) ** 2.4 for c in (26 / 255, 76 / 255)])
    for space, expected in {"Non-Color": 0.2, "sRGB": encoded}.items():
        texture.image = image = bpy.data.images.new("Worn", 4, 2)
        image.colorspace_settings.name = space
        image.pixels = np.tile([0.1, 0.1, 0.1, 1, 0.3, 0.3, 0.3, 1], 4).astype(np.float32)
        m = tree.read(surface)
        assert m.roughness == pytest.approx(expected, abs=3e-3) and "Worn" in m.simplified[0]
    texture.image = None
    m = tree.read(surface)
    assert m.roughness == pytest.approx(0.5) and "unlinked value" in m.simplified[0]


def test_textures_in_files_are_read_through_the_depsgraph(tree, tmp_path):
    """As a snapshot does: from evaluated materials, twice, the second time from memory."""
    image = bpy.data.images.new("Saved", 8, 8)
    image.pixels = np.tile(np.float32([0.2, 0.2, 0.2, 1]), 64)
    image.filepath_raw, image.file_format = str(tmp_path / "saved.png"), "PNG"
    image.save()
    loaded = bpy.data.images.load(str(tmp_path / "saved.png"))
    loaded.colorspace_settings.name = "Non-Color"
    surface = principled(tree, Metallic=1)
    texture = tree.node("ShaderNodeTexImage")
    texture.image = loaded
    tree.link(texture, surface.inputs["Roughness"])
    tree.read(surface)
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.data.materials.append(tree.material)
    for _ in range(2):
        snap = take_snapshot(bpy.context.evaluated_depsgraph_get())
        assert snap.materials[0].roughness == pytest.approx(0.2, abs=3e-3)
        assert snap.instances[0].is_reflector


def test_empty_slots_and_empty_trees_are_dull(fresh_file):
    assert not reflect_material(None).is_reflector
    tree = Tree()
    assert not reflect_material(tree.material).is_reflector
    tree.tree.nodes.clear()
    assert reflect_material(tree.material).specular_weight == 0
