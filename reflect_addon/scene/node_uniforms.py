"""How much of a graphics card's uniform block a shader's nodes take, counted without compiling it.

Problem. Blender puts the value of each input that nothing is plugged into in one uniform block, inputs that a node does not use among them, and OpenGL
promises 64 KB of it. A shader that needs more does not link: EEVEE shows nothing of its material, and only the log says so.
Idea. Groups are inlined, so a tree's inputs are those of all that it calls, as often as it is called. A vector takes 16 bytes, a number 4.
Limits. Nodes that no output asks for are counted and never compiled. Fitted to the one size that a driver told (node groups of moving depth maps,
67,104 bytes): that took 16 bytes more than their inputs for each Separate XYZ and each image; 24 bytes remain unexplained.
"""

import bpy

MOST_BYTES = 65536  # what graphics cards and software OpenGL hold; one that holds more cannot be counted on, files go to others' machines
BYTES = {"VALUE": 4, "INT": 4, "BOOLEAN": 4, "VECTOR": 16, "RGBA": 16}
MORE = {"ShaderNodeSeparateXYZ": 16, "ShaderNodeTexImage": 16}
OUTPUT = ("ShaderNodeValue", "ShaderNodeRGB")  # their outputs are values too


def uniform_bytes(tree: bpy.types.NodeTree) -> int:
    """Of a material's tree or a group, with all that it calls."""
    return _inlined(tree, {})


def too_large(tree: bpy.types.NodeTree) -> str | None:
    """What is to be said of a material's tree whose shader would not link; None where it would."""
    found = uniform_bytes(tree)
    if found <= MOST_BYTES:
        return None
    return f"its shader would need {found / 1024:.0f} KB of constants, and graphics cards promise {MOST_BYTES // 1024}"


def _inlined(tree: bpy.types.NodeTree, known: dict[str, int]) -> int:
    """known: of groups, by name."""
    found = 0
    for node in tree.nodes:
        sockets = [s for s in node.inputs if not s.is_linked]
        if node.bl_idname in OUTPUT:
            sockets += node.outputs
        found += sum(BYTES.get(s.type, 0) for s in sockets) + MORE.get(node.bl_idname, 0)
        if node.bl_idname == "ShaderNodeGroup" and (called := node.node_tree) is not None:
            if called.name_full not in known:
                known[called.name_full] = _inlined(called, known)
            found += known[called.name_full]
    return found
