"""A mirror under an equirectangular world, rendered by Mitsuba 3: camera, mirror and look-up are none of ours.

Axes. Both worlds have Z up here. Blender's picture shows, from its left edge to its right, the directions
-Y, -X ... in clockwise order seen from above: column u lies at the azimuth -(2 pi u - pi), measured from +X, and row v
(from the top) at the zenith angle pi v, with texel centres at (i + 0.5) / size in both.
Mitsuba's own `envmap` puts the first and the last row ON the poles (zenith angle pi i / (H - 1)), half a texel off. So
the sky is a sphere of FAR_SKY metres that glows with a `bitmap` texture, whose texels are centred like Blender's:
mirrored left to right (it is seen from inside) and turned by 180 degrees about Z the two agree to 1e-5.
"""

import math

import numpy as np

# m: parallax between two points of a mirror 1 m wide is then 1e-6 radians, a six-thousandth of a texel.
FAR_SKY = 1e6


def render(world_pixels, mirror_ply, camera, width: int, height: int, mask: np.ndarray) -> np.ndarray:
    """(N, 3) radiance seen through the centres of the pixels of mask ((H, W) bool, row 0 at the bottom).

    world_pixels: (h, w, 3) float32, row 0 at the top; mirror_ply: the mirror's triangles with normals, world space;
    camera: a Blender camera object with a horizontal sensor.
    """
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    look = mi.ScalarTransform4f
    world_from_camera = np.array(camera.matrix_world)
    eye, forward, up = world_from_camera[:3, 3], -world_from_camera[:3, 2], world_from_camera[:3, 1]
    scene = mi.load_dict({
        "type": "scene",
        "sky": {
            "type": "sphere",
            "flip_normals": True,
            "to_world": look().rotate([0, 0, 1], 180) @ look().scale(FAR_SKY),
            "light": {"type": "area", "radiance": {
                "type": "bitmap", "bitmap": mi.Bitmap(np.ascontiguousarray(world_pixels[:, ::-1])), "raw": True,
                "filter_type": "bilinear", "wrap_mode": "repeat",
            }},
        },
        "mirror": {"type": "ply", "filename": str(mirror_ply), "bsdf": {"type": "conductor", "material": "none"}},
    })  # fmt: skip
    sensor = mi.load_dict({
        "type": "perspective",
        "fov": math.degrees(2 * math.atan(camera.data.sensor_width / 2 / camera.data.lens)),
        "fov_axis": "x",
        "to_world": look().look_at(origin=eye.tolist(), target=(eye + forward).tolist(), up=up.tolist()),
        "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}},
    })  # fmt: skip
    integrator, sampler = mi.load_dict({"type": "path", "max_depth": 3}), mi.load_dict({"type": "independent"})
    out = []
    for row, column in zip(*np.nonzero(mask)):
        place = [(column + 0.5) / width, 1 - (row + 0.5) / height]
        ray, _ = sensor.sample_ray_differential(0, 0.5, place, [0.5, 0.5])
        out.append(np.array(integrator.sample(scene, sampler, ray)[0]).ravel())
    return np.array(out, np.float32)
