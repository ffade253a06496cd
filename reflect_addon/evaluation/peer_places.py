"""Where EEVEE's light probes stand: what its manual advises, worked out from the scene.

Sphere probes at the centres of the reflectors that fill most pixels, each acting on its reflector (the first one on the whole scene); in a
closed room a probe in the room's middle whose parallax is the fitted box (core/box_fit.py), if nothing stands there; a plane probe before each
of the planar mirrors (core/mirror_planes.py) that face the camera, largest first. Limits: Blender centres a probe's box on the probe, so a
room is seen from its middle and not from its reflector.
"""

import numpy as np

from ..core import box_fit
from ..core.camera import Camera
from ..core.flat_parts import contains
from ..core.mirror_planes import MirrorPlane, planes_of
from ..core.rays import Rays
from ..core.snapshot import SceneSnapshot, corners_of
from ..scene.eevee_job import Probe
from ..scene.intersect import intersector

MOST_SPHERES = 8  # each costs six views of the scene
MOST_PLANES = 4  # each costs the scene once more for every sample
DIRECTIONS = 2000  # by which a room is looked at: a wall of a cube gets 300
FITS = 0.1  # mean relative error of a box's distances up to which a scene is a room
BEFORE = 1e-3  # of the scene's diagonal: a plane probe's distance from its mirror; 0.01 m in a room of 10 m
SURE = 10  # of BEFORE: how far before its plane a probe acts


def spheres(snapshot: SceneSnapshot, pixels: np.ndarray) -> tuple[list[Probe], list[str]]:
    """(probes, names of the objects in whose middle they stand). pixels: of each reflector."""
    reflectors, corners = snapshot.reflectors(), corners_of(snapshot.bounds())
    probes, names = [], {}
    for number, index in enumerate(i for i in np.argsort(-pixels, kind="stable")[:MOST_SPHERES] if pixels[i]):
        low, high = snapshot.bounds([reflectors[index]])
        centre = (low + high) / 2
        reach = float(np.linalg.norm(corners - centre, axis=-1).max())
        own = float(np.linalg.norm(high - low)) / 2
        probes.append(Probe("SPHERE", _plain(centre), own if number else reach, reach))
        names[reflectors[index].object_name] = None
    return probes, list(names)


def room(snapshot: SceneSnapshot, hidden: list[str]) -> Probe | None:
    """A probe in the middle of the room, where the scene is one. hidden: objects that are none of its walls."""
    low, high = snapshot.bounds()
    others = [i for i in snapshot.instances if i.object_name not in hidden]
    centre, box = (low + high) / 2, None
    for _ in range(2):  # seen from the scene's middle, then from the middle of the box that was found
        box = _box(snapshot, others, centre)
        if box is None:
            return None
        centre = centre + (box.low + box.high) / 2 @ box.axes
    if any(contains(snapshot, i, centre) and not _holds(snapshot, i, others) for i in others):
        return None
    half = (box.high - box.low) / 2
    return Probe("BOX", _plain(centre), float(half.max()), float(np.linalg.norm(high - low)), tuple(map(_plain, box.axes)), _plain(half))


def planes(snapshot: SceneSnapshot, camera: Camera, pixels: np.ndarray) -> list[Probe]:
    """Probes before the largest planar mirrors that the camera sees from their front."""
    eye, diagonal = np.asarray(camera.world_from_camera, np.float64)[:3, 3], snapshot.diagonal()
    seen = [p for p in planes_of(snapshot) if pixels[p.reflector] and (eye - p.origin) @ p.normal > 0]
    return [_plane(p, diagonal) for p in sorted(seen, key=lambda p: -_angle(p, eye))[:MOST_PLANES]]


def _box(snapshot: SceneSnapshot, others: list, centre: np.ndarray) -> box_fit.Box | None:
    directions = box_fit.even_directions(DIRECTIONS)
    rays = Rays(np.broadcast_to(centre, directions.shape).astype(np.float32), directions.astype(np.float32))
    intersect = intersector(snapshot)
    away = np.min([intersect(i, rays) for i in others], axis=0, initial=np.inf) if others else np.full(DIRECTIONS, np.inf)
    hit = np.isfinite(away)
    points = centre + directions[hit] * away[hit, None]
    weight = np.full(len(points), 4 * np.pi / DIRECTIONS)
    box = box_fit.fit(points, weight, centre)
    is_room = box.has_walls() and not box.is_open() and box_fit.error((points - centre) @ box.axes.T, weight, box) < FITS
    return box if is_room else None


def _holds(snapshot: SceneSnapshot, instance, others: list) -> bool:
    """Whether the instance is the room itself: as large as all the others together."""
    low, high = snapshot.bounds([instance])
    lowest, highest = snapshot.bounds(others)
    return bool(np.all(high - low >= 0.9 * (highest - lowest)))


def _plane(plane: MirrorPlane, diagonal: float) -> Probe:
    """The mirror's outline in a rectangle along its longest edge."""
    edges = np.roll(plane.outline, -1, axis=0) - plane.outline
    x = edges[np.argmax(np.linalg.norm(edges, axis=-1))]
    x = x / np.linalg.norm(x)
    y = np.cross(plane.normal, x)
    flat = (plane.outline - plane.origin) @ np.stack([x, y], -1)
    low, high = flat.min(0), flat.max(0)
    middle = plane.origin + (low + high) / 2 @ np.stack([x, y]) + BEFORE * diagonal * plane.normal
    axes = tuple(_plain(axis) for axis in (x, y, plane.normal))
    return Probe("PLANE", _plain(middle), SURE * BEFORE * diagonal, diagonal, axes, (*_plain((high - low) / 2), 1.0))


def _angle(plane: MirrorPlane, eye: np.ndarray) -> float:
    """How large it looks, about: its area's solid angle."""
    around = plane.outline - plane.outline[0]
    area = np.linalg.norm(np.cross(around[1:-1], around[2:]).sum(0)) / 2
    away = eye - plane.origin
    return float(area * (away @ plane.normal) / max(np.linalg.norm(away) ** 3, 1e-300))


def _plain(vector) -> tuple[float, ...]:
    return tuple(map(float, vector))
