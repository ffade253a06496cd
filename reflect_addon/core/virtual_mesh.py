"""The mesh that is reflected: surface radiance's triangles of all objects, fine enough for straight edges to bend.

Problem. Only vertices are reflected, and "edges of large polygons are not correctly reflected, since we only reflect the endpoints"
[estalella-2005 section 8].
Idea. An edge that is seen under an angle t from a mirror of radius r is seen along an arc of it about r t / 2 long, since a mirror
turns rays by twice its own angle; such an arc departs from its chord by c^2 / 8 r, which is r t^2 / 32. With t at most WIDEST that
is an eighth of a pixel on a mirror 200 pixels wide. So edges are split in halves until t is below it.
The angle is taken from the nearest point of a reflector's bounding box and never nearer than NEAR of its size: what touches a mirror
would be split without end. An edge is judged by its end points alone, so neighbours agree and the mesh stays whole.
Where flat mirrors alone look, straight edges stay straight, and nothing is split for them.
Limits. Radiance is interpolated along split edges: it was sampled before. Past MOST triangles no edge is split.
"""

from dataclasses import dataclass

import numpy as np

from .edge_split import closed, cut, edges_of
from .snapshot import Instance, SceneSnapshot
from .surface_asset import SurfaceMesh

WIDEST = 0.2  # rad
NEAR = 0.25
MOST = 1 << 18  # triangles
LEVELS = 12  # halvings of an edge, at most
# Corner normals that depart from their triangle's by less than this do not bend anything.
FLAT = 1e-3


@dataclass(frozen=True)
class VirtualMesh:
    """All instances' surfaces. V vertices, T triangles that wind counter-clockwise as seen."""

    positions: np.ndarray  # (V, 3) float32, object space, m
    instance: np.ndarray  # (V,) int32 into names, ascending
    radiance: np.ndarray  # (V, 3) float32, scene-linear
    normal: np.ndarray  # (V, 3) float32, object space, towards the seen side
    share: np.ndarray  # (V,) float32: which vertices mirror (surface_asset.py)
    triangles: np.ndarray  # (T, 3) int32, by instance
    names: tuple[str, ...]  # of the instances

    def without(self, name: str) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
        """(first, count) of the vertices and of the triangles of all instances but the one of this name, in one or two ranges."""
        own = self.names.index(name) if name in self.names else len(self.names)
        owners = (self.instance, self.instance[self.triangles[:, 0]] if len(self.triangles) else np.zeros(0, int))
        found = []
        for owner in owners:
            low, high = np.searchsorted(owner, [own, own + 1])
            found.append([(a, b - a) for a, b in ((0, int(low)), (int(high), len(owner))) if b > a])
        return found[0], found[1]


@dataclass
class _Soup:
    """The same while it is split: columns are position, radiance, normal, share."""

    points: np.ndarray  # (P, 3) places, world
    place: np.ndarray  # (T, 3)
    sample: np.ndarray  # (T, 3)
    values: np.ndarray  # (S, 10)
    owner: np.ndarray  # (S,)


def virtual_mesh(scene: SceneSnapshot, surfaces: dict[str, SurfaceMesh], widest: float = WIDEST) -> VirtualMesh:
    """The surfaces by instance name, each as its object is now, split for the scene's curved reflectors."""
    named = scene.named()
    names = tuple(name for name in surfaces if name in named)
    soup = _soup(scene, [(named[name], surfaces[name]) for name in names])
    boxes = [scene.bounds([r]) for r in scene.reflectors() if _bends(scene, r)]
    for _ in range(LEVELS):
        if not len(soup.place) or len(soup.place) >= MOST or not boxes:
            break
        keys, edge_of, length = edges_of(soup.points, soup.place)
        wide = _angle(soup.points[keys], length, boxes) > widest
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


def _angle(ends: np.ndarray, length: np.ndarray, boxes) -> np.ndarray:
    """(E,) the widest angle, about, under which one of the boxes sees each edge; ends: (E, 2, 3)."""
    widest = np.zeros(len(ends))
    for low, high in boxes:
        apart = np.linalg.norm(np.maximum(np.maximum(low - ends, ends - high), 0), axis=-1).min(1)
        near = NEAR * np.mean(high - low)
        widest = np.maximum(widest, length / np.maximum(apart, max(near, 1e-30)))
    return widest


def _mesh(soup: _Soup, names: tuple[str, ...]) -> VirtualMesh:
    """Vertices sorted by instance; those that no triangle has are gone."""
    used, corner = np.unique(soup.sample, return_inverse=True)
    order = np.argsort(soup.owner[used], kind="stable")
    rank = np.empty(len(order), int)
    rank[order] = np.arange(len(order))
    values, owner = soup.values[used[order]].astype(np.float32), soup.owner[used[order]].astype(np.int32)
    triangles = rank[corner.reshape(-1, 3)].astype(np.int32)
    triangles = triangles[np.argsort(owner[triangles[:, 0]], kind="stable")]
    return VirtualMesh(values[:, :3], owner, values[:, 3:6], values[:, 6:9], values[:, 9], triangles, names)
