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
# Steps between a circle and the next in which a ground that goes on is told from an edge.
EDGE_STEPS = 4


def find(job: BakeJob, quads: list[Quad], hidden: tuple[str, ...], center: np.ndarray) -> Ground | None:
    """The ground under a bake's reflector, or None. quads, hidden: what the bake has as stand-ins (billboards.quads_for);
    center: (3,), where the map is captured from."""
    corners = corners_of(job.scene.bounds([job.reflector])) - center
    radius = float(np.linalg.norm(corners, axis=-1).max())
    if radius <= 0:
        return None
    for instance, height in _below(job, center):
        found = _plane(job, instance, center, height, radius, quads)
        if found is None:
            continue
        axes, height, members = found
        # Who says how large the box is wants it on any ground that is as large.
        reach = float(job.settings.get("ground_size") or 0.0) / 2 or radius / ANGLE
        flat = _flat_to(job, center, axes, height, radius / ANGLE, _stay(job, hidden, members))
        box = _box(job, corners @ axes.T, height, flat, radius)
        pieces = [i for i in job.scene.instances if i.name in members]
        if box is not None and _goes_on(job, center, axes, height, reach, flat, pieces):
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
        along, height = abs(np.asarray(quad.normal) @ ground.axes[2]), ground.local(np.asarray(quad.center))[2]
        # As near to the plane as what is flat may be thick.
        on_plane = abs(height - ground.low[2]) <= FLAT * max(-ground.low[2], 2 * max(quad.half_u, quad.half_v))
        return quad.shared and not (along > np.cos(STEEPEST) and on_plane)

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
    to = np.stack([*(np.outer(ring, c) for c in _compass()), np.full((8, DIRECTIONS), -height)], -1).reshape(-1, 3)
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


def _flat_to(job: BakeJob, center, axes, height: float, reach: float, instances: list[Instance]) -> np.ndarray:
    """(DIRECTIONS,) m along the ground: how far E sees it as the plane."""
    steps = np.ceil(np.log(1.5 * reach / (height / 4)) / np.log(GROWTH)).clip(4, 200) + 1  # a square's corners lie at 1.41
    circles = height / 4 * GROWTH ** np.arange(steps)
    to = np.stack([*(np.multiply.outer(c, circles) for c in _compass()), np.full((DIRECTIONS, len(circles)), -height)], -1)
    length = np.linalg.norm(to, axis=-1)
    met = _first(job, instances, center, (to / length[..., None]).reshape(-1, 3) @ axes).reshape(length.shape)
    # Told from the plane by less than FLAT of the distance, or by a parallax that nobody sees (reach = radius / ANGLE).
    flat = (np.abs(met - length) <= FLAT * length) | (np.abs(1 / met - 1 / length) * reach <= 1.0)
    count = np.where(flat.all(1), len(circles), flat.argmin(1))
    return np.where(count > 0, circles[np.maximum(count - 1, 0)], 0.0)


def _goes_on(job: BakeJob, center, axes, height: float, reach: float, flat: np.ndarray, members: list[Instance]) -> bool:
    """Whether the ground is there, flat or not, at `reach` in MOST directions, and ends on the way in few.

    Looked at from straight above: a valley may hide from E."""
    above = max(float((job.scene.bounds(members)[1] - center) @ axes[2]), 0.0) + reach

    def heights(away: np.ndarray) -> np.ndarray:
        at = np.stack([*(c * away for c in _compass()), np.full(DIRECTIONS, above)], -1) @ axes + center
        return above + height - _first(job, members, at, np.broadcast_to(-axes[2], at.shape))

    ends, before = np.zeros(DIRECTIONS, bool), np.zeros(DIRECTIONS)
    for step in range(1, EDGE_STEPS + 1):
        width = flat * (GROWTH - 1) / EDGE_STEPS
        here = heights(flat + width * step)
        with np.errstate(invalid="ignore"):
            ends |= before - here > width  # falls by more than 45 degrees; nothing is infinitely deep
        before = here
    ends &= flat < reach
    return bool(ends.mean() <= ENDS and np.mean(~ends & np.isfinite(heights(np.full(DIRECTIONS, reach)))) >= MOST)


def _compass() -> tuple[np.ndarray, np.ndarray]:
    angle = (np.arange(DIRECTIONS) + 0.5) * 2 * np.pi / DIRECTIONS
    return np.cos(angle), np.sin(angle)


def _first(job: BakeJob, instances: list[Instance], origin, direction) -> np.ndarray:
    """(N,) distances to whatever of these instances is met first, inf = nothing."""
    rays = Rays(np.broadcast_to(origin, direction.shape), direction)
    return np.min([np.full(len(direction), np.inf), *(job.intersect(i, rays) for i in instances)], axis=0)


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
    # Between two directions of the fan the ground is as flat as along the less flat one; along an axis a side is farthest.
    between = np.arange(0, DIRECTIONS, 0.25)
    angle = between * 2 * np.pi / DIRECTIONS
    c, s = (np.where(np.abs(v) > 1e-9, v, 1e-9) for v in (np.cos(angle), np.sin(angle)))
    flat = np.minimum(*(flat[whole.astype(int) % DIRECTIONS] for whole in (np.floor(between - 0.5), np.ceil(between - 0.5))))

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
