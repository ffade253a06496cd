"""A material's shader tree as EEVEE is to draw it, beside the artist's own, which stays for Cycles.

Problem. Mirror-like nodes lie anywhere below an output: in mixes, sums, groups, behind reroutes. Each must be replaced for EEVEE and none for Cycles, from
which truth and snapshots come.
Idea. Walk from the output down. A part without such a node is used by both outputs as it is. Mixes and sums on the way to one are made again; a group is
copied, and its output led to what stands for its inside. The new tree ends in an output of its own for EEVEE, which EEVEE prefers.
Limits. Shaders turned into colours (Shader to RGB) stay as they are.
"""

import bpy

from .native_animation import follow
from .native_lobes import stand_in
from .native_marks import NAME, OURS
from .native_sheet import Sheet, feeding
from .sockets import group_output

DEEPEST = 16  # groups in groups


def draw_with_group(material: bpy.types.Material, group: bpy.types.NodeTree, roughest: float) -> int:
    """Gives a copy of ours the tree that EEVEE draws: the number of nodes added there and in copied groups; 0 when nothing mirrors."""
    tree = material.node_tree
    sheet, rewriter = Sheet(tree, material, (), group), _Rewriter(group, roughest)
    artist = tree.get_output_node("EEVEE")
    made = rewriter.shader(sheet, artist.inputs["Surface"]) if artist else None
    if made is None:
        return 0
    if artist.target == "EEVEE":
        output = artist
    else:
        active = artist.is_active_output
        output = sheet.clone(artist)
        output.target, artist.is_active_output = "EEVEE", active  # one output can be active; EEVEE prefers its own all the same
    sheet.feed(output.inputs["Surface"], made)
    sheet.place(output)
    rewriter.sheets.append(sheet)
    for done in rewriter.sheets:
        follow(done.tree, done.owner, done.twins)
    return sum(OURS in node for done in rewriter.sheets for node in done.tree.nodes)


class _Rewriter:
    def __init__(self, group: bpy.types.NodeTree, roughest: float):
        self.group, self.roughest = group, roughest
        self.sheets: list[Sheet] = []  # of copied groups

    def shader(self, sheet: Sheet, socket):
        """The output that EEVEE takes where the artist's input is; None where the artist's does."""
        output = _source(socket)
        if output is None:
            return None
        key = (output.node.name, output.identifier)
        if key not in sheet.made:
            sheet.made[key] = self._made(sheet, output)
        return sheet.made[key]

    def _made(self, sheet: Sheet, output):
        node = output.node
        if node.bl_idname == "ShaderNodeGroup":
            return self._in_group(sheet, node, output) if node.node_tree and len(sheet.path) < DEEPEST else None
        if node.bl_idname in ("ShaderNodeMixShader", "ShaderNodeAddShader"):
            below = [self.shader(sheet, s) if s.type == "SHADER" else None for s in node.inputs]
            return self._again(sheet, node, below).outputs[0] if any(below) else None
        return stand_in(sheet, node, self.roughest)

    def _again(self, sheet: Sheet, node, below: list):
        made = sheet.clone(node)
        for socket, shader in zip(made.inputs, below):
            sheet.feed(socket, shader)
        return sheet.place(made)

    def _in_group(self, sheet: Sheet, node, output):
        inside = group_output(node.node_tree)
        below = [self.shader(sheet, s) if s.type == "SHADER" else None for s in node.inputs]
        if inside is None:
            return None
        made = self._again(sheet, node, below)
        tree = made.node_tree = node.node_tree.copy()
        tree.name, tree[OURS] = NAME.format(node.node_tree.name), True
        inner = Sheet(tree, None, (*sheet.path, made), self.group)
        end = next(s for s in group_output(tree).inputs if s.identifier == output.identifier)
        shader = self.shader(inner, end)
        if shader is None:
            bpy.data.node_groups.remove(tree)
            made.node_tree = node.node_tree
            if any(below):
                return next(s for s in made.outputs if s.identifier == output.identifier)
            sheet.tree.nodes.remove(made)
            return None
        inner.feed(end, shader)
        self.sheets.append(inner)
        return next(s for s in made.outputs if s.identifier == output.identifier)


def _source(socket):
    """The output that feeds a shader input: behind reroutes and muted nodes."""
    output = feeding(socket)
    while output is not None and (output.node.mute or output.node.bl_idname == "NodeReroute"):
        if output.node.mute:
            inner = [link.from_socket for link in output.node.internal_links if link.to_socket == output]
        else:
            inner = list(output.node.inputs)
        output = feeding(inner[0]) if inner else None
    return output
