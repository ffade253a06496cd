"""Where a reflector's environment is captured from when something stands where its centre is.

Problem. From the centre of a mirror floor on which a table leg stands, or of a ring with a ball in its hole, one sees the
inside of the leg or the ball, and the whole map shows nothing else.
Idea. Then the map is captured from a point of the reflector's surface: the nearest to its centre from which what stands
there does not fill half of the view. A room is not in the way: it holds the reflector as well as its centre.
"""

import numpy as np

from .flat_parts import contains
from .job import BakeJob
from .reflected_samples import LIFT, points_on

# Points of the surface that are tried.
TRIED = 64
# What begins within this share of the reflector's size of its centre is around it: a leg stands on the floor, not in it.
TOUCHING = 1e-3


def clear_center(job: BakeJob, hide: tuple[str, ...]) -> np.ndarray:
    """(3,) float64: settings["center"] where given, else job.center(), or a point of the surface where another object, not
    named in `hide`, is around the centre and not around the reflector."""
    if given := job.settings.get("center"):
        return np.asarray(given, np.float64)
    center = job.center()
    low, high = job.scene.bounds([job.reflector])
    step = TOUCHING * float(np.linalg.norm(high - low))
    at = center + step * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    hide = {job.reflector.object_name, *hide}
    others = [i for i in job.scene.instances if i.object_name not in hide and i.visible_glossy]
    around = [i for i in others if any(contains(job.scene, i, p) for p in at)]
    if not around:
        return center
    points, _, _, normal = points_on(job.scene, job.reflector, TRIED, np.random.default_rng(4))
    normal = normal / np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-300)
    points = points + LIFT * job.scene.diagonal() * normal
    free, clear, blocked = np.ones(len(points), bool), np.ones(len(points), bool), False
    for instance in around:
        inside = np.array([contains(job.scene, instance, p) for p in points], bool)
        if inside.mean() > 0.5:
            continue  # a room
        blocked = True
        low, high = job.scene.bounds([instance])
        free &= ~inside
        clear &= np.linalg.norm(points - (low + high) / 2, axis=-1) > np.linalg.norm(high - low) / 2
    if not blocked or not free.any():
        return center
    distance = np.linalg.norm(points - center, axis=-1)
    if np.any(free & clear):
        return points[np.argmin(np.where(free & clear, distance, np.inf))]
    return points[np.argmax(np.where(free, distance, -np.inf))]
