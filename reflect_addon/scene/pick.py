"""What is seen where a ray meets the scene: itself, or in a mirror what the mirror shows there."""

from collections.abc import Collection

import bpy
import numpy as np
from mathutils import Vector
from mathutils.interpolate import poly_3d_calc

# A mirrored ray starts this far before the mirror, as a share of its distance from the eye.
LIFT = 1e-5


def pick(depsgraph: bpy.types.Depsgraph, origin, direction, mirrors: Collection[str]) -> tuple[np.ndarray | None, str]:
    """((3,) float64 world place that is seen along a ray, None for the sky; name of the mirror in which, "" for none).

    mirrors: names of objects that are looked into; a second mirror in the first is a place like any other."""
    origin, direction = Vector(origin), Vector(direction).normalized()
    hit, place, normal, face, obj, matrix = depsgraph.scene.ray_cast(depsgraph, origin, direction)
    if not hit:
        return None, ""
    name = obj.original.name
    if name not in mirrors:
        return np.array(place), ""
    normal = _shading_normal(obj.evaluated_get(depsgraph), matrix, face, place) or normal
    if normal.dot(direction) > 0:
        normal = -normal
    start = place + normal * (LIFT * (place - origin).length)
    hit, place, *_ = depsgraph.scene.ray_cast(depsgraph, start, direction.reflect(normal))
    return (np.array(place) if hit else None), name


def _shading_normal(obj: bpy.types.Object, matrix, face: int, place: Vector) -> Vector | None:
    """World, unit: the corners' normals of a face, interpolated; None where Blender does not know the face."""
    mesh = obj.data
    if not isinstance(mesh, bpy.types.Mesh) or not 0 <= face < len(mesh.polygons):
        return None
    polygon = mesh.polygons[face]
    corners = [mesh.vertices[v].co for v in polygon.vertices]
    weights = poly_3d_calc(corners, matrix.inverted_safe() @ place)
    mean = sum((mesh.corner_normals[c].vector * w for c, w in zip(polygon.loop_indices, weights, strict=True)), Vector())
    world = matrix.to_3x3().inverted_safe().transposed() @ mean
    return world.normalized() if world.length > 0 else None
