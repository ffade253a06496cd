"""Surface radiance as arrays: per instance a mesh with a colour at its vertices, and the asset that holds them all.

Vertices are kept in object space and also as barycentric coordinates of the object's own triangles: a rigid motion needs
the object's matrix alone, a deformation the deformed mesh. The asset is one for the scene (its reflector is ""), since
what surfaces send out is nobody's in particular; its parts say which row of `surface_instances_buf` is whose.
"""

from dataclasses import dataclass, replace

import numpy as np

from .asset import Asset
from .errors import ReflectError
from .mirrors import mirror_of
from .remake import part_of, same_triangles
from .snapshot import Instance, Mesh, SceneSnapshot

KIND = "surface_radiance"
TRIANGLE_BYTES = 120  # on the GPU: three corners, ten floats each
COLUMNS = 1024  # vertices in a row of the vertex table, triangles in one of the triangle table
# Texels of a vertex: xyz position, m, w its side times (1 + its face); xyz normal, w and w of the next the first two of
# its weights; xyz radiance.
VERTEX_TEXELS = 3
# Whole numbers up to here are exact in a float32.
MOST = 1 << 24


@dataclass(frozen=True)
class SurfaceMesh:
    """One instance's surface in object space. V vertices, T triangles that wind counter-clockwise as seen."""

    positions: np.ndarray  # (V, 3) float32, m
    normals: np.ndarray  # (V, 3) float32, towards the seen side
    radiance: np.ndarray  # (V, 3) float32, scene-linear
    triangles: np.ndarray  # (T, 3) int32
    face: np.ndarray  # (V,) int32: triangle of the instance's own mesh ...
    weights: np.ndarray  # (V, 3) float32: ... where in it, barycentric ...
    side: np.ndarray  # (V,) float32: ... and on which side of it, 1 or -1
    faces: int  # how many triangles that mesh had ...
    mesh: str  # ... and its Mesh.key

    def on(self, mesh: Mesh) -> "SurfaceMesh | None":
        """The same radiance on the deformed mesh; None when that one has another number of triangles or vertices."""
        if mesh.key == self.mesh:
            return self
        if len(mesh.triangles) != self.faces or not same_triangles(mesh.key, self.mesh):
            return None
        positions, normals = on_faces(mesh, self.face, self.weights, self.side)
        return replace(self, positions=positions, normals=normals, mesh=mesh.key)

    def bytes(self) -> int:
        """On the GPU."""
        return TRIANGLE_BYTES * len(self.triangles)

    def share(self, scene: SceneSnapshot, instance: Instance) -> np.ndarray | None:
        """(V,) float32: 1 where the vertex belongs to a part of the instance that mirrors, else 0; None when the mesh has other
        triangles than this one was made from and only some of them mirror."""
        mirror = mirror_of(scene, instance)
        if mirror is None or mirror.whole:
            return np.full(len(self.positions), float(mirror is not None), np.float32)
        if len(scene.meshes[instance.mesh].triangles) != self.faces:
            return None
        return np.isin(scene.slots(instance)[self.face], mirror.slots).astype(np.float32)


def on_faces(mesh: Mesh, face: np.ndarray, weights: np.ndarray, side: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """((V, 3) float32 positions, (V, 3) float32 unit normals times side) of points on a mesh's triangles."""
    weights = weights.astype(np.float64)
    positions = np.einsum("vk,vkx->vx", weights, mesh.positions[mesh.triangles[face]].astype(np.float64))
    normals = np.einsum("vk,vkx->vx", weights, mesh.corner_normals[face].astype(np.float64))
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    normals = side[:, None] * normals / np.where(length > 0, length, 1)
    return positions.astype(np.float32), normals.astype(np.float32)


def asset_of(scene: SceneSnapshot, meshes: dict[str, SurfaceMesh], settings: dict[str, object]) -> Asset:
    """The asset of all instances' meshes, by instance name. ReflectError when they are more than a table can hold."""
    vertices, triangles = [np.zeros((0, VERTEX_TEXELS, 4), np.float32)], [np.zeros((0, 4), np.float32)]
    rows = np.zeros((max(len(meshes), 1), 2, 4), np.float32)
    first_vertex = first_triangle = 0
    for row, mesh in zip(rows, meshes.values(), strict=False):
        table = np.zeros((len(mesh.positions), VERTEX_TEXELS, 4), np.float32)
        table[:, 0, :3], table[:, 1, :3], table[:, 2, :3] = mesh.positions, mesh.normals, mesh.radiance
        table[:, 0, 3], table[:, 1:, 3] = mesh.side * (1 + mesh.face), mesh.weights[:, :2]
        vertices.append(table)
        triangles.append(np.pad(mesh.triangles.astype(np.float32), ((0, 0), (0, 1))))
        row[0] = first_vertex, len(mesh.positions), first_triangle, len(mesh.triangles)
        row[1, 0] = mesh.faces
        first_vertex, first_triangle = first_vertex + len(mesh.positions), first_triangle + len(mesh.triangles)
    if max(first_vertex, first_triangle) >= MOST:
        raise ReflectError(
            f"The surfaces of scene '{scene.scene_name}' have {first_triangle:,} triangles, too many to follow.",
            "Bake with live=false or simplify the largest meshes.",
        )
    named = scene.named()
    return Asset(
        KIND,
        "",
        {
            "surface_vertices_buf": _in_rows(np.concatenate(vertices)),
            "surface_triangles_buf": _in_rows(np.concatenate(triangles)[:, None]),
            "surface_instances_buf": rows,
        },
        settings=dict(settings),
        parts=tuple(part_of(scene, named[name], "surface", row) for row, name in enumerate(meshes)),
        light_hash=scene.light_hash,
    )


def meshes_of(asset: Asset) -> dict[str, SurfaceMesh]:
    """The meshes of an asset by instance name. ReflectError where its tables contradict each other."""
    try:
        vertices = asset.images["surface_vertices_buf"].reshape(-1, VERTEX_TEXELS, 4)
        triangles = asset.images["surface_triangles_buf"].reshape(-1, 4)
        rows = asset.images["surface_instances_buf"]
        return {part.instance: _mesh(rows[part.row], vertices, triangles, part.mesh) for part in asset.parts}
    except (KeyError, ValueError, IndexError) as error:
        raise ReflectError(f"The asset {KIND} is damaged: {error}.", "Bake it again.") from error


def _mesh(row: np.ndarray, vertices: np.ndarray, triangles: np.ndarray, key: str) -> SurfaceMesh:
    (first, count, first_triangle, triangle_count), faces = row[0].astype(int), int(row[1, 0])
    table = vertices[first : first + count]
    corners = triangles[first_triangle : first_triangle + triangle_count, :3].astype(np.int32)
    face, side, weights = np.abs(table[:, 0, 3]).astype(np.int32) - 1, np.sign(table[:, 0, 3]), table[:, 1:, 3]
    if len(table) != count or len(corners) != triangle_count or not (
        np.all((corners >= 0) & (corners < count)) and np.all((face >= 0) & (face < faces)) and np.isfinite(table).all()
    ):
        raise ValueError("its numbers point outside its tables")
    weights = np.column_stack([weights, 1 - weights.sum(1)])  # exact: halves of halves
    return SurfaceMesh(table[:, 0, :3], table[:, 1, :3], table[:, 2, :3], corners, face, weights, side, faces, key)


def _in_rows(items: np.ndarray) -> np.ndarray:
    """(N, k, 4) as the rows of an image, COLUMNS items each."""
    rows = max(-(-len(items) // COLUMNS), 1)
    out = np.zeros((rows * COLUMNS, *items.shape[1:]), np.float32)
    out[: len(items)] = items
    return out.reshape(rows, -1, 4)
