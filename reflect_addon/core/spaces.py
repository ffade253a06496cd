"""Every convention of Reflect, stated once; tests/core/test_spaces.py pins each. GLSL and shader nodes have no copy of
this page: what needs it there is emitted from kernels (core/cubemap.py has the cube faces).

World space: Blender's, right-handed, Z up, metres. Camera space: Blender's, looking down -Z, Y up.
Transforms are 4x4 float64, column vectors, named dst_from_src: p_dst = dst_from_src @ p_src.

Images: row 0 is the BOTTOM row, as OpenGL and Blender have it; readers and writers of files flip.
Texel (i, j) of an image has its centre at (i + 0.5, j + 0.5) in texel coordinates; x to the right, y up.
Radiance: scene-linear, Rec.709 primaries, float32; on disk and on the GPU half floats times a power of two.
Distance: along the ray, in metres from its origin; FAR means the ray left the scene.

Cube faces: order +X -X +Y -Y +Z -Z. Face f has the major axis a = f // 2 with sign 1 - 2 * (f % 2); its s and t
coordinates in [-1, 1] are the components (a + 1) % 3 and (a + 2) % 3 of the direction over |component a|.
No mirroring: the same rule on all faces. (OpenGL's own cube maps differ; only an exporter needs to care.)
"""

import numpy as np

# Distance of the sky in metres. Finite, so that differences and lengths stay finite in float32 (1e9 squared is 1e18),
# and far above any scene (scale 1e4 with a 1e3 m wide scene is 1e7 m).
FAR = 1.0e9

# Status of an answered ray (the reflection buffer's last channel).
STATUS_NONE = 0.0  # no answer: nothing was baked for this ray
STATUS_HIT = 1.0  # the method's own stand-in was hit
STATUS_FELL_BACK = 2.0  # answered by the environment map beneath the method, by direction alone

FACE_NAMES = ("+X", "-X", "+Y", "-Y", "+Z", "-Z")


def cube_direction(face: np.ndarray, s: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Directions, not normalised, (..., 3) float64, of face coordinates s, t (|s|, |t| may pass 1: the border)."""
    face, s, t = np.broadcast_arrays(np.asarray(face), np.asarray(s, float), np.asarray(t, float))
    axis = face // 2
    out = np.zeros(face.shape + (3,))
    np.put_along_axis(out, axis[..., None], (1.0 - 2.0 * (face % 2))[..., None], -1)
    np.put_along_axis(out, ((axis + 1) % 3)[..., None], s[..., None], -1)
    np.put_along_axis(out, ((axis + 2) % 3)[..., None], t[..., None], -1)
    return out


def cube_coordinates(direction: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(face, s, t) of directions (..., 3): the inverse of cube_direction. On ties the first axis wins."""
    direction = np.asarray(direction, float)
    axis = np.argmax(np.abs(direction), axis=-1)
    major = np.take_along_axis(direction, axis[..., None], -1)[..., 0]
    s = np.take_along_axis(direction, ((axis + 1) % 3)[..., None], -1)[..., 0] / np.abs(major)
    t = np.take_along_axis(direction, ((axis + 2) % 3)[..., None], -1)[..., 0] / np.abs(major)
    return axis * 2 + (major < 0), s, t
