"""Whether a reflector stands above a ground that goes on into the distance, and the box that answers for it.

popescu-2006 3.2 leaves both to the artist. Here the scene says: what lies under the reflector is looked at from the map's
centre E along a fan of directions, and is a ground when it is flat around the reflector and its surface goes on, in most
directions, to where a reflection no longer tells where on the reflector it started (REACH). A table top, a floor and the
floor of a room end before that, and stay what they are: quads.

The box. Parallax is radius / distance, the radius being that of the reflector seen from E: the walls stand where that
falls below ANGLE, or where the ground stops being flat, or something in the map stands on it. With walls at ANGLE the
morph turns no ray by more. H is the reflector's own height above the ground, for which the morph is a plane that goes on
(ground_box.py), and no less than its radius, so that the picture in the walls is squeezed to half at most.
"""

import numpy as np

from .billboard_fit import FINEST, FLAT, Quad
from .ground_box import Ground
from .job import BakeJob
from .rays import Rays
from .snapshot import Instance, corners_of

# Settings. ground_height: m from a ground that only the world's picture shows up to E; 0: there is none.
# ground_size: m, the box's width; 0: from the parallax. ground_morph: m, H; 0: from the reflector.
DEFAULTS = {"ground_height": 0.0, "ground_size": 0.0, "ground_morph": 0.0}
# Radians: parallax at the walls that nobody sees, the finest texel that reflections are looked at with.
ANGLE = FINEST
# The ground must go on to where parallax is ANGLE, in at least this share of directions ...
MOST = 0.5
# ... and be seen to end (a cliff, the mesh's rim) before that in no more than this share: a lake shore, not a table.
ENDS = 0.25
# Steeper than this it is no ground.
STEEPEST = np.radians(15)
# Less tilt than this is rounding: a box along the world's axes costs less.
UPRIGHT = 1e-4
# Directions of the fan, and the growth of the circles on the ground that it looks at: 14 % of a distance may hide a stone.
DIRECTIONS, GROWTH = 64, 1.14
# Past a circle a surface that goes on is met by this multiple of its radius; over a cliff the eye meets what is far below.
GOES_ON = 1.5
# Tangents of the directions above the horizon in which the ground may go on, as hills.
HILLS = np.linspace(0.0, 0.6, 13)


def find(job: BakeJob, quads: list[Quad], hidden: tuple[str, ...]) -> Ground | None:
    """The ground under a bake's reflector, or None. quads, hidden: what the bake has as stand-ins (billboards.quads_for)."""
    center = np.asarray(job.settings.get("center") or job.center(), np.float64)
    corners = corners_of(job.scene.bounds([job.reflector])) - center
    radius = float(np.linalg.norm(corners, axis=-1).max())
    if radius <= 0:
        return None
    for instance, height in _below(job, center):
        found = _plane(job, instance, center, height, radius, quads)
        if found is None:
            continue
        axes, height, members = found
        profile = _Profile(job, center, axes, height, radius / ANGLE, _stay(job, hidden, members))
        box = _box(job, corners @ axes.T, height, profile.flat, radius)
        if profile.goes_on and box is not None:
            return Ground(center, axes, *box, members)
    height = float(job.settings.get("ground_height") or 0.0)
    if height > 0:
        box = _box(job, corners, height, np.full(DIRECTIONS, np.inf), radius)
        return None if box is None else Ground(center, np.eye(3), *box, ())
    return None


def without(job: BakeJob, ground: Ground, quads: list[Quad], hidden: tuple[str, ...]) -> tuple[list[Quad], tuple[str, ...]]:
    """(quads, hidden) without the ground's: it is in the map. What else of its objects is flat, a facade, stays a quad."""
    names = _object_names(job, ground.members)
    owner = {i.name: i.object_name for i in (*job.scene.instances, *job.scene.lamps)}

    def stays(quad: Quad) -> bool:
        if owner[quad.instance] not in names:
            return True
        along, height = np.asarray(quad.normal) @ ground.axes[2], ground.local(np.asarray(quad.center))[2]
        return quad.shared and not (along > np.cos(STEEPEST) and abs(height - ground.low[2]) < FLAT * abs(ground.low[2]))

    return [q for q in quads if stays(q)], tuple(name for name in hidden if name not in names)


def _object_names(job: BakeJob, instances: tuple[str, ...]) -> set[str]:
    return {i.object_name for i in job.scene.instances if i.name in instances}


def _stay(job: BakeJob, hidden: tuple[str, ...], members: tuple[str, ...]) -> list[Instance]:
    """What the environment map will show."""
    gone = {*hidden, job.reflector.object_name} - _object_names(job, members)
    return [i for i in job.scene.instances if i.visible_glossy and i.object_name not in gone]


def _below(job: BakeJob, center: np.ndarray) -> list[tuple[Instance, float]]:
    """Instances straight under the centre and how far below it, nearest first."""
    down = Rays(center[None], np.array([[0.0, 0.0, -1.0]]))
    found = []
    for instance in job.scene.instances:
        if instance.object_name == job.reflector.object_name or not instance.visible_glossy:
            continue
        low, high = job.scene.bounds([instance])
        if np.all(low[:2] <= center[:2]) and np.all(center[:2] <= high[:2]) and low[2] < center[2]:
            distance = float(job.intersect(instance, down)[0])
            if 0 < distance < np.inf:
                found.append((instance, distance))
    return sorted(found, key=lambda pair: pair[1])


def _plane(job, instance: Instance, center, height: float, radius: float, quads: list[Quad]):
    """(axes, height of the centre above it, members) of the plane that the instance is below the centre, or None."""
    mine = [
        q for q in quads
        if q.shared and q.normal[2] > np.cos(STEEPEST) and q.instance == instance.name
        and abs((center - np.asarray(q.center)) @ np.asarray(q.normal) - height * q.normal[2]) < FLAT * height
    ]  # fmt: skip
    if mine:
        normal, at = np.asarray(mine[0].normal), np.asarray(mine[0].center)
    else:
        fitted = _fitted_plane(job, instance, center, height, radius)
        if fitted is None:
            return None
        normal, at = fitted
    axes = _axes(normal)
    height = float((center - at) @ axes[2])
    # A ground may be laid of many pieces.
    members = {instance.name} | {
        q.instance for q in quads
        if q.shared and np.asarray(q.normal) @ axes[2] > np.cos(UPRIGHT)
        and abs((center - np.asarray(q.center)) @ axes[2] - height) < FLAT * height
    }  # fmt: skip
    return (axes, height, tuple(sorted(members))) if height > 0 else None


def _fitted_plane(job, instance: Instance, center, height: float, radius: float):
    """(normal, point) of the least-squares plane through what lies within four radii under the centre."""
    ring = np.linspace(0.25, 4.0, 8) * max(height, radius)
    angle = np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS
    to = np.stack([np.outer(ring, np.cos(angle)), np.outer(ring, np.sin(angle)), np.full((8, DIRECTIONS), -height)], -1)
    to = to.reshape(-1, 3)
    direction = to / np.linalg.norm(to, axis=-1, keepdims=True)
    distance = job.intersect(instance, Rays(np.broadcast_to(center, to.shape), direction))
    # What is far from where a plane would be is another part of the instance: a kerb, a wall.
    near = np.isfinite(distance) & (np.abs(distance * -direction[:, 2] - height) < 0.5 * height)
    if near.sum() < DIRECTIONS:
        return None
    points = direction[near] * distance[near, None]
    for _ in range(3):
        middle = points.mean(0)
        _, _, across = np.linalg.svd(points - middle, full_matrices=False)
        normal = across[2] * (1.0 if across[2][2] > 0 else -1.0)
        off = np.abs((points - middle) @ normal)
        points = points[off <= max(2 * np.median(off), 1e-9 * height)]
        if len(points) < 8:
            return None
    return (normal, center + middle) if normal[2] > np.cos(STEEPEST) else None


def _axes(normal: np.ndarray) -> np.ndarray:
    """(3, 3) rows: along the ground nearest to the world's x, and the normal; the world's own where it is level."""
    if normal[2] > np.cos(UPRIGHT):
        return np.eye(3)
    x = np.array([1.0, 0.0, 0.0]) - normal * normal[0]
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(normal, x), normal])


class _Profile:
    """What E sees of the ground along a fan of directions.

    flat: (DIRECTIONS,) m, up to where the ground is the plane; goes_on: whether it is connected to the distant scene."""

    def __init__(self, job: BakeJob, center, axes, height: float, reach: float, instances: list[Instance]):
        circles = height / 4 * GROWTH ** np.arange(np.ceil(np.log(6 * reach / height) / np.log(GROWTH)).clip(4, 200))
        tangent = np.concatenate([-height / circles, HILLS])
        angle = (np.arange(DIRECTIONS) + 0.5) * 2 * np.pi / DIRECTIONS
        flat = np.stack([np.cos(angle), np.sin(angle)], -1)[:, None].repeat(len(tangent), 1)
        to = np.concatenate([flat, np.broadcast_to(tangent[:, None], (*flat.shape[:2], 1))], -1)
        length = np.linalg.norm(to, axis=-1)
        direction = (to / length[..., None]).reshape(-1, 3) @ axes
        distance = np.full(len(direction), np.inf)
        for instance in instances:
            distance = np.minimum(distance, job.intersect(instance, Rays(np.broadcast_to(center, direction.shape), direction)))
        # Along the ground.
        met = (distance.reshape(length.shape)) / length
        seen, rest = met[:, : len(circles)], met[:, len(circles) :]
        with np.errstate(invalid="ignore"):
            off = np.abs(seen - circles) * height / circles
            is_flat = off <= FLAT * np.hypot(circles, height)
        steps = np.where(is_flat.all(1), len(circles), is_flat.argmin(1))
        self.flat = np.where(steps > 0, circles[np.maximum(steps - 1, 0)], 0.0)
        after = np.minimum(steps, len(circles) - 1)
        beyond = seen[np.arange(DIRECTIONS), after]
        within = self.flat < reach
        ends = within & (beyond > GOES_ON * circles[after])
        far = np.where(np.isfinite(seen), seen, 0.0).max(1)
        far = np.maximum(far, np.where(np.isfinite(rest), rest, 0.0).max(1))
        self.goes_on = bool(ends.mean() <= ENDS and np.mean(~ends & (far >= reach)) >= MOST)


def _box(job: BakeJob, corners: np.ndarray, height: float, flat: np.ndarray, radius: float):
    """(low, high, H) of the box, or None where there is too little ground to hold the reflector.

    corners: (8, 3) of the reflector in the box's axes from the centre; flat: (DIRECTIONS,) m of flat ground."""
    reach = radius / ANGLE
    wanted = float(job.settings.get("ground_size") or 0.0)
    sides = np.full(4, wanted / 2) if wanted > 0 else _sides(flat, reach)
    if np.any(sides <= np.concatenate([-corners[:, :2].min(0), corners[:, :2].max(0)])):
        return None
    top = height + float(corners[:, 2].max())
    morph = float(job.settings.get("ground_morph") or 0.0) or max(top, radius)
    return np.array([-sides[0], -sides[1], -height]), sides[2:], morph


def _sides(flat: np.ndarray, reach: float) -> np.ndarray:
    """(4,) -x, -y, +x, +y: a rectangle within the flat ground, no side farther than `reach`; first the largest square."""
    angle = (np.arange(DIRECTIONS) + 0.5) * 2 * np.pi / DIRECTIONS
    c, s = np.cos(angle), np.sin(angle)

    def fits(sides) -> bool:
        rim = np.minimum(np.where(c > 0, sides[2], sides[0]) / np.abs(c), np.where(s > 0, sides[3], sides[1]) / np.abs(s))
        return bool(np.all(rim <= flat))

    steps = reach * GROWTH ** -np.arange(100.0)
    square = next((step for step in steps if fits(np.full(4, step))), 0.0)
    sides = np.full(4, square)
    for side in range(4):
        for step in steps[steps > square]:
            wider = sides.copy()
            wider[side] = step
            if fits(wider):
                sides = wider
                break
    return sides
