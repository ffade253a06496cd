"""Reflectors as (positions (V, 3), triangles (T, 3), corner_normals (T, 3, 3)), from formulas and from files, in float64."""

import numpy as np
from analytic import unit


def shaded(positions, triangles, smooth_below=180.0):
    """The mesh with normals averaged over triangles around a vertex whose planes meet at less than this, degrees; 0 is flat."""
    positions, triangles = np.asarray(positions, np.float64), np.asarray(triangles, np.int64)
    a, b, c = np.moveaxis(positions[triangles], 1, 0)
    cross = np.cross(b - a, c - a)
    normal = cross / np.maximum(np.linalg.norm(cross, axis=-1, keepdims=True), 1e-300)
    corners = np.repeat(normal[:, None], 3, 1)
    if smooth_below <= 0:
        return positions, triangles, corners
    around = [[] for _ in positions]
    for t, vertices in enumerate(triangles.tolist()):
        for v in vertices:
            around[v].append(t)
    bound = np.cos(np.radians(smooth_below)) - 1e-9
    for t, vertices in enumerate(triangles.tolist()):
        for k, v in enumerate(vertices):
            near = np.array(around[v])
            near = near[normal[near] @ normal[t] >= bound]
            total = cross[near].sum(0) if len(near) else cross[t]
            corners[t, k] = total / max(np.linalg.norm(total), 1e-300)
    return positions, triangles, corners


def grid(point, normal, nu, nv, wrap=(True, True)):
    """A grid of (nu, nv) cells over point(u, v) and normal(u, v), both (..., 3) for u, v in 0..1, wound to fit the normals."""
    u, v = np.meshgrid(np.arange(nu + 1) / nu, np.arange(nv + 1) / nv, indexing="ij")
    p, n = point(u, v).reshape(-1, 3), unit(normal(u, v).reshape(-1, 3))
    at = np.arange((nu + 1) * (nv + 1)).reshape(nu + 1, nv + 1)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    t = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    cross = np.cross(p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]])
    t, cross = (x[np.linalg.norm(cross, axis=-1) > 1e-12] for x in (t, cross))
    t = np.where(((cross * n[t].sum(1)).sum(-1) < 0)[:, None], t[:, ::-1], t)
    return p, t, n[t]


def joined(*meshes):
    """Several meshes as one."""
    start = np.cumsum([0, *(len(m[0]) for m in meshes)])
    return (
        np.concatenate([m[0] for m in meshes]),
        np.concatenate([m[1] + s for m, s in zip(meshes, start, strict=False)]),
        np.concatenate([m[2] for m in meshes]),
    )


def _round(u, v):
    theta, phi = np.pi * v, 2 * np.pi * u
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)


def ellipsoid(axes=(1.0, 1.0, 1.0), nu=48, nv=24):
    axes = np.asarray(axes, np.float64)
    return grid(lambda u, v: _round(u, v) * axes, lambda u, v: _round(u, v) / axes, nu, nv)


def torus(major=1.0, minor=0.4, nu=64, nv=32):
    def normal(u, v):
        a, b = 2 * np.pi * u, 2 * np.pi * v
        return np.stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)], -1)

    def point(u, v):
        a = 2 * np.pi * u
        return major * np.stack([np.cos(a), np.sin(a), 0 * a], -1) + minor * normal(u, v)

    return grid(point, normal, nu, nv)


def cap(radius=1.0, half_angle=90.0, inward=True, nu=48, nv=16):
    """A piece of a sphere about the origin around -z, open."""
    share = half_angle / 180
    side = -1.0 if inward else 1.0
    return grid(lambda u, v: radius * _round(u, 1 - v * share), lambda u, v: side * _round(u, 1 - v * share), nu, nv)


def bowl(radius=1.0, wall=0.15):
    """Half a ball with a round hollow: inside, a rounded rim, outside; closed."""
    r, middle = wall / 2, radius - wall / 2

    def rim(u, v, only_normal):
        a, b = 2 * np.pi * u, np.pi * v
        out = np.stack([np.cos(a), np.sin(a), 0 * a], -1)
        n = np.cos(b)[..., None] * out + np.sin(b)[..., None] * np.array([0, 0, 1.0])
        return n if only_normal else middle * out + r * n

    return joined(
        cap(radius - wall), cap(radius, inward=False), grid(lambda u, v: rim(u, v, False), lambda u, v: rim(u, v, True), 48, 8)
    )


def paraboloid(depth=1.0, inward=True, nu=48, nv=24):
    """z = depth (x^2 + y^2) up to radius 1, open."""
    side = 1.0 if inward else -1.0

    def point(u, v):
        return np.stack([v * np.cos(2 * np.pi * u), v * np.sin(2 * np.pi * u), depth * v * v], -1)

    def normal(u, v):
        p = point(u, v)
        return side * np.stack([-2 * depth * p[..., 0], -2 * depth * p[..., 1], 1 + 0 * u], -1)

    return grid(point, normal, nu, nv)


def cylinder(radius=0.5, height=2.0, nu=48):
    """With caps, sharp at their rims."""

    def ring(u):
        return np.stack([np.cos(2 * np.pi * u), np.sin(2 * np.pi * u), 0 * u], -1)

    up = np.array([0, 0, 1.0])
    side = grid(lambda u, v: radius * ring(u) + height * (v - 0.5)[..., None] * up, lambda u, v: ring(u), nu, 8)
    caps = [
        grid(lambda u, v, z=z: radius * v[..., None] * ring(u) + z * up, lambda u, v, z=z: z * up + 0 * ring(u), nu, 4)
        for z in (height / 2, -height / 2)
    ]
    return joined(side, *caps)


def bevelled_cube(bevel=0.1, segments=4, smooth=True):
    """Two wide; its edges and corners are rounded over `bevel`. smooth: faces keep their normals, bevels are shaded smooth."""
    inner = 1 - bevel
    steps = np.concatenate([np.linspace(-np.pi / 4, np.pi / 4, segments + 1)])
    # One side of a cube as a grid: inner square and half of the bevel around it, pushed out to the rounded cube.
    across = np.concatenate([-inner + bevel * np.tan(steps[steps < -1e-9]), [-inner, inner], inner + bevel * np.tan(steps[steps > 1e-9])])
    x, y = np.meshgrid(across, across, indexing="ij")
    flat = np.stack([x, y, 1 + 0 * x], -1)
    core = np.clip(flat, -inner, inner)
    normal = unit(flat - core)
    p = (core + bevel * normal).reshape(-1, 3)
    n = normal.reshape(-1, 3)
    count = len(across)
    at = np.arange(count * count).reshape(count, count)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    t = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    sides = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            turn = np.roll(np.eye(3), axis, axis=1) * (sign if axis < 3 else 1.0)
            turned = t if np.linalg.det(turn) > 0 else t[:, ::-1]
            sides.append((p @ turn, turned, (n @ turn)[turned]))
    mesh = joined(*sides)
    return mesh if smooth else shaded(*mesh[:2], smooth_below=0)


def from_obj(path, smooth_below=180.0):
    """Of a file's positions and faces; normals of its own are not read."""
    positions, triangles = [], []
    for line in path.read_text().splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            positions.append([float(x) for x in rest[:3]])
        elif word == "f":
            corners = [int(x.split("/")[0]) - 1 for x in rest]
            triangles += [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]
    return shaded(positions, triangles, smooth_below)


def points_on(rng, mesh, count):
    """((N,) triangle, (N, 3) weights, (N, 3) points), evenly over the surface."""
    positions, triangles, _ = mesh
    a, b, c = np.moveaxis(positions[triangles], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=-1)
    which = rng.choice(len(triangles), count, p=area / area.sum())
    weight = rng.dirichlet([1.0, 1.0, 1.0], count)
    return which, weight, np.einsum("nk,nkx->nx", weight, positions[triangles][which])
