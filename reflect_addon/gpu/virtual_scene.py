"""The reflected scene on the GPU for methods that draw it: core/virtual_mesh.py's tables as textures, its triangles as a batch."""

from functools import cache

import numpy as np

from ..core.map_space import MapSpace
from ..core.snapshot import SceneSnapshot
from ..core.virtual_mesh import VirtualMesh
from .counts import Counts
from .device import ensure
from .upload import texture_bytes, texture_from

COLUMNS = 1024  # of every table


def table(name: str, values: np.ndarray, counts: Counts):
    """A texture of (N, 4) float32, COLUMNS items a row (glsl/table_lib.glsl)."""
    rows = max(-(-len(values) // COLUMNS), 1)
    image = np.zeros((rows * COLUMNS, 4), np.float32)
    image[: len(values)] = values
    return texture_from(name, image.reshape(rows, COLUMNS, 4), counts, "RGBA32F")


def image(count: int, format: str, counts: Counts):
    """A cleared texture for a table of so many results."""
    texture = ensure().types.GPUTexture((COLUMNS, max(-(-count // COLUMNS), 1)), format=format)
    texture.filter_mode(False)
    kind = "UINT" if format.endswith("UI") else "FLOAT"
    texture.clear(format=kind, value=4 * (0,) if kind == "UINT" else 4 * (0.0,))
    counts.allocations += 1
    return texture


class VirtualScene:
    """vertices_buf (object space, w = instance), radiance_buf (w = share that mirrors), normals_buf, and the triangles."""

    def __init__(self, mesh: VirtualMesh, counts: Counts):
        self.mesh, self.counts = mesh, counts
        self.others = cache(self._others)
        self.vertices_buf = table("virtual vertices", np.column_stack([mesh.positions, mesh.instance]), counts)
        self.radiance_buf = table("virtual radiance", np.column_stack([mesh.radiance, mesh.share]), counts)
        # What the searches of one piece of a reflector find; the next one's replaces it.
        self.virtual_img, self.place_img = (image(len(mesh.positions), "RGBA32F", counts) for _ in range(2))
        self.normals_buf = table("virtual normals", np.pad(mesh.normal, ((0, 0), (0, 1))), counts)
        self.batch = self._batch(mesh.triangles)
        self.bytes = 48 * len(mesh.triangles) + sum(map(texture_bytes, (
            self.vertices_buf, self.radiance_buf, self.normals_buf, self.virtual_img, self.place_img))
        )  # fmt: skip

    def places(self, scene: SceneSnapshot) -> np.ndarray:
        """(instances, 4, 4) float64: world_from_object of each of the mesh's instances; zeros for one that is gone: a point."""
        named = scene.named()
        gone = np.zeros((4, 4))
        return np.stack([named[name].world_from_object if name in named else gone for name in self.mesh.names])

    def _others(self, name: str) -> np.ndarray:
        """(C,) bool: the chunks of all instances but the one of this name."""
        return np.array(self.mesh.names, object)[self.mesh.chunk_instance] != name

    def balls(self, space: MapSpace, places: np.ndarray) -> np.ndarray:
        """(C, 4) float64: the chunks' balls in a part's map space, where the instances now are."""
        matrices = space.from_objects(places)
        largest = np.linalg.norm(matrices[:, :, :3], ord=2, axis=(1, 2)) if len(matrices) else np.zeros(0)
        matrix, ball = matrices[self.mesh.chunk_instance], self.mesh.chunk_ball
        middle = np.einsum("cij,cj->ci", matrix[:, :, :3], ball[:, :3]) + matrix[:, :, 3]
        return np.column_stack([middle, ball[:, 3] * largest[self.mesh.chunk_instance]])

    def _batch(self, triangles: np.ndarray):
        if not len(triangles):
            return None
        gpu = ensure()
        format = gpu.types.GPUVertFormat()
        format.attr_add(id="corner", comp_type="F32", len=4, fetch_mode="FLOAT")
        corners = np.empty((len(triangles), 3, 4), np.float32)
        corners[..., :3], corners[..., 3] = triangles[:, None], np.arange(3)
        buffer = gpu.types.GPUVertBuf(format, 3 * len(triangles))
        buffer.attr_fill("corner", corners.reshape(-1, 4))
        self.counts.uploads += 1
        self.counts.upload_bytes += corners.nbytes
        return gpu.types.GPUBatch(type="TRIS", buf=buffer)
