"""Surface radiance: what surfaces send out, traced once and kept on their meshes (design, "Capture has two speeds").

Problem. `trace` is exact and takes seconds; what follows a moving object has to be captured at frame rate.
Idea. The outgoing radiance of a diffuse surface is one colour in all directions. It is traced at points of the surface,
from just above it looking straight down, kept per vertex of a mesh that is subdivided where radiance changes
(surface_refine.py), and then the GPU draws that mesh from any camera (gpu/capture.py): a billboard, a depth map, a cube
face, a mirrored view.
Of a mirror its own light is kept, without what it mirrors (billboard_mirrors.py), since that is added when it is shown; of a lamp
without what lies behind it, which rays see as well.
Limits. Shininess is seen as from straight above, and mirrors are not subdivided. Radiance stays what it was when the
object moves: its own shadow does not follow. A mesh that changes its triangles (other topology) cannot be followed.
"""

from collections.abc import Callable

import numpy as np

from .asset import Asset
from .billboard_capture import LAMP_LIFT
from .billboard_mirrors import mirrored, own_light
from .flat_parts import contains, visible_sides
from .lamp_hits import shining
from .mirrors import mirror_of
from .rays import Hits, Rays
from .reflected_samples import LIFT, LIFT_ROUNDING
from .snapshot import Instance, SceneSnapshot
from .surface_asset import SurfaceMesh, asset_of, on_faces
from .surface_calm import calm
from .surface_cuts import cut
from .surface_reach import lengths_of
from .surface_refine import refine
from .surface_soup import Ask, Lengths, Soup

# surface_tolerance: relative difference that is left; surface_levels: halvings of an edge, at most; surface_samples: paths for each traced point,
# fewer where large meshes ask more than surface_paths; surface_angle: radians of the shortest edges as reflectors see them (surface_reach.py), 0:
# FINEST; surface_cuts: questions for each edge that holds a step (surface_cuts.py), 0: no cuts; surface_triangles: at most about so many, or as
# many as the objects' own meshes have where those are more; surface_noise: relative standard deviation at a vertex that is wished for
# (surface_calm.py), 0: as it comes; surface_paths: about so many at most are spent on refining, where FEWEST do, and again on that.
DEFAULTS = {
    "surface_tolerance": 0.1, "surface_levels": 5, "surface_samples": 16, "surface_angle": 0.0, "surface_cuts": 0,
    "surface_triangles": 1 << 19, "surface_noise": 0.0, "surface_paths": 1 << 23,
}  # fmt: skip
# No edge below this share of its object's size is split: four texels of a billboard with 128, and interpolation between.
FINEST = 1 / 32
# Points of each thing that are traced twice. Nine in ten of their differences are below 2.3 sigma where noise is normal; twice that is
# 3.8 times the standard deviation of a question's difference to what its neighbours say: one false split in ten thousand.
TWICE = 24
NOISE_QUANTILE = 0.9
NOISE_TIMES = 2.0
# Paths of a question that large meshes have all the same, and questions that refining asks for each corner that a mesh brings (13 in a kitchen).
FEWEST = 16
QUESTIONS = 16
# Where a lamp's vertices are asked, over their distance from its centre.
WITHIN = 0.9
# Corners of a vertex whose normals differ by less than this have the same radiance.
SAME_NORMAL = 1 / 200


def bake(
    scene: SceneSnapshot, trace: Callable[..., Hits], instances: tuple[Instance, ...], settings: dict[str, object]
) -> Asset:
    """The surface radiance of these instances, each on the sides from which it can be seen: one asset for the scene.

    trace: as in core/job.py. Costs at most 2 + surface_levels bundles, whatever the number of instances, with surface_angle as
    many again, for each cut one more, and mirrors need a second one each time."""
    soup = soup_of(scene, instances)
    lift = LIFT * max(scene.diagonal(), 1e-30)

    is_lamp, center, lamp_lift, through = _lamps(scene, instances)
    mirrors = {k: mirror for k, i in enumerate(instances) if (mirror := mirror_of(scene, i))}
    samples = paths_of(soup, settings)

    def ask(points: np.ndarray, normals: np.ndarray, owner: np.ndarray, face: np.ndarray) -> np.ndarray:
        off = np.maximum(lift, LIFT_ROUNDING * np.abs(points).max(-1, keepdims=True))
        above = np.maximum(off, lamp_lift[owner])
        shines = np.flatnonzero(is_lamp[owner])
        # Of a lamp's rim half is beside it. It hides nothing: what lies behind it is seen from just below it as well, of a ball, which
        # shines from inside too, from beyond its other side.
        points = np.where(is_lamp[owner, None], center[owner] + (points - center[owner]) * WITHIN, points)
        origin = np.concatenate([points + normals * above, (points - normals * (off + through[owner]))[shines]])
        direction = -np.concatenate([normals, normals[shines]])
        rays = Rays(origin.astype(np.float32), direction.astype(np.float32))
        hits = trace(rays, samples=samples)
        found, behind = np.split(hits.radiance.astype(np.float64), [len(points)])
        found[shines] = np.maximum(found[shines] - behind, 0.0)
        shown = []  # (what of the questions, mirror, cosine of the ray that asks, mirrored rays)
        for k, mirror in mirrors.items():
            mine = np.flatnonzero(owner == k)
            mine = mine[np.isin(scene.slots(instances[k])[face[mine]], mirror.slots)]
            if len(mine):
                bent, cosine = mirrored(hits.part(mine), rays.direction[mine], above[mine, 0])
                shown.append((mine, mirror, cosine, bent))
        if shown:  # one bundle for all: each costs the start of a render
            bent = Rays(*(np.concatenate([getattr(s[-1], name) for s in shown]) for name in ("origin", "direction")))
            arriving = np.split(trace(bent, samples=samples).radiance, np.cumsum([len(s[0]) for s in shown[:-1]]))
            for (mine, mirror, cosine, _), light in zip(shown, arriving, strict=True):
                found[mine] = own_light(mirror.material, found[mine], cosine, np.ones(len(mine)), light)
        return found

    angle = float(settings["surface_angle"])
    lengths = lengths_of(scene, instances, angle) if angle > 0 else _own_lengths(scene, instances)
    noise = noise_of(soup, ask) if len(soup.place) else np.zeros(0)
    tolerance, levels = float(settings["surface_tolerance"]), int(settings["surface_levels"])
    cuts, most = int(settings["surface_cuts"]), int(settings["surface_triangles"]) // 2  # two triangles a sample
    soup, values = refine(soup, ask, tolerance, levels, lengths, noise, most // 3 if cuts else most)
    soup, values = cut(soup, values, ask, tolerance + noise, cuts, lengths, max(most - len(values), 0) // 2)  # two samples a cut
    values = calm(soup, values, ask, float(settings["surface_noise"]), int(settings["surface_paths"]) // samples)
    meshes = {i.name: _mesh_of(scene, i, soup, values, soup.owner == k) for k, i in enumerate(instances)}
    return asset_of(scene, meshes, settings)


def paths_of(soup: Soup, settings: dict[str, object]) -> int:
    """Paths of a question: a kitchen of forty thousand triangles would take minutes with what a room of a thousand needs seconds for."""
    wished, corners = int(settings["surface_samples"]), int(soup.sample.max(initial=-1)) + 1
    return min(wished, max(int(settings["surface_paths"]) // (QUESTIONS * max(corners, 1)), FEWEST))


def _lamps(scene: SceneSnapshot, instances: tuple[Instance, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Of each instance (I,) whether it is a lamp; (I, 3) its centre; (I, 1) m: how far above its mesh rays must start, for its mesh
    lies inside the true ball (billboard_capture.LAMP_LIFT); (I, 1) m: how far below a point of it lies its other side, at least."""
    center, lift, through = np.zeros((len(instances), 3)), np.zeros((len(instances), 1)), np.zeros((len(instances), 1))
    is_lamp = np.isin([i.name for i in instances], [lamp.name for lamp in scene.lamps])
    for k in np.flatnonzero(is_lamp):
        low, high = scene.bounds([instances[k]])
        center[k] = (low + high) / 2
        if not shining(scene, instances[k]).any():
            lift[k] = LAMP_LIFT * np.linalg.norm(high - low)
            through[k] = np.max(high - low)
    return is_lamp, center, lift, through


def _own_lengths(scene: SceneSnapshot, instances: tuple[Instance, ...]) -> Lengths:
    """A share of each instance's own size, for whoever looks from anywhere."""
    # A mirror shows another thing to everyone: what it shows straight above is kept, and not worth a subdivision.
    shortest = np.array(
        [np.inf if i.is_reflector else FINEST * np.ptp(scene.world_positions(i), axis=0).max() for i in instances]
    )
    return lambda soup: (shortest[soup.owner], shortest[soup.owner], np.full(len(soup.owner), np.inf))


def soup_of(scene: SceneSnapshot, instances: tuple[Instance, ...]) -> Soup:
    """The instances' triangles as one, once for each side from which they can be seen."""
    centres = {r.name: np.mean(scene.bounds([r]), axis=0) for r in scene.reflectors()}
    points, columns = [np.zeros((0, 3))], [[] for _ in range(5)]
    first_place = first_sample = 0
    for owner, instance in enumerate(instances):
        mesh, world = scene.meshes[instance.mesh], scene.world_positions(instance)
        _, first, place = np.unique(mesh.positions, axis=0, return_index=True, return_inverse=True)
        place = place.ravel()[mesh.triangles]
        # The numbers that make two corners of a vertex one sample.
        normal = np.round(mesh.corner_normals / SAME_NORMAL).astype(np.int64)
        material = np.broadcast_to(np.asarray(mesh.material_index)[:, None, None], (*place.shape, 1))
        key = np.concatenate([place[..., None], normal, material], -1).reshape(-1, 5)
        _, sample = np.unique(key, axis=0, return_inverse=True)
        count = len(place)
        others = [centre for name, centre in centres.items() if name != instance.name]  # a mirror is in itself, and sees out
        for side in _sides(scene, instance, place, world[mesh.triangles], others):
            new = place + first_place, sample.reshape(-1, 3) + first_sample, np.arange(count), side, owner
            for column, values in zip(columns, new, strict=True):
                column.append(np.broadcast_to(values, (count,)) if np.ndim(values) == 0 else values)
            first_sample += int(sample.max(initial=-1)) + 1
        points.append(world[first])
        first_place += len(first)
    if not columns[0]:
        columns = [[np.zeros((0, 3), int)], [np.zeros((0, 3), int)], *([np.zeros(0, int)] for _ in range(3))]
    place, sample, face, side, owner = (np.concatenate(column) for column in columns)
    weights = np.broadcast_to(np.eye(3), (len(place), 3, 3))
    return Soup(np.concatenate(points), place, sample, face, weights, side.astype(float), owner)


def noise_of(soup: Soup, ask: Ask) -> np.ndarray:
    """(owners,) the relative difference between an answer and what its neighbours say that noise alone can make; each thing's own, since
    one that glows has next to none beside one in a dark corner."""
    count = int(soup.owner.max(initial=-1)) + 1
    own = [np.flatnonzero(soup.owner == k) for k in range(count)]
    triangle = np.concatenate([which[np.linspace(0, len(which) - 1, TWICE).astype(int)] for which in own if len(which)])
    corners = soup.points[soup.place[triangle]]
    weights = np.random.default_rng(len(triangle)).dirichlet(np.ones(3), len(triangle))
    cross = soup.side[triangle, None] * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = cross / np.maximum(np.linalg.norm(cross, axis=-1, keepdims=True), 1e-300)
    asked = np.einsum("nk,nkx->nx", weights, corners), normals, soup.owner[triangle], soup.face[triangle]
    first, second = np.split(ask(*(np.concatenate([values, values]) for values in asked)), 2)
    bright = np.maximum(np.abs(first), np.abs(second)).max(1)
    noise = np.zeros(count)
    for k in np.unique(soup.owner[triangle]):
        mine = soup.owner[triangle] == k
        scale = np.maximum(bright[mine], max(bright[mine].mean() * 0.1, 1e-9))
        noise[k] = NOISE_TIMES * np.quantile(np.abs(first - second)[mine].max(1) / scale, NOISE_QUANTILE)
    return noise


def _sides(scene: SceneSnapshot, instance: Instance, place: np.ndarray, corners: np.ndarray, centres) -> tuple[float, ...]:
    """1 and -1: a closed mesh is seen on its outside, by reflectors in it on its inside; lamps where they shine; all others on both."""
    if instance.name in {lamp.name for lamp in scene.lamps}:
        return (1.0,)
    directed = np.concatenate([place[:, [0, 1]], place[:, [1, 2]], place[:, [2, 0]]])
    if len(np.unique(directed, axis=0)) < len(directed):
        return (1.0, -1.0)  # neighbours wind in opposite ways: nobody knows which side is out
    inside = {False} | {contains(scene, instance, centre) for centre in centres}
    return tuple(sorted({side for where in inside for side in visible_sides(place, corners, where)}))


def _mesh_of(scene: SceneSnapshot, instance: Instance, soup: Soup, values: np.ndarray, mine: np.ndarray) -> SurfaceMesh:
    samples, first, vertex = np.unique(soup.sample[mine], return_index=True, return_inverse=True)
    triangles = vertex.reshape(-1, 3).astype(np.int32)
    triangles[soup.side[mine] < 0] = triangles[soup.side[mine] < 0][:, ::-1]
    at, corner = first // 3, first % 3
    face, side = soup.face[mine][at], soup.side[mine][at]
    weights = soup.weights[mine][at, corner]
    mesh = scene.meshes[instance.mesh]
    positions, normals = on_faces(mesh, face, weights, side)
    radiance = np.nan_to_num(values[samples], nan=0.0, posinf=0.0, neginf=0.0).astype(np.float32)
    return SurfaceMesh(
        positions, normals, radiance, triangles, face.astype(np.int32), weights.astype(np.float32),
        side.astype(np.float32), len(mesh.triangles), mesh.key,
    )  # fmt: skip
