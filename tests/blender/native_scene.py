"""A file with every way in which a mirror's material can sit in it, for the tests of native reflections."""

from dataclasses import replace
from functools import cache

import bpy
import mesh_scenes
import trimesh

from reflect_addon.core.asset import Asset
from reflect_addon.core.asset_files import save_asset
from reflect_addon.core.asset_places import asset_name
from reflect_addon.core.methods import box_proxy, environment
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.scene.freshness import items_now, remembering
from reflect_addon.scene.native_materials import use_in_materials
from reflect_addon.scene.places import assets_of


def principled(name: str, **values) -> bpy.types.Material:
    """A smooth Principled material; blanks in the inputs' names as underscores."""
    material = bpy.data.materials.new(name)
    node = material.node_tree.nodes["Principled BSDF"]
    for key, value in {"Roughness": 0.1, **values}.items():
        node.inputs[key.replace("_", " ")].default_value = value
    return material


def mixed(name: str) -> bpy.types.Material:
    """Dull below, a Glossy node on top by Fresnel, behind a reroute and a muted node."""
    material = principled(name, Roughness=0.9, Specular_IOR_Level=0.0)
    tree = material.node_tree
    glossy, mix, fresnel = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("BsdfGlossy", "MixShader", "Fresnel"))
    reroute, muted = tree.nodes.new("NodeReroute"), tree.nodes.new("ShaderNodeAddShader")
    glossy.inputs["Roughness"].default_value, muted.mute = 0.0, True
    links = tree.links
    links.new(fresnel.outputs[0], mix.inputs[0])
    links.new(tree.nodes["Principled BSDF"].outputs[0], mix.inputs[1])
    links.new(glossy.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], reroute.inputs[0])
    links.new(reroute.outputs[0], muted.inputs[0])
    links.new(muted.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    return material


def grouped(name: str) -> bpy.types.Material:
    """A Principled node in a group, its roughness an input of the group."""
    group = bpy.data.node_groups.new(f"{name} group", "ShaderNodeTree")
    group.interface.new_socket("Rough", in_out="INPUT", socket_type="NodeSocketFloat")
    group.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    given, result, node = (group.nodes.new(k) for k in ("NodeGroupInput", "NodeGroupOutput", "ShaderNodeBsdfPrincipled"))
    node.inputs["Metallic"].default_value = 1.0
    group.links.new(given.outputs[0], node.inputs["Roughness"])
    group.links.new(node.outputs[0], result.inputs[0])
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.remove(tree.nodes["Principled BSDF"])
    used = tree.nodes.new("ShaderNodeGroup")
    used.node_tree = group
    used.inputs[0].default_value = 0.05
    tree.links.new(used.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    return material


def animated(name: str) -> bpy.types.Material:
    """Colour and roughness keyed, metallic driven."""
    material = principled(name, Metallic=1.0)
    sockets = material.node_tree.nodes["Principled BSDF"].inputs
    for frame, color, roughness in ((1, (1, 0, 0, 1), 0.0), (11, (0, 0, 1, 1), 0.2)):
        sockets["Base Color"].default_value, sockets["Roughness"].default_value = color, roughness
        sockets["Base Color"].keyframe_insert("default_value", frame=frame)
        sockets["Roughness"].keyframe_insert("default_value", frame=frame)
    sockets["Coat Weight"].driver_add("default_value").driver.expression = "frame / 20"
    material.keyframe_insert("roughness", frame=1)
    return material


def ball(name: str, *materials, mesh=None, at=(0, 0, 0), segments=4) -> bpy.types.Object:
    if mesh is None:
        bpy.ops.mesh.primitive_uv_sphere_add(segments=segments, ring_count=segments - 1, radius=0.5)
        bpy.ops.object.shade_smooth()
        obj = bpy.context.object
        for material in materials:
            obj.data.materials.append(material)
        for k, polygon in enumerate(obj.data.polygons):
            polygon.material_index = k % max(len(materials), 1)
    else:
        obj = bpy.data.objects.new(name, mesh)
        bpy.context.scene.collection.objects.link(obj)
    obj.name, obj.location = name, at
    return obj


def everything() -> None:
    """Balls: two that share a mesh, one with its material on the object, several slots (one empty, one dull), groups, mixes,
    animation; a material is shared by several."""
    metal = principled("Metal", Metallic=1.0)
    first = ball("One", metal, at=(-3, 0, 0))
    ball("Twin", mesh=first.data, at=(-2, 0, 0))
    own = ball("Own", mesh=first.data, at=(-1, 0, 0))
    own.material_slots[0].link = "OBJECT"
    own.material_slots[0].material = principled("Lacquer", Coat_Weight=1.0, Coat_Roughness=0.0, Roughness=0.8)
    dull = principled("Dull", Roughness=0.9)
    many = ball("Many", dull, None, metal, mixed("Mixed"), at=(1, 0, 0))
    many.material_slots[0].link = "OBJECT"  # what the mesh has there is hidden
    many.material_slots[0].material = principled("Glass", Transmission_Weight=1.0, Roughness=0.0)
    many.material_slots[0].link = "DATA"  # ... and now what the object has
    ball("Group", grouped("Grouped"), at=(2, 0, 0))
    ball("Moves", animated("Animated"), at=(3, 0, 0))
    bpy.context.scene.frame_set(1)  # what is animated or driven has its value from now on


def snapshot_of(scene):
    with open_frame(scene, None) as snapshot:
        return snapshot


@cache
def room_assets() -> dict[str, Asset]:
    """A box room's, baked without Blender: what box_proxy requires, and its own."""
    room = trimesh.creation.box((8, 8, 8))
    room.invert()
    scene = mesh_scenes.snapshot(trimesh.creation.icosphere(2, 0.5), Room=room)
    made = {}
    for method in (environment, box_proxy):
        settings = {**method.DEFAULTS, "resolution": 16, "samples": 1, "sky_error": 0}
        made[method.NAME] = replace(method.bake(mesh_scenes.job(scene, settings, dict(made))), reflector="")
    return made


@cache
def room_asset() -> Asset:
    return room_assets()["box_proxy"].joined(room_assets()["environment"])


def apply(scene=None, **options):
    """use_in_materials with one asset for every reflector."""
    scene = scene or bpy.context.scene
    snapshot = snapshot_of(scene)
    asset = room_asset()
    given = {"assets": {r.name: asset for r in snapshot.reflectors()}, "method": "box_proxy", **options}
    return use_in_materials(scene, snapshot, **given)


def save_assets(scene) -> None:
    """Assets beside the file, as fresh as a bake of them would be."""
    snapshot = snapshot_of(scene)
    for reflector in snapshot.reflectors():
        for kind, asset in room_assets().items():
            asset = replace(asset, reflector=reflector.name)
            fresh = remembering(asset, snapshot, items_now(snapshot, asset, room_assets().values()), {})
            save_asset(fresh, assets_of(scene) / asset_name(kind, reflector.name))
