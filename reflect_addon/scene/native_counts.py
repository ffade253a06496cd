"""What a node group costs: its nodes and image look-ups once groups are inlined and Repeat zones unrolled, as Blender compiles them, and
its images."""

import bpy

_NOT_COMPILED = {"GROUP_INPUT", "GROUP_OUTPUT", "REROUTE", "FRAME", "REPEAT_INPUT", "REPEAT_OUTPUT"}


def nodes_of(tree: bpy.types.NodeTree) -> int:
    return _sum(tree, lambda node: node.type not in _NOT_COMPILED, {})


def look_ups_of(tree: bpy.types.NodeTree) -> int:
    """Image look-ups a ray."""
    return _sum(tree, lambda node: node.type == "TEX_IMAGE", {})


def images_of(tree: bpy.types.NodeTree) -> set[bpy.types.Image]:
    return {node.image for group in groups_of(tree) for node in group.nodes if node.type == "TEX_IMAGE" and node.image is not None}


def groups_of(tree: bpy.types.NodeTree) -> set[bpy.types.NodeTree]:
    """The group itself and all that are nested in it."""
    inside = {node.node_tree for node in tree.nodes if node.type == "GROUP"}
    return {tree}.union(*map(groups_of, inside))


def image_bytes(image: bpy.types.Image) -> int:
    """On the device: four channels of a half or a whole float."""
    return image.size[0] * image.size[1] * 4 * (2 if image.use_half_precision else 4)


def _sum(tree: bpy.types.NodeTree, counts, known: dict) -> int:
    """The number of nodes that count, each as often as its Repeat zones run."""
    if tree.name not in known:
        times = _repeats(tree)
        known[tree.name] = sum(
            times.get(node.name, 1) * (_sum(node.node_tree, counts, known) if node.type == "GROUP" else bool(counts(node))) for node in tree.nodes
        )
    return known[tree.name]


def _repeats(tree: bpy.types.NodeTree) -> dict[str, int]:
    """How often the nodes within Repeat zones run, by name: those that depend on the zone's input and that its output depends on."""
    after: dict[str, set[str]] = {}
    before: dict[str, set[str]] = {}
    for link in tree.links:
        after.setdefault(link.from_node.name, set()).add(link.to_node.name)
        before.setdefault(link.to_node.name, set()).add(link.from_node.name)
    out: dict[str, int] = {}
    for enter in [node for node in tree.nodes if node.bl_idname == "GeometryNodeRepeatInput"]:
        inside = _reached(after, enter.name) & _reached(before, enter.paired_output.name)
        for name in inside:
            out[name] = out.get(name, 1) * max(int(enter.inputs["Iterations"].default_value), 0)
    return out


def _reached(edges: dict[str, set[str]], start: str) -> set[str]:
    found: set[str] = set()
    pending = [start]
    while pending:
        for name in edges.get(pending.pop(), ()):
            if name not in found:
                found.add(name)
                pending.append(name)
    return found
