"""Parts of Suzanne as Blender evaluates her, through the snapshot that a bake sees."""

import numpy as np
import pytest
import reflector_shapes as shapes
from tolerances import PART_COVER, PART_NORMAL, PART_PLACE

from reflect_addon.core.reflector_parts import left_out, part_surface, parts_of
from reflect_addon.scene.snapshot import take_snapshot


@pytest.mark.parametrize("levels", [0, 2])
def test_suzanne_is_covered_by_sixteen_parts(fresh_file, rng, levels):
    bpy = fresh_file
    bpy.ops.mesh.primitive_monkey_add(location=(3, -2, 1), rotation=(0.3, 0.2, 1.0))
    bpy.ops.object.shade_smooth()
    if levels:
        bpy.context.object.modifiers.new("Smooth", "SUBSURF").levels = levels
    scene = take_snapshot(bpy.context.evaluated_depsgraph_get())
    instance = scene.instances[0]
    own = scene.meshes[instance.mesh]
    turn = instance.world_from_object[:3, :3]
    mesh = scene.world_positions(instance), own.triangles, own.corner_normals @ turn.T
    parts = parts_of(*mesh)
    which, weight, point = shapes.points_on(rng, mesh, 3000)
    normal = np.einsum("nk,nkx->nx", weight, mesh[2][which])
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    back = np.zeros(len(point), bool)
    for part in parts:
        distance, found, inside = part_surface(part, *mesh)(point - part.center)
        near = np.abs(distance - np.linalg.norm(point - part.center, axis=-1)) < PART_PLACE * np.ptp(mesh[0], axis=0).max()
        back |= inside & near & (np.abs((found * normal).sum(-1)) > np.cos(PART_NORMAL))
    assert len(parts) <= 16 and {"convex", "saddle"} <= {p.kind for p in parts}
    assert back.mean() >= PART_COVER["model"] and left_out(parts, *mesh[:2]) <= 1 - PART_COVER["model"]
