"""A method's node groups in the slots of its reflectors, to be judged in EEVEE ray by ray; on a copy of the file that nobody saves.

What artists see is native_materials.py's. What is judged is what a group answers along the pixel's mirror ray, not the pixel's colour. So for one picture each slot gets a material that is
the group alone, as of a smooth surface, with outputs beside the picture (shader AOVs): the radiance, the way to the point that is shown, and (coverage, 1). EEVEE keeps them as half floats, so a
way is right to a two-thousandth; it is told in diagonals of the scene, which keeps it from the ends of their range.
"""

from pathlib import Path

import bpy

from ..core import methods as registry
from ..core.asset import asset_of
from ..core.errors import ReflectError
from ..core.kernel import KernelError
from ..core.mirror_planes import is_mirror
from ..core.snapshot import Instance, SceneSnapshot
from .eevee_job import Groups
from .kernel_nodes import Alike
from .load import load_assets
from .native_plan import instead_of_views
from .node_report import describe_group, groups_of, image_bytes, images_of
from .node_uniforms import too_large
from .reflection_group import reflection_group

RADIANCE, WAY, FLAGS = "Reflect Radiance", "Reflect Way", "Reflect Flags"
MOST = 6.0e4  # half floats end at 65504: a radiance and a way in diagonals are cut here


class Native:
    """One method's groups. `error`: the sentence why there are none."""

    def __init__(self, groups: Groups, snapshot: SceneSnapshot):
        self.method, self.snapshot, self.notes = groups.method, snapshot, []
        self.assets, self._trees, self._before = {}, {}, []
        self.error = why_none(self.method)
        if self.error is not None:
            return
        self.assets = load_assets(snapshot, self.method, Path(groups.folder))
        if not self.assets:
            self.error = f"{groups.folder} holds no asset of {self.method}."

    def put(self, scene: bpy.types.Scene, diagonal: float) -> None:
        """Puts a material with the asset's group into every slot that mirrors."""
        layer = next(layer for layer in scene.view_layers if layer.use)
        for name in (RADIANCE, WAY, FLAGS):
            if name not in layer.aovs:
                layer.aovs.add().name = name
        made: dict[int, bpy.types.Material] = {}
        alike: Alike = {}
        try:
            for instance in self.snapshot.reflectors():
                asset = asset_of(self.assets, instance)
                if asset is None:
                    self.notes.append(f"No asset answers for: {instance.name}.")
                    continue
                if said := instead_of_views(instance.name, asset):
                    self.notes.append(said)
                if id(asset) not in self._trees:
                    name = f"Reflect {self.method} {instance.object_name}"
                    self._trees[id(asset)] = with_position(reflection_group(asset, name, rough=False, alike=alike))
                    made[id(asset)] = _material(self._trees[id(asset)], diagonal)
                if large := too_large(made[id(asset)].node_tree):
                    self.notes.append(f"{instance.name} is not drawn: {large}.")
                    continue
                for slot in _slots(self.snapshot, instance):
                    self._before.append((slot, slot.link, slot.material))
                    slot.link = "OBJECT"
                    slot.material = made[id(asset)]
        except (ReflectError, KernelError) as error:
            self.error = f"{self.method} has no node group: {error}"
            self.take_away()

    def counts(self) -> dict:
        reports = [describe_group(tree) for tree in self._trees.values()]
        return {
            "nodes": max((r.inlined for r in reports), default=0),
            "look_ups": max((r.look_ups for r in reports), default=0),
            "images": max((len(r.images) for r in reports), default=0),
            "image_bytes": sum(map(image_bytes, set().union(*map(images_of, self._trees.values())))),
            "groups": len(reports),
        }

    def take_away(self) -> None:
        """The slots as they were; groups and images of this method go, which are large."""
        images = {image for tree in self._trees.values() for image in images_of(tree)}
        for slot, link, material in reversed(self._before):
            ours = slot.material
            slot.material, slot.link = None, link
            slot.material = material
            if ours is not None and ours.users == 0:
                bpy.data.materials.remove(ours)
        groups = set().union(*map(groups_of, self._trees.values()))
        for blocks, owner in ((groups, bpy.data.node_groups), (images, bpy.data.images)):
            for one in blocks:
                owner.remove(one)
        self._trees, self._before = {}, []


def why_none(method: str) -> str | None:
    """The sentence why a method can have no node group; None for those that can."""
    if method in (*registry.gathering(), registry.AUTO):
        return None
    return f"{method} draws the scene itself and has no node group: what a material is asked it cannot answer."


def _slots(snapshot: SceneSnapshot, instance: Instance) -> list[bpy.types.MaterialSlot]:
    """The object's slots that mirror."""
    obj = bpy.data.objects[instance.object_name]
    if not obj.material_slots:  # marked by hand, without a material
        obj.data.materials.append(None)
    shown = zip(obj.material_slots, instance.materials, strict=False)
    return [slot for slot, index in shown if is_mirror(snapshot.materials[index], instance)]


def _material(group: bpy.types.NodeTree, diagonal: float) -> bpy.types.Material:
    material = bpy.data.materials.new(group.name)
    tree = material.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.inputs["Roughness"].default_value = 0.0
    tree.links.new(node.outputs["Surface"], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    place = tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"]
    way = _math(tree, "SUBTRACT", node.outputs["Position"], place)
    way = _math(tree, "SCALE", way, 1.0 / diagonal)
    # Shortened where it is too long, in its direction: 1 / max(length / MOST, 1).
    longer = _math(tree, "SCALE", way, 1.0 / MOST)
    share = tree.nodes.new("ShaderNodeMath")
    share.operation, share.inputs[1].default_value = "MAXIMUM", 1.0
    tree.links.new(_math(tree, "LENGTH", longer), share.inputs[0])
    divided = tree.nodes.new("ShaderNodeMath")
    divided.operation, divided.inputs[0].default_value = "DIVIDE", 1.0
    tree.links.new(share.outputs[0], divided.inputs[1])
    flags = tree.nodes.new("ShaderNodeCombineXYZ")
    flags.inputs[1].default_value = 1.0
    tree.links.new(node.outputs["Coverage"], flags.inputs[0])
    told = {
        RADIANCE: _math(tree, "MINIMUM", node.outputs["Radiance"], (MOST,) * 3),
        WAY: _math(tree, "SCALE", way, divided.outputs[0]),
        FLAGS: flags.outputs[0],
    }
    for name, socket in told.items():
        output = tree.nodes.new("ShaderNodeOutputAOV")
        output.aov_name = name
        tree.links.new(socket, output.inputs["Color"])
    return material


def with_position(group: bpy.types.NodeTree) -> bpy.types.NodeTree:
    """The group with one more output, which it has but does not show: the point whose radiance it tells."""
    (trace,) = (node for node in group.nodes if node.type == "GROUP" and "Position" in node.outputs)
    group.interface.new_socket(name="Position", in_out="OUTPUT", socket_type="NodeSocketVector")
    (end,) = (node for node in group.nodes if node.type == "GROUP_OUTPUT")
    group.links.new(trace.outputs["Position"], end.inputs["Position"])
    return group


def _math(tree: bpy.types.NodeTree, operation: str, first, second=None):
    """The result of a Vector Math node; operands are sockets or values."""
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    second_at = node.inputs["Scale"] if operation == "SCALE" else node.inputs[1]
    for socket, source in ((node.inputs[0], first), (second_at, second)):
        if isinstance(source, bpy.types.NodeSocket):
            tree.links.new(source, socket)
        elif source is not None:
            socket.default_value = source
    return node.outputs["Value" if operation == "LENGTH" else "Vector"]
