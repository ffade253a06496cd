"""A method's node groups in the slots of its reflectors, for one of EEVEE's pictures; on a copy of the file that nobody saves.

What is judged is what a group answers along the pixel's mirror ray, not the pixel's colour. So each material carries two outputs of its own
beside the picture (shader AOVs): the radiance, and (distance, coverage, 1). EEVEE keeps both as half floats, so a distance is right to a
two-thousandth, and is told in diagonals of the scene, which keeps it from the ends of their range.
"""

from pathlib import Path

import bpy

from ..core import methods as registry
from ..core.asset import asset_of
from ..core.errors import ReflectError
from ..core.kernel import KernelError
from ..core.mirror_planes import is_mirror
from ..core.snapshot import Instance, Material, SceneSnapshot
from .bake import load_assets
from .eevee_job import Groups
from .native_counts import image_bytes, images_of, look_ups_of, nodes_of
from .reflection_group import reflection_group

RADIANCE, REACH = "Reflect Radiance", "Reflect Reach"
MOST = 6.0e4  # half floats end at 65504: a radiance and a distance in diagonals are cut here


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

    def put(self, scene: bpy.types.Scene, diagonal: float, straight: bool) -> None:
        """Puts a material with the asset's group into every slot that mirrors. straight: as if all were smooth, as judged rays are."""
        layer = next(layer for layer in scene.view_layers if layer.use)
        for name in (RADIANCE, REACH):
            if name not in layer.aovs:
                layer.aovs.add().name = name
        made: dict[tuple, bpy.types.Material] = {}
        try:
            for instance in self.snapshot.reflectors():
                asset = asset_of(self.assets, instance)
                if asset is None:
                    self.notes.append(f"No asset answers for: {instance.name}.")
                    continue
                if id(asset) not in self._trees:
                    self._trees[id(asset)] = reflection_group(asset, f"Reflect {self.method} {instance.object_name}")
                for slot, index in _slots(self.snapshot, instance):
                    key = (id(asset), index)
                    if key not in made:
                        made[key] = _material(self._trees[id(asset)], self.snapshot.materials[index], diagonal, straight)
                    self._before.append((slot, slot.link, slot.material))
                    slot.link = "OBJECT"
                    slot.material = made[key]
        except (ReflectError, KernelError) as error:
            self.error = f"{self.method} has no node group: {error}"
            self.take_away(scene)

    def counts(self) -> dict:
        trees = list(self._trees.values())
        images = {image for tree in trees for image in images_of(tree)}
        return {
            "nodes": max(map(nodes_of, trees), default=0),
            "look_ups": max(map(look_ups_of, trees), default=0),
            "images": max((len(images_of(tree)) for tree in trees), default=0),
            "image_bytes": sum(map(image_bytes, images)),
            "groups": len(trees),
        }

    def take_away(self, scene: bpy.types.Scene) -> None:
        """The slots as they were; groups and images of this method go, which are large."""
        images = {image for tree in self._trees.values() for image in images_of(tree)}
        for slot, link, material in reversed(self._before):
            ours = slot.material
            slot.material, slot.link = None, link
            slot.material = material
            if ours is not None and ours.users == 0:
                bpy.data.materials.remove(ours)
        for block, owner in ((self._trees.values(), bpy.data.node_groups), (images, bpy.data.images)):
            for one in list(block):
                owner.remove(one)
        self._trees, self._before = {}, []


def why_none(method: str) -> str | None:
    """The sentence why a method can have no node group; None for those that can."""
    if method in registry.gathering():
        return None
    return f"{method} draws the scene itself and has no node group: what a material is asked it cannot answer."


def _slots(snapshot: SceneSnapshot, instance: Instance) -> list[tuple[bpy.types.MaterialSlot, int]]:
    """The object's slots that mirror, each with its material's index in the snapshot."""
    obj = bpy.data.objects[instance.object_name]
    if not obj.material_slots:  # marked by hand, without a material
        obj.data.materials.append(None)
    shown = zip(obj.material_slots, instance.materials, strict=False)
    return [(slot, index) for slot, index in shown if is_mirror(snapshot.materials[index], instance)]


def _material(group: bpy.types.NodeTree, look: Material, diagonal: float, straight: bool) -> bpy.types.Material:
    material = bpy.data.materials.new(f"{look.name} {group.name}")
    tree = material.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    values = {
        "Roughness": 0.0 if straight else look.roughness, "Base Color": (*look.base_color, 1.0), "Metallic": look.metallic,
        "Specular Tint": (*look.specular_tint, 1.0), "IOR": look.ior, "Weight": look.specular_weight,
    }  # fmt: skip
    for name, value in values.items():
        node.inputs[name].default_value = value
    tree.links.new(node.outputs["Surface"], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    bounded = tree.nodes.new("ShaderNodeVectorMath")
    bounded.operation, bounded.inputs[1].default_value = "MINIMUM", (MOST,) * 3
    tree.links.new(node.outputs["Radiance"], bounded.inputs[0])
    near, away, told = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Math", "Math", "CombineXYZ"))
    near.operation, near.inputs[1].default_value = "MULTIPLY", 1.0 / diagonal
    away.operation, away.inputs[1].default_value = "MINIMUM", MOST
    told.inputs[2].default_value = 1.0
    tree.links.new(node.outputs["Distance"], near.inputs[0])
    tree.links.new(near.outputs[0], away.inputs[0])
    tree.links.new(away.outputs[0], told.inputs[0])
    tree.links.new(node.outputs["Coverage"], told.inputs[1])
    for name, socket in ((RADIANCE, bounded.outputs[0]), (REACH, told.outputs[0])):
        output = tree.nodes.new("ShaderNodeOutputAOV")
        output.aov_name = name
        tree.links.new(socket, output.inputs["Color"])
    return material
