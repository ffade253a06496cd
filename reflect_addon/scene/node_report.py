"""What a node group costs, in numbers that people can compare: nodes, look-ups, zones, images, memory.

Blender inlines groups when it makes a shader, so a nested group counts as often as it is called. EEVEE keeps Repeat zones as loops: what is in
one is written once and runs as often as a ray needs, which no count of nodes tells; Cycles unrolls them and takes no counts that differ per ray.
"""

from collections import Counter
from dataclasses import dataclass

import bpy

NOT_INLINED = ("NodeFrame", "NodeReroute", "NodeGroupInput", "NodeGroupOutput", "ShaderNodeGroup")


@dataclass(frozen=True)
class GroupReport:
    """own: nodes in the group itself; groups: nested ones, each once; inlined: nodes of the shader; look_ups, zones: among these;
    images: names of the data-blocks; megabytes: of graphics memory that they take; cycles: whether Cycles can run it, too."""

    own: int
    groups: int
    inlined: int
    look_ups: int
    zones: int
    images: tuple[str, ...]
    megabytes: float
    cycles: bool

    def sentence(self) -> str:
        """For the panel and the command line."""
        images = f"{len(self.images)} image{'s' * (len(self.images) != 1)} ({self.megabytes:.1f} MB)"
        where = "EEVEE and Cycles" if self.cycles else "EEVEE"
        return f"{self.inlined} nodes in {self.groups + 1} groups, {self.look_ups} image look-ups, {self.zones} loops and branches, {images}, for {where}"


def describe_group(tree: bpy.types.NodeTree) -> GroupReport:
    """Of a group and all that it calls."""
    nested = groups_of(tree)
    counts = _inlined(tree, {})
    images = sorted(images_of(tree), key=lambda image: image.name)
    own = sum(node.bl_idname != "NodeFrame" for node in tree.nodes)
    enters = [n for group in nested for n in group.nodes if n.bl_idname == "GeometryNodeRepeatInput"]
    return GroupReport(
        own, len(nested) - 1, sum(counts.values()), counts["ShaderNodeTexImage"], counts["GeometryNodeRepeatInput"],
        tuple(image.name for image in images), sum(map(image_bytes, images)) / 1e6, not any(n.inputs["Iterations"].is_linked for n in enters),
    )  # fmt: skip


def groups_of(tree: bpy.types.NodeTree) -> list[bpy.types.NodeTree]:
    """The group and all that it calls, each once."""
    found, pending = [tree], [tree]
    while pending:
        for node in pending.pop().nodes:
            if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None and node.node_tree not in found:
                found.append(node.node_tree)
                pending.append(node.node_tree)
    return found


def images_of(tree: bpy.types.NodeTree) -> set[bpy.types.Image]:
    """The images that a group and all that it calls read."""
    return {n.image for group in groups_of(tree) for n in group.nodes if n.bl_idname == "ShaderNodeTexImage" and n.image is not None}


def image_bytes(image: bpy.types.Image) -> int:
    """On the device: four channels of a half or a whole float."""
    return image.size[0] * image.size[1] * (8 if image.use_half_precision else 16)


def _inlined(tree: bpy.types.NodeTree, known: dict[str, Counter]) -> Counter:
    """Type of node -> how many a shader has of it."""
    if tree.name not in known:
        known[tree.name] = counts = Counter()
        for node in tree.nodes:
            if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
                counts.update(_inlined(node.node_tree, known))
            elif node.bl_idname not in NOT_INLINED:
                counts[node.bl_idname] += 1
    return known[tree.name]
