"""The mesh that is reflected: surface radiance's triangles of all objects, fine enough for straight edges to bend.

Problem. Only vertices are reflected, and "edges of large polygons are not correctly reflected, since we only reflect the endpoints"
[estalella-2005 section 8].
Idea. Edges are split in halves until they are seen under an angle of WIDEST at most. How far a straight edge departs from the chord
between its ends' images, seen under an angle t from the middle of a ball of radius r: what lies at an angle 2 h from the eye's direction is
shown at r sin h from the picture's middle. Along a great circle across that direction the image's second derivative in the angle is
k r, k = sin h (2 cos^2 h + 1) / (4 cos^2 h), which no other direction exceeds (tests): the image bends by k r t^2 / 8. In the inner half
of the ball's picture k <= 1 / sqrt 2, so it is at most r t^2 / 11.3 (`widest`); k is 1.3 where three quarters of it end, and has no bound
towards the rim. Half of all far edges bend by less than r t^2 / 25; near ones, of which the ball sees more, by less.
In pixels that is less for a smaller mirror, so t may be larger by the root of how much smaller than the scene's largest curved one it is.
The angle is taken from the nearest point of a reflector's bounding box and never nearer than NEAR of its size: what touches a mirror
would be split without end. An edge is judged by its end points alone, so neighbours agree and the mesh stays whole.
Where flat mirrors alone look, straight edges stay straight, and nothing is split for them.
Triangles that lie together are a chunk, with vertices of its own: what cannot be seen in a part of a reflector is left out by chunks
(virtual_cull.py).
Limits. Radiance is interpolated along split edges: it was sampled before. Past MOST triangles no edge is split.
"""

import math
from dataclasses import dataclass

import numpy as np

from .edge_split import closed, cut, edges_of
from .snapshot import Instance, SceneSnapshot
from .surface_asset import SurfaceMesh

# Pixels that an edge may bend by in the inner half of the picture of a ball, and how wide that picture is.
BEND, PICTURE = 0.35, 200.0
NEAR = 0.25
MOST = 1 << 17  # triangles
CHUNK = 192  # triangles
LEVELS = 12  # halvings of an edge, at most
# Corner normals that depart from their triangle's by less than this do not bend anything.
FLAT = 1e-3


def widest(bend: float, picture: float) -> float:
    """Radians under which an edge may be seen, to bend by `bend` pixels at most in the inner half of a ball's picture, `picture` wide."""
    return math.sqrt(8 * math.sqrt(2) * bend / (picture / 2))


WIDEST = widest(BEND, PICTURE)  # 0.2 rad


@dataclass(frozen=True)
class VirtualMesh:
    """All instances' surfaces. V vertices, T triangles that wind counter-clockwise as seen."""

    positions: np.ndarray  # (V, 3) float32, object space, m
    instance: np.ndarray  # (V,) int32 into names
    radiance: np.ndarray  # (V, 3) float32, scene-linear
    normal: np.ndarray  # (V, 3) float32, object space, towards the seen side
    share: np.ndarray  # (V,) float32: which vertices mirror (surface_asset.py)
    triangles: np.ndarray  # (T, 3) int32
    names: tuple[str, ...]  # of the instances
    # (C, 4) int64: of each chunk the first vertex, their count, the first triangle, their count; one after the other
    chunks: np.ndarray
    chunk_instance: np.ndarray  # (C,) int64
    chunk_ball: np.ndarray  # (C, 4) float64: middle and radius, object space


@dataclass
class _Soup:
    """The same while it is split: columns are position, radiance, normal, share."""

    points: np.ndarray  # (P, 3) places, world
    place: np.ndarray  # (T, 3)
    sample: np.ndarray  # (T, 3)
    values: np.ndarray  # (S, 10)
    owner: np.ndarray  # (S,)


def virtual_mesh(scene: SceneSnapshot, surfaces: dict[str, SurfaceMesh], angle: float = WIDEST) -> VirtualMesh:
    """The surfaces by instance name, each as its object is now, split for the scene's curved reflectors."""
    named = scene.named()
    names = tuple(name for name in surfaces if name in named)
    soup = _soup(scene, [(named[name], surfaces[name]) for name in names])
    boxes = [scene.bounds([r]) for r in scene.reflectors() if _bends(scene, r)]
    largest = max((float(np.linalg.norm(high - low)) for low, high in boxes), default=1.0)
    for _ in range(LEVELS):
        if not len(soup.place) or len(soup.place) >= MOST or not boxes:
            break
        keys, edge_of, length = edges_of(soup.points, soup.place)
        wide = _angle(soup.points[keys], length, boxes, largest) > angle
        if not wide.any():
            break
        found = cut(soup.points, soup.place, soup.sample, keys, edge_of, closed(wide, edge_of, length))
        soup.values = np.concatenate([soup.values, soup.values[found.ends].mean(1)])
        soup.owner = np.concatenate([soup.owner, soup.owner[found.ends[:, 0]]])
        soup.points, soup.place, soup.sample = found.points, found.place, found.sample
    return _mesh(soup, names)


def _soup(scene: SceneSnapshot, things: list[tuple[Instance, SurfaceMesh]]) -> _Soup:
    points, place, sample, values, owner = [np.zeros((0, 3))], [np.zeros((0, 3), int)], [np.zeros((0, 3), int)], [np.zeros((0, 10))], [np.zeros(0, int)]
    first_place = first_sample = 0
    for number, (instance, mesh) in enumerate(things):
        _, first, where = np.unique(mesh.positions, axis=0, return_index=True, return_inverse=True)
        matrix = np.asarray(instance.world_from_object, np.float64)
        points.append(mesh.positions[first].astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3])
        place.append(where.ravel()[mesh.triangles] + first_place)
        sample.append(mesh.triangles + first_sample)
        share = mesh.share(scene, instance)
        share = np.zeros(len(mesh.positions)) if share is None else share
        values.append(np.column_stack([mesh.positions, mesh.radiance, mesh.normals, share]))
        owner.append(np.full(len(mesh.positions), number))
        first_place, first_sample = first_place + len(first), first_sample + len(mesh.positions)
    return _Soup(*(np.concatenate(parts) for parts in (points, place, sample, values, owner)))


def _bends(scene: SceneSnapshot, reflector: Instance) -> bool:
    """Whether a reflector is curved anywhere."""
    mesh = scene.meshes[reflector.mesh]
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face /= np.maximum(np.linalg.norm(face, axis=-1, keepdims=True), 1e-300)
    off = np.linalg.norm(mesh.corner_normals - face[:, None], axis=-1)
    return bool((np.minimum(off, np.linalg.norm(mesh.corner_normals + face[:, None], axis=-1)) > FLAT).any())


def _angle(ends: np.ndarray, length: np.ndarray, boxes, largest: float) -> np.ndarray:
    """(E,) the widest angle, about, under which one of the boxes sees each edge, a small box's counting less; ends: (E, 2, 3)."""
    found = np.zeros(len(ends))
    for low, high in boxes:
        apart = np.linalg.norm(np.maximum(np.maximum(low - ends, ends - high), 0), axis=-1).min(1)
        near = NEAR * np.mean(high - low)
        weight = np.sqrt(np.linalg.norm(high - low) / max(largest, 1e-30))
        found = np.maximum(found, weight * length / np.maximum(apart, max(near, 1e-30)))
    return found


def _mesh(soup: _Soup, names: tuple[str, ...]) -> VirtualMesh:
    """Triangles sorted into chunks, instance by instance."""
    count = len(soup.sample)
    owner = soup.owner[soup.sample[:, 0]] if count else np.zeros(0, int)
    middle = soup.values[soup.sample, :3].mean(1) if count else np.zeros((0, 3))
    order = np.lexsort((_along_curve(middle, owner, len(names)), owner))
    first = np.searchsorted(owner[order], owner[order])  # of the instance's own
    chunk = np.unique(np.stack([owner[order], (np.arange(count) - first) // CHUNK], -1), axis=0, return_inverse=True)[1].reshape(-1)
    chunks = int(chunk.max(initial=-1)) + 1
    # A vertex for each sample in each chunk.
    sample = soup.sample[order]
    keys, triangles = np.unique(chunk[:, None] * (len(soup.values) + 1) + sample, return_inverse=True)
    chunk_of, sample_of = np.divmod(keys, len(soup.values) + 1)
    values, triangles = soup.values[sample_of].astype(np.float32), triangles.reshape(-1, 3).astype(np.int32)
    numbers = np.arange(chunks)
    low, high = np.searchsorted(chunk_of, [numbers, numbers + 1])
    low_triangle, high_triangle = np.searchsorted(chunk, [numbers, numbers + 1])
    balls = np.zeros((chunks, 4))
    for number in range(chunks):
        own = values[low[number] : high[number], :3].astype(np.float64)
        balls[number, :3] = (own.min(0) + own.max(0)) / 2
        balls[number, 3] = np.linalg.norm(own - balls[number, :3], axis=1).max()
    return VirtualMesh(
        values[:, :3], soup.owner[sample_of].astype(np.int32), values[:, 3:6], values[:, 6:9], values[:, 9], triangles, names,
        np.stack([low, high - low, low_triangle, high_triangle - low_triangle], -1), owner[order][low_triangle] if chunks else owner, balls,
    )  # fmt: skip


def _along_curve(middle: np.ndarray, owner: np.ndarray, owners: int) -> np.ndarray:
    """(T,) place along a Z curve through each owner's box: what is near on it is near."""
    low, high = np.full((owners, 3), np.inf), np.full((owners, 3), -np.inf)
    np.minimum.at(low, owner, middle)
    np.maximum.at(high, owner, middle)
    size = np.maximum((high - low).max(1, initial=0), 1e-30) if owners else np.zeros(0)
    steps = ((middle - low[owner]) / size[owner, None] * 1023).astype(np.int64).clip(0, 1023)
    code = np.zeros(len(middle), np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= (steps[:, axis] >> bit & 1) << (3 * bit + axis)
    return code
