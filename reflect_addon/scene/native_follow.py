"""Drivers that tell a node group where things are now, so that their stand-ins follow in a Blender without the add-on.

Problem. What core/moved_rows.py moves rows by are uniforms; nobody sets them from frame to frame where the add-on is not.
Idea. Each number of a motion is a driven value: a sum of numbers of the object's `matrix_world` times constants, which hold where the
object was when its stand-ins were made. Such sums are what Blender calls simple expressions: it computes them itself, also where scripts in
files may not run, as on a render farm. All of one object lie in one group, in a frame with its name.
Only what may move gets drivers: objects that are animated, driven, constrained, simulated as rigid bodies, or children of such. Drivers
are on groups of ours alone; the object is named by them and not changed, and has no user more.
Limits. Duplis have no object of their own, and meshes that deform keep their baked shape. An object that is moved by hand and not animated
stays where it was baked; so does one that is hidden from a render, whose place drivers still know: it stays to be seen.
"""

import bpy
import numpy as np

from ..core.asset import Asset
from ..core.moved_rows import with_movers
from ..core.row_motion import AXES, uniform_name
from .native_animation import bags
from .node_tree import TreeBuilder

PLACES = ("location", "rotation", "scale", "delta_")  # how paths of an object's place begin
TERMS = "abcd"  # variables of an expression: a column of the matrix's numbers each


def moving_objects(scene: bpy.types.Scene) -> dict[str, bpy.types.Object]:
    """By name, the scene's objects whose place may change from frame to frame."""
    return {obj.name: obj for obj in scene.objects if may_move(obj)}


def may_move(obj: bpy.types.Object) -> bool:
    if obj.rigid_body is not None and (obj.rigid_body.type == "ACTIVE" or obj.rigid_body.kinematic):
        return True
    if any(not constraint.mute and constraint.influence > 0 for constraint in obj.constraints) or _is_animated(obj):
        return True
    if obj.parent is None:
        return False
    # A bone or a vertex of the parent moves by what animates more than the parent's place.
    by_part = obj.parent_type != "OBJECT" and (obj.parent.animation_data is not None or len(obj.parent.modifiers) > 0)
    return by_part or may_move(obj.parent)


def _is_animated(obj: bpy.types.Object) -> bool:
    animation = obj.animation_data
    if animation is None:
        return False
    curves = (curve for _, _, bag in bags(animation) for curve in bag.fcurves)
    return any(curve.data_path.startswith(PLACES) for curve in (*curves, *animation.drivers))


def following(scene: bpy.types.Scene, asset: Asset, name: str) -> tuple[Asset, dict[str, bpy.types.NodeTree]]:
    """(the asset whose kernel takes motions, uniform -> the new group that says it) of what of it moves; the asset and nothing where
    nothing does."""
    moving = moving_objects(scene)
    asset, names = with_movers(asset, moving)
    parts = {part.instance: part for part in asset.parts}
    driven: dict[str, bpy.types.NodeTree] = {}
    for number, instance in enumerate(names):
        if instance in moving:
            tree = _motion_group(f"{name} follows {instance}", number, moving[instance], parts[instance].matrix(), asset.uniforms["center"])
            driven |= {uniform_name(number, axis): tree for axis in AXES}
    return asset, driven


def _motion_group(name: str, number: int, obj: bpy.types.Object, baked: np.ndarray, center) -> bpy.types.NodeTree:
    """now_from_baked relative to `center`, a row in each output and its last number in the output beside it; see moved_rows.motion_uniforms."""
    object_from_baked = np.linalg.inv(baked)
    object_from_baked[:3, 3] += object_from_baked[:3, :3] @ np.asarray(center, np.float64)
    build = TreeBuilder(name)
    build.section(f"where {obj.name} is, from where it was baked")
    outputs = []
    for row, axis in enumerate(AXES):
        label = uniform_name(number, axis)
        build.socket(label, "Vector", is_output=True)
        build.socket(f"{label} w", "Float", is_output=True)
        turned, moved = build.finish(build.node("ShaderNodeCombineXYZ", label)), build.finish(build.node("ShaderNodeValue", f"{label} w"))
        for column in range(3):
            _drive(turned.inputs[column], obj, row, (*object_from_baked[:3, column], 0.0), 0.0)
        _drive(moved.outputs[0], obj, row, (*object_from_baked[:3, 3], 1.0), -float(center[row]))
        outputs += [turned.outputs[0], moved.outputs[0]]
    build.results(*outputs)
    return build.tree


def _drive(socket, obj: bpy.types.Object, row: int, factors, constant: float) -> None:
    """socket = the sum of the factors (4) times the numbers of a row of the object's matrix, plus the constant."""
    driver = socket.driver_add("default_value").driver
    terms = []
    for column, (term, factor) in enumerate(zip(TERMS, factors)):
        if factor == 0.0:
            continue
        variable = driver.variables.new()
        variable.name, variable.type = term, "SINGLE_PROP"
        variable.targets[0].id = obj
        variable.targets[0].data_path = f"matrix_world[{column}][{row}]"  # paths name a column first
        terms.append(f"{term}*{float(factor)!r}")
    driver.expression = " + ".join([*terms, repr(constant)])
