"""NumPy to the GPU and back. Blender's Buffer reinterprets bytes and checks nothing, so everything is checked here.

Half-float images go up as float32 and are rounded by the driver: exact (every half is a float32), for denormals too.
Packing two halves into one float32 texel would need a quarter of the source bytes, but it is slower (0.44 s against
0.29 s for 4096^2, software OpenGL) and rests on drivers keeping NaN bit patterns.
"""

import numpy as np

from ..core.errors import ReflectError
from ..core.snapshot import Mesh
from . import compressed
from .counts import Counts
from .device import ensure, max_texture_side

# RGBA8 is what a driver without BC1 gets, with the levels below it.
_TEXEL_BYTES = {"RGBA16F": 8, "RGBA32F": 16, "R32F": 4, "R32UI": 4, "RGBA8_DXT1": 0.5, "RGBA8": 16 / 3}


def check_size(name: str, width: int, height: int):
    """Raises ReflectError when the device cannot hold a texture of this size."""
    limit = max_texture_side()
    if width < 1 or height < 1 or width > limit or height > limit:
        raise ReflectError(
            f"Image '{name}' of {width} x {height} texels does not fit this device (1 to {limit} a side).",
            "Bake with a lower resolution or choose a smaller picture size.",
        )


def texture_from(name: str, array: np.ndarray, counts: Counts, format: str | None = None):
    """A 2-D texture, row 0 at the bottom, of an asset's image: RGBA16F for names ending in _tx, RGBA32F for _buf (both from
    (H, W, 4) floats), RGBA8_DXT1 for _bc1 (compressed.py).

    Filtering is off: kernels fetch texels and write their own filters. Raises ReflectError on a wrong shape or size.
    """
    gpu = ensure()
    if name.endswith("_bc1"):
        width, height = compressed.size(array)
        check_size(name, width, height)
        texture = compressed.texture_from(name, array)
        counts.uploads += 1
        counts.upload_bytes += texture_bytes(texture)
        return texture
    if array.ndim != 3 or array.shape[2] != 4:
        raise ReflectError(f"Image '{name}' has shape {array.shape}, not (height, width, 4).", "Bake this asset again.")
    height, width = array.shape[:2]
    check_size(name, width, height)
    format = format or ("RGBA32F" if name.endswith("_buf") else "RGBA16F")
    data = np.ascontiguousarray(array, np.float32).ravel()
    texture = gpu.types.GPUTexture(
        (width, height), format=format, data=gpu.types.Buffer("FLOAT", data.size, data)
    )
    texture.filter_mode(False)
    texture.extend_mode("EXTEND")
    counts.uploads += 1
    counts.upload_bytes += texture_bytes(texture)
    return texture


def texture_bytes(texture) -> int:
    """Memory on the GPU of a texture made here."""
    return int(texture.width * texture.height * _TEXEL_BYTES[texture.format])


def plane_from(name: str, array: np.ndarray, counts: Counts):
    """A 2-D R32F texture of (H, W) float32, bit by bit, filtering off. Raises ReflectError when it is too large."""
    gpu = ensure()
    height, width = array.shape
    check_size(name, width, height)
    data = np.ascontiguousarray(array, np.float32).ravel()
    texture = gpu.types.GPUTexture((width, height), format="R32F", data=gpu.types.Buffer("FLOAT", data.size, data))
    texture.filter_mode(False)
    counts.uploads += 1
    counts.upload_bytes += 4 * width * height
    return texture


def volume_from(name: str, array: np.ndarray, counts: Counts):
    """A filtered 3-D RGBA16F texture from (D, H, W, 4) float32, clamped at its edges."""
    gpu = ensure()
    depth, height, width = array.shape[:3]
    data = np.ascontiguousarray(array, np.float32).ravel()
    texture = gpu.types.GPUTexture(
        (width, height, depth), format="RGBA16F", data=gpu.types.Buffer("FLOAT", data.size, data)
    )
    texture.filter_mode(True)
    texture.extend_mode("EXTEND")
    counts.uploads += 1
    counts.upload_bytes += width * height * depth * 8
    return texture


def read_texture(texture, counts: Counts) -> np.ndarray:
    """(H, W, channels) float32 copy of a texture; waits until everything before is drawn."""
    counts.readbacks += 1
    pixels = np.array(texture.read(), np.float32)
    return pixels.reshape(texture.height, texture.width, -1)


class MeshBuffer:
    """A mesh on the GPU: three corners a triangle, sorted by material so that each material is one range."""

    def __init__(self, mesh: Mesh, counts: Counts):
        """Triangles with a corner that is not finite are left out: they would spread over the picture."""
        gpu = ensure()
        corners = mesh.positions[mesh.triangles].astype(np.float64)  # (T, 3, 3)
        material = np.asarray(mesh.material_index, np.int64)
        keep = np.isfinite(corners).all((1, 2))
        order = np.flatnonzero(keep)[np.argsort(material[keep], kind="stable")]
        corners, material = corners[order], material[order]
        # Directions only: scaled by the longest edge first, so that tiny and huge meshes keep their float32 digits.
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        longest = np.maximum(np.abs(first).max(-1, initial=0), np.abs(second).max(-1, initial=0))[:, None]
        longest[longest == 0] = 1
        face = np.cross(first / longest, second / longest)
        length = np.linalg.norm(face, axis=-1, keepdims=True)
        face = np.where(length > 0, face / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])
        normals = np.nan_to_num(mesh.corner_normals[order].astype(np.float32), nan=0.0, posinf=0.0, neginf=0.0)
        self.vertices = 3 * len(order)
        # material slot -> (first vertex, vertex count)
        self.ranges = {
            int(slot): (3 * int(start), 3 * int(count))
            for slot, start, count in zip(*np.unique(material, return_index=True, return_counts=True))
        }
        self.batch = None
        self.bytes = 36 * self.vertices
        if self.vertices:
            format = gpu.types.GPUVertFormat()
            for name in ("position", "normal", "face_normal"):
                format.attr_add(id=name, comp_type="F32", len=3, fetch_mode="FLOAT")
            buffer = gpu.types.GPUVertBuf(format, self.vertices)
            buffer.attr_fill("position", np.ascontiguousarray(corners.reshape(-1, 3), np.float32))
            buffer.attr_fill("normal", np.ascontiguousarray(normals.reshape(-1, 3), np.float32))
            buffer.attr_fill("face_normal", np.ascontiguousarray(np.repeat(face, 3, 0), np.float32))
            self.batch = gpu.types.GPUBatch(type="TRIS", buf=buffer)
            counts.uploads += 1
            counts.upload_bytes += self.bytes


def triangle_batch():
    """The batch of a full-screen pass: three vertices, placed by gl_VertexID."""
    gpu = ensure()
    format = gpu.types.GPUVertFormat()
    format.attr_add(id="unused", comp_type="F32", len=1, fetch_mode="FLOAT")
    buffer = gpu.types.GPUVertBuf(format, 3)
    buffer.attr_fill("unused", np.zeros((3, 1), np.float32))
    return gpu.types.GPUBatch(type="TRIS", buf=buffer)
