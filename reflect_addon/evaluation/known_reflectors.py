"""Reflectors from formulas, and where they reflect: the truth that searches in reflector maps are held against.

Problem. The error of a reflection point can only be told from a solution that shares nothing with the search: no maps, no bisectors.
Idea. Fermat's: on a convex reflector light takes the shortest way by way of it, found on the formula itself (shortest_ways.py). For a
plane the answer is in closed form.
Which pairs. Eyes and vertices in shells around the reflector, outside it. Lit are those whose segment misses the solid body; the region
of interest [estalella-2005 section 4.2] are lit pairs whose shortest way touches the piece of surface that is there.
All in map space: sizes are about 1, centres the origin.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace

import numpy as np

from ..core import reflection_search
from ..core.kernel import evaluate, record_function
from ..core.reflector_map import IMAGES, ReflectorMap, Surface, atlas, build, look
from .shortest_ways import reflected

BATCH = 20_000  # pairs at a time
# Eyes and vertices of pairs are so far above the body, as round bodies' shells are; random pairs' shells begin at NEAR, in sizes.
CLEAR, NEAR = 0.2, 1.2


@dataclass(frozen=True)
class Known:
    """A reflector: what its map is made of, the shortest ways over it, and what its body hides."""

    surface: Surface
    point: Callable  # parameters (N, 2), charts (N, ...) -> points (N, 3)
    chart: Callable  # points (N, 3) on the surface -> what `point` needs around each, whose parameters are then 0
    touched: Callable  # (eye, vertex) (N, 3) -> points (N, 3) of the surface to start from, before the body
    hidden: Callable  # (eye, vertex) (N, 3) -> (N,) bool: the body is between them
    height: Callable  # points (N, 3) -> (N,) how far they are above the body, straight up, or from the centre, over its radius there
    there: Callable  # points (N, 3) of the endless surface, margin -> (N,) bool: this piece has them, that far from its rim


def ellipsoid(*axes: float) -> Known:
    """Half axes, about the origin. Charts are tangent planes of the unit sphere that it is stretched from."""
    a = np.asarray(axes, np.float64)

    def surface(d):
        distance = 1 / np.linalg.norm(d / a, axis=-1)
        return distance, _unit(d * distance[:, None] / a**2), np.ones(len(d), bool)

    def touched(eye, vertex):
        return _unit(_nearest(eye / a, vertex / a)) * a

    def chart(p):
        s = _unit(p / a)
        first = _unit(np.cross(s, np.eye(3)[np.abs(s).argmin(-1)]))
        return np.stack([s, first, np.cross(s, first)], 1)

    def point(u, basis):
        return _unit(basis[:, 0] + u[:, :1] * basis[:, 1] + u[:, 1:] * basis[:, 2]) * a

    def hidden(eye, vertex):
        return np.linalg.norm(_nearest(eye / a, vertex / a), axis=-1) < 1

    return Known(surface, point, chart, touched, hidden, lambda p: np.linalg.norm(p / a, axis=-1) - 1, lambda p, margin: np.ones(len(p), bool))


def paraboloid(top: float = 0.5, bend: float = 0.4) -> Known:
    """An open cap, z = top - bend r^2 up to r = 1, that reflects upwards; the map's centre is `top` below its top."""

    def surface(d):
        # t d.z = top - bend t^2 (d.x^2 + d.y^2), the larger t
        square = bend * (d[:, 0] ** 2 + d[:, 1] ** 2)
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = 2 * top / (d[:, 2] + np.sqrt(d[:, 2] ** 2 + 4 * square * top))
        p = d * distance[:, None]
        normal = _unit(np.stack([2 * bend * p[:, 0], 2 * bend * p[:, 1], np.ones(len(d))], -1))
        return distance, normal, p[:, 0] ** 2 + p[:, 1] ** 2 < 1

    def point(u, chart):
        x, y = (u + chart).T
        return np.stack([x, y, top - bend * (x * x + y * y)], -1)

    def hidden(eye, vertex):
        # How far a segment is above the paraboloid is a parabola in its own length: lowest where its slope is 0.
        along = vertex - eye
        slope = along[:, 2] + 2 * bend * (eye[:, :2] * along[:, :2]).sum(-1)
        curve = 2 * bend * (along[:, :2] ** 2).sum(-1)
        place = eye + np.clip(-slope / np.maximum(curve, 1e-12), 0, 1)[:, None] * along
        return place[:, 2] < top - bend * (place[:, :2] ** 2).sum(-1)

    return Known(
        surface, point, lambda p: p[:, :2], lambda eye, vertex: point((eye[:, :2] + vertex[:, :2]) / 2, 0.0), hidden,
        lambda p: p[:, 2] - top + bend * (p[:, :2] ** 2).sum(-1),
        lambda p, margin: np.linalg.norm(p[:, :2], axis=-1) < 1 - margin,
    )  # fmt: skip


def plane(below: float = 0.7) -> Known:
    """The square |x|, |y| < 1 at z = below, reflecting upwards; the map's centre is behind it."""

    def surface(d):
        distance = np.where(d[:, 2] > 1e-9, below / np.maximum(d[:, 2], 1e-9), -1.0)
        normal = np.broadcast_to([0.0, 0.0, 1.0], d.shape)
        return distance, normal, (d[:, 2] > 1e-9) & (np.abs(d[:, :2] * distance[:, None]) < 1).all(-1)

    def touched(eye, vertex):
        high = (eye[:, 2:] - below, vertex[:, 2:] - below)
        p = (eye * high[1] + vertex * high[0]) / (high[0] + high[1])
        return np.concatenate([p[:, :2], np.full((len(p), 1), below)], -1)

    return Known(
        surface, lambda u, p: p + np.pad(u, ((0, 0), (0, 1))), lambda p: p, touched,
        lambda eye, vertex: np.minimum(eye[:, 2], vertex[:, 2]) < below, lambda p: p[:, 2] - below, lambda p, margin: (np.abs(p[:, :2]) < 1 - margin).all(-1),
    )  # fmt: skip


def random_pairs(rng, count: int, near=NEAR, far=8.0) -> tuple[np.ndarray, np.ndarray]:
    """(eyes, vertices) (count, 3), evenly over directions and distances from the centre."""
    eye, vertex = (_unit(rng.normal(size=(count, 3))) * rng.uniform(near, far, (count, 1)) for _ in range(2))
    return eye, vertex


def pairs_of_interest(rng, known: Known, count: int, margin=0.0, clear=CLEAR, **shell) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(eyes, vertices, reflection points) (count, 3): random pairs of the region of interest, whose points are at least
    `margin` from an open rim, as a rim is known to a texel, and that are both `clear` above the body."""
    parts, have = [], 0
    while have < count:
        eye, vertex = random_pairs(rng, min(2 * count, BATCH), **shell)
        lit = ~known.hidden(eye, vertex) & (np.minimum(known.height(eye), known.height(vertex)) >= clear)
        eye, vertex = eye[lit], vertex[lit]
        point = reflected(known, eye, vertex)
        seen = known.there(point, margin)
        parts.append((eye[seen], vertex[seen], point[seen]))
        have += int(seen.sum())
    return tuple(np.concatenate(p)[:count] for p in zip(*parts, strict=True))


def map_of(known: Known, side: int) -> ReflectorMap:
    return build(np.zeros(3), 1.0, side, known.surface)


def search(kernel, made: ReflectorMap, eye, vertex, start=None, mirror=1.0, steps=24, tolerance=None, dtype=np.float32, counts=None) -> dict:
    """What a search (reflection_search.newton or midpoint) says of pairs; points (N, 3) or (N, 4). start: (N, 3) directions.

    The whole reflector is one part: nothing is rejected early."""
    images, blocks = atlas([made])
    count = len(eye)
    inputs = {
        "observer": _homogeneous(eye), "vertex": _homogeneous(vertex),
        "start": np.zeros((count, 4)) if start is None else _homogeneous(start),
        "block": np.tile((*blocks[0], mirror), (count, 1)), "ball": np.tile((0, 0, 0, 1.0), (count, 1)),
        "cone": np.tile((0, 0, 1.0, -1.0), (count, 1)),
    }  # fmt: skip
    tolerance = reflection_search.TOLERANCE if tolerance is None else tolerance
    asset = SimpleNamespace(images=images, uniforms={})
    return evaluate(_program(kernel, int(steps), float(tolerance)), inputs, asset, dtype=dtype, counts=counts)


@cache
def first_search(way: Callable) -> Callable:
    """Kernel of reflection_search.descend or .follow alone, without what comes after it for hidden vertices; the place that it ended
    at is looked up once more, which `evaluations` leaves out."""

    def kernel(k, scope, observer, vertex, start, block, ball, cone):
        begin = reflection_search.begin_at(k, observer, vertex, start)
        direction, residual, evaluations, *_ = way(k, scope, observer, vertex, block, begin)
        here = look(k, scope, block, direction, False)
        return {"point": here.point, "normal": k.normalize(here.normal), "residual": residual, "evaluations": evaluations}

    return kernel


@cache
def _program(kernel, steps: int, tolerance: float):
    return record_function(kernel, reflection_search.INPUTS, IMAGES, options={"steps": steps, "tolerance": tolerance})


def _homogeneous(points) -> np.ndarray:
    points = np.asarray(points, np.float64)
    return points if points.shape[1] == 4 else np.pad(points, ((0, 0), (0, 1)), constant_values=1.0)


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-300)


def _nearest(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(N, 3) the point of each segment that is nearest to the origin."""
    along = b - a
    share = np.clip(-(a * along).sum(-1) / np.maximum((along**2).sum(-1), 1e-300), 0, 1)
    return a + share[:, None] * along
