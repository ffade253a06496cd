"""The shapes of lamps: what a mirror shows of an area, point or spot light in Cycles.

Lamps are no meshes, but a ceiling light is often the brightest thing in a reflection. Methods that put stand-ins into
the scene need its shape; everything else sees it through trace(rays).
"""

import numpy as np

from ..core.snapshot import Mesh

# Corners of a round lamp's outline, rings of a ball: finer than any billboard's texels.
ROUND = 32
RINGS = 16


def lamp_mesh(light) -> Mesh | None:
    """The emitting surface of a bpy.types.Light in its object's space, or None for what has no size (suns, points)."""
    if light.type == "AREA":
        wide = light.size
        high = light.size_y if light.shape in {"RECTANGLE", "ELLIPSE"} else light.size
        if not (wide > 0 and high > 0):
            return None
        return _disk(wide, high) if light.shape in {"DISK", "ELLIPSE"} else _rectangle(wide, high)
    if light.type in {"POINT", "SPOT"} and light.shadow_soft_size > 0:
        return _ball(light.shadow_soft_size)
    return None


def intensity(light) -> tuple[float, float, float]:
    """W / sr of a bpy.types.PointLight, the same to all sides; its nodes are not read."""
    tint = np.array(light.temperature_color) if light.use_temperature else np.ones(3)
    return tuple((np.array(light.color) * tint * light.energy * 2.0**light.exposure / (4 * np.pi)).tolist())


def _rectangle(wide: float, high: float) -> Mesh:
    x, y = wide / 2, high / 2
    # Area lights shine along -Z: wound so that the triangles face there.
    return _mesh([(-x, -y, 0), (-x, y, 0), (x, y, 0), (x, -y, 0)], [(0, 1, 2), (0, 2, 3)])


def _disk(wide: float, high: float) -> Mesh:
    angle = np.arange(ROUND) * 2 * np.pi / ROUND
    rim = np.stack([np.cos(angle) * wide / 2, -np.sin(angle) * high / 2, np.zeros(ROUND)], -1)
    return _mesh(rim, [(0, i, i + 1) for i in range(1, ROUND - 1)])


def _ball(radius: float) -> Mesh:
    polar = np.linspace(0, np.pi, RINGS + 1)
    angle = np.arange(ROUND) * 2 * np.pi / ROUND
    points = [
        (radius * np.sin(p) * np.cos(a), radius * np.sin(p) * np.sin(a), radius * np.cos(p)) for p in polar for a in angle
    ]
    faces = []
    for ring in range(RINGS):
        for i in range(ROUND):
            a, b = ring * ROUND + i, ring * ROUND + (i + 1) % ROUND
            c, d = a + ROUND, b + ROUND
            faces += ([(a, c, d)] if ring < RINGS - 1 else []) + ([(a, d, b)] if ring > 0 else [])
            if ring == RINGS - 1:
                faces += [(a, c, b)]
    return _mesh(points, list(dict.fromkeys(faces)))


def _mesh(points, faces) -> Mesh:
    positions, triangles = np.array(points, np.float32), np.array(faces, np.int32)
    corners = positions[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=-1)
    keep = length > 0
    normal = normal[keep] / length[keep, None]
    return Mesh(
        positions,
        triangles[keep],
        np.repeat(normal[:, None], 3, axis=1).astype(np.float32),
        np.zeros(int(keep.sum()), np.int32),
    )
