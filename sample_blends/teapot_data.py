"""Newell's teapot (Martin Newell, 1975) from its bicubic Bezier patches, as one welded mesh.

Rim, body, lid and bottom are turned: every control row is a circle of four quadrants whose inner control points lie at
0.56 of the radius, so that only the profiles are listed. Handle and spout are given as control points of the half with
y <= 0 and mirrored. The bottom is the one Frank Crow added. Units are Newell's: 3.15 high, z up, spout towards +x.
"""

import numpy as np

QUADRANT = ((1.0, 0.0), (1.0, 0.56), (0.56, 1.0), (0.0, 1.0))

# (radius, height) of four control points a patch
TURNED = (
    ((1.4, 2.4), (1.3375, 2.53125), (1.4375, 2.53125), (1.5, 2.4)),  # rim
    ((1.5, 2.4), (1.75, 1.875), (2.0, 1.35), (2.0, 0.9)),  # body, upper
    ((2.0, 0.9), (2.0, 0.45), (1.5, 0.225), (1.5, 0.15)),  # body, lower
    ((0.0, 3.15), (0.8, 3.15), (0.0, 2.85), (0.2, 2.7)),  # lid, knob
    ((0.2, 2.7), (0.4, 2.55), (1.3, 2.55), (1.3, 2.4)),  # lid
    ((1.5, 0.15), (1.5, 0.075), (1.425, 0.0), (0.0, 0.0)),  # bottom
)

# Rows along the part, four (x, half width, z) across it; consecutive patches share a row.
HANDLE = (
    ((-1.6, 0, 2.025), (-1.6, 0.3, 2.025), (-1.5, 0.3, 2.25), (-1.5, 0, 2.25)),
    ((-2.3, 0, 2.025), (-2.3, 0.3, 2.025), (-2.5, 0.3, 2.25), (-2.5, 0, 2.25)),
    ((-2.7, 0, 2.025), (-2.7, 0.3, 2.025), (-3.0, 0.3, 2.25), (-3.0, 0, 2.25)),
    ((-2.7, 0, 1.8), (-2.7, 0.3, 1.8), (-3.0, 0.3, 1.8), (-3.0, 0, 1.8)),
    ((-2.7, 0, 1.575), (-2.7, 0.3, 1.575), (-3.0, 0.3, 1.35), (-3.0, 0, 1.35)),
    ((-2.5, 0, 1.125), (-2.5, 0.3, 1.125), (-2.65, 0.3, 0.9375), (-2.65, 0, 0.9375)),
    ((-2.0, 0, 0.9), (-2.0, 0.3, 0.9), (-1.9, 0.3, 0.6), (-1.9, 0, 0.6)),
)
SPOUT = (
    ((1.7, 0, 1.425), (1.7, 0.66, 1.425), (1.7, 0.66, 0.6), (1.7, 0, 0.6)),
    ((2.6, 0, 1.425), (2.6, 0.66, 1.425), (3.1, 0.66, 0.825), (3.1, 0, 0.825)),
    ((2.3, 0, 2.1), (2.3, 0.25, 2.1), (2.4, 0.25, 2.025), (2.4, 0, 2.025)),
    ((2.7, 0, 2.4), (2.7, 0.25, 2.4), (3.3, 0.25, 2.4), (3.3, 0, 2.4)),
    ((2.8, 0, 2.475), (2.8, 0.25, 2.475), (3.525, 0.25, 2.49375), (3.525, 0, 2.49375)),
    ((2.9, 0, 2.475), (2.9, 0.15, 2.475), (3.45, 0.15, 2.5125), (3.45, 0, 2.5125)),
    ((2.8, 0, 2.4), (2.8, 0.15, 2.4), (3.2, 0.15, 2.4), (3.2, 0, 2.4)),
)


def patches():
    """The 32 patches as (32, 4, 4, 3) float64 control points; du x dv points outwards for each."""
    made = []
    for profile in TURNED:
        for turn in range(4):
            rotation = np.linalg.matrix_power(np.array([[0.0, -1.0], [1.0, 0.0]]), turn)
            circle = np.array(QUADRANT) @ rotation.T
            grid = np.array([[(radius * x, radius * y, height) for x, y in circle] for radius, height in profile])
            made.append(grid.swapaxes(0, 1)[::-1])
    for rows in (HANDLE, SPOUT):
        for first in (0, 3):
            part = np.array(rows[first : first + 4], float)
            made += [part * (1, -1, 1), part[::-1]]
    return np.array(made)


def _bernstein(t):
    s = 1.0 - t
    return np.stack([s**3, 3 * s * s * t, 3 * s * t * t, t**3], axis=-1)


def tessellate(steps):
    """(N, 3) float64 vertices and faces (tuples of 3 or 4 indices), `steps` quads along each patch side.

    Points that patches share are welded, so smooth normals run across seams and the poles of lid and bottom are single
    vertices with triangles around them.
    """
    weights = _bernstein(np.linspace(0.0, 1.0, steps + 1))
    points = np.einsum("ui,vj,pijk->puvk", weights, weights, patches()).reshape(-1, 3)
    _, first, index = np.unique(np.round(points, 6) + 0.0, axis=0, return_index=True, return_inverse=True)
    index = index.reshape(len(patches()), steps + 1, steps + 1)
    faces = []
    for patch in index:
        corners = np.stack([patch[:-1, :-1], patch[1:, :-1], patch[1:, 1:], patch[:-1, 1:]], axis=-1).reshape(-1, 4)
        for face in corners:
            face = tuple(dict.fromkeys(int(i) for i in face))
            if len(face) > 2:
                faces.append(face)
    return points[first], faces
