"""One evaluated object's mesh as arrays, read in bulk, and cleaned of what no ray can meet."""

import numpy as np

from ..core.snapshot import Mesh

# A triangle thinner than this share of its longest side is a line: rounding of float32 corners moves it more.
THINNEST = 1e-7


def read_mesh(mesh, mirrored: bool) -> tuple[Mesh, list[str]]:
    """(Mesh, what was left out and why) of a bpy.types.Mesh.

    mirrored: turn the triangles around, for instances of negative scale, so that they wind counter-clockwise as seen
    from their front in world space too. Vertices without a face are dropped; normals of no length become the face's.
    """
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    positions = _bulk(mesh.vertices, "co", (len(mesh.vertices), 3), np.float32)
    triangles = _bulk(mesh.loop_triangles, "vertices", (count, 3), np.int32)
    loops = _bulk(mesh.loop_triangles, "loops", (count, 3), np.int32)
    polygons = _bulk(mesh.loop_triangle_polygons, "value", (count,), np.int32)
    normals = _bulk(mesh.corner_normals, "vector", (len(mesh.corner_normals), 3), np.float32)
    slots = _bulk(mesh.polygons, "material_index", (len(mesh.polygons),), np.int32)

    notes = []
    corners = positions[triangles].astype(np.float64)
    finite = np.isfinite(corners).all((1, 2))
    if not finite.all():
        notes.append(f"{np.count_nonzero(~finite)} faces with corners that are not finite numbers")
    # Scaled by the longest side, so that extents of 1e38 do not overflow.
    with np.errstate(invalid="ignore", over="ignore"):
        sides = corners[:, [1, 2, 0]] - corners
        longest = np.abs(sides).max((1, 2))[:, None]
        unit = np.divide(sides, longest[..., None], out=np.zeros_like(sides), where=(longest > 0)[..., None])
        face_normal = np.cross(unit[:, 0], unit[:, 1])
        area = np.linalg.norm(face_normal, axis=1)
    keep = finite & (area > THINNEST)
    triangles, loops, face_normal = triangles[keep], loops[keep], face_normal[keep] / area[keep, None]

    corner_normals = normals[loops]
    length = np.linalg.norm(corner_normals, axis=-1, keepdims=True)
    good = np.isfinite(length) & (length > 1e-6)
    corner_normals = np.where(good, corner_normals / np.where(good, length, 1), face_normal[:, None])
    used, triangles = np.unique(triangles, return_inverse=True)
    order = [0, 2, 1] if mirrored else [0, 1, 2]
    return (
        Mesh(
            positions[used],
            triangles.reshape(-1, 3)[:, order].astype(np.int32),
            corner_normals[:, order].astype(np.float32),
            slots[polygons[keep]],
        ),
        notes,
    )


def _bulk(collection, attribute: str, shape: tuple[int, ...], dtype) -> np.ndarray:
    values = np.empty(int(np.prod(shape)), dtype)
    collection.foreach_get(attribute, values)
    return values.reshape(shape)
