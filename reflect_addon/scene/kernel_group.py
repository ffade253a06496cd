"""Kernel functions that materials need beside a method's, as node groups of the file, made once each."""

import bpy

from ..core import shading
from ..core.asset import Asset
from ..core.kernel import record_function
from .kernel_nodes import emit_nodes
from .native_marks import OURS

IOR = "Reflect IOR"


def ior_group() -> bpy.types.NodeTree:
    """Ior, Level -> Ior: the index that a Principled node's specular level makes of its own."""
    if (found := bpy.data.node_groups.get(IOR)) is not None and found.library is None:
        return found
    made = emit_nodes(record_function(shading.leveled_ior, shading.LEVELED_INPUTS), Asset("", "", {}), IOR, ("ior",))
    made[OURS] = True
    return made
