"""core/curved_march.py: rays from all over a ball followed through its one view of a room, against where they meet its walls."""

from types import SimpleNamespace

import numpy as np
import tolerances
from mirror_views import camera

from reflect_addon.core import curved_march
from reflect_addon.core.curved_views import NEAR, CurvedMirror, approximate_view
from reflect_addon.core.kernel import evaluate, record_function

BALL = CurvedMirror(0, np.array([0.3, -0.2, 0.4]), 0.5, 1.0)
ROOM = 2.0  # m, half a side
EYE = camera((1.6, -1.5, 1.2), BALL.center)


def walls(origin, direction):
    """Distance to the walls, from within."""
    with np.errstate(divide="ignore"):
        return ((np.sign(direction) * ROOM - origin) / direction).min(1)


def colour(place):
    return 0.5 + 0.4 * np.sin(2 * place)


def marched(origin, direction, side=96):
    view = approximate_view(BALL, EYE, side)
    rays, eye = view.primary_rays(), view.world_from_camera[:3, 3]
    place = rays.origin + rays.direction * walls(rays.origin, rays.direction)[:, None]
    shape, alpha = (side, side, 4), np.ones((len(place), 1))
    images = {n: np.hstack([v, alpha]).reshape(shape).astype(np.float32) for n, v in (("picture_tx", colour(place)), ("place_tx", place))}
    rigid = np.eye(4)
    rigid[:3, :3] = view.world_from_camera[:3, :3].T
    clip = view.clip_from_camera @ rigid
    values = {
        "start": origin - eye, "direction": direction, "eye": eye, "forward": -view.world_from_camera[:3, 2], "row_x": side / 2 * (clip[0] + clip[3]),
        "row_y": side / 2 * (clip[1] + clip[3]), "row_w": clip[3], "window": (0, 0, side, side),
        "footprint": 2 / (view.clip_from_camera[1, 1] * side), "reach": 50.0, "nearest": NEAR * BALL.radius,
    }  # fmt: skip
    wide = {n: np.broadcast_to(np.asarray(v, np.float32), (len(origin), *np.shape(v)[-1:]) if np.ndim(v) else len(origin)) for n, v in values.items()}
    program = record_function(curved_march.march, curved_march.INPUTS, curved_march.IMAGES)
    return view, evaluate(program, wide, SimpleNamespace(images=images, uniforms={}))


def unit(rng, count):
    found = rng.normal(size=(count, 3))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def test_what_is_in_the_picture_is_found_and_nothing_else(rng):
    """From any point of the ball away from it, the sides and the back among them: found is whose meeting is in the picture."""
    normal, direction = unit(rng, 4000), unit(rng, 4000)
    direction *= np.sign((normal * direction).sum(1))[:, None]
    origin = BALL.center + BALL.radius * normal
    far = walls(origin, direction)
    place = origin + far[:, None] * direction
    view, found = marched(origin, direction)
    clip = np.column_stack([place, np.ones(len(place))]) @ view.clip_from_world().T
    seen = (np.abs(clip[:, :2]) < clip[:, 3:]).all(1)
    said = found["found"] > 0.5
    assert 0.1 < seen.mean() < 0.5 and (said == seen).mean() > 1 - tolerances.CURVED_FOUND
    both = said & seen
    assert np.median(np.abs(found["distance"][both] / far[both] - 1)) < tolerances.CURVED_DISTANCE
    off = np.abs(found["radiance"] - colour(place)).max(1)[both]
    assert np.median(off) < tolerances.CURVED_COLOUR and np.isfinite(found["radiance"]).all()
    started = np.column_stack([origin, np.ones(len(place))]) @ view.clip_from_world().T
    assert (both & ~(np.abs(started[:, :2]) < started[:, 3:]).all(1)).sum() > 200, "rays that start beside the picture and enter it"


def test_any_ray_has_a_finite_answer(rng):
    """From the eye itself and beside it, with no direction, straight on and straight back."""
    origin, direction = BALL.center + rng.normal(0, 0.3, (500, 3)), unit(rng, 500)
    origin[:3], direction[0], direction[1] = BALL.center, 0.0, -(EYE.world_from_camera[:3, 3] - BALL.center)
    _, found = marched(origin, direction)
    assert all(np.isfinite(v).all() for v in found.values())
