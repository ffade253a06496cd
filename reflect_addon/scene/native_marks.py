"""Marks that tell our data-blocks and nodes in a file from the artist's.

Problem. "Use in materials" puts copies of materials into slots; baking, snapshots and "Remove" must still know whose is what, in any session.
Idea. Custom properties, which need no add-on to be kept: a copy of a material points to the artist's, everything else of ours says so. What only
EEVEE reads is no part of what an asset was baked from (Cycles does that): a file with native reflections has the fingerprint of the one without.
"""

import bpy

ORIGINAL = "reflect_original"  # of a material of ours: the artist's
OURS = "reflect_native"  # of our groups, images, actions and nodes
NAME = "{} · Reflect"


def is_ours(block: bpy.types.ID) -> bool:
    return OURS in block or ORIGINAL in block


def original_of(material: bpy.types.Material | None) -> bpy.types.Material | None:
    """The artist's material behind one of ours; any other is its own."""
    kept = None if material is None else material.get(ORIGINAL)
    return kept if isinstance(kept, bpy.types.Material) else material


def is_for_eevee_alone(node: bpy.types.Node) -> bool:
    """Whether Cycles never looks at the node: one of ours, or an output for EEVEE."""
    return OURS in node or node.bl_idname == "ShaderNodeOutputMaterial" and node.target == "EEVEE"
