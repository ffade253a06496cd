"""`box_proxy`: the environment lies on the walls of a box [popescu-2006 section 2, on Bjorke 2004].

Problem. Few environments are round; most rooms are boxes.
Idea. Intersect the ray with the inside of a box, and look the map up in the direction of that point from the map's
centre. core/box_fit.py finds the box, turned any way, from what the map itself saw.
Where we depart. Sides that show the sky are open: they lie at FAR, and a ray that passes the rim of the walls beside them
is answered by its direction, without parallax. A closed box has nothing of this in its shader, one along the world's axes
no turning, and where all is sky there is no box.
Limits. Furniture is painted onto the walls. Rays that start outside the box are answered from the nearest point on it,
which is the best a box can do for a reflector that sticks out.
"""

import numpy as np

from .. import box_fit, cubemap, spaces
from ..asset import Asset
from ..job import BakeJob
from ..kernel import Hit
from ..outlines import of_room as outlines  # noqa: F401  the method's own (methods/__init__.py)
from ..scene_items import geometry as inputs  # noqa: F401  distances are read, and no light
from ..slab import exit_distance
from . import environment

NAME = "box_proxy"
LABEL = "Box Proxy"
REQUIRES = ("environment",)
BAKE_EFFORT = 0.1
READS_REQUIRED = True
DEFAULTS = {}


def bake(job: BakeJob) -> Asset:
    """The box only; the cube map is the environment's."""
    room = job.required[environment.NAME]
    box = box_fit.fit(*cubemap.surface_points(room.images["radiance_tx"], room.uniforms), room.uniforms["center"])
    uniforms = {f"box_{name}": tuple(map(float, axis)) for name, axis in zip("xyz", box.axes, strict=True)}
    for name in ("low", "high", "rim_low", "rim_high"):
        uniforms[f"box_{name}"] = tuple(map(float, getattr(box, name)))
    options = {"turned": not np.array_equal(box.axes, np.eye(3)), "open": box.is_open(), "walls": box.has_walls()}
    return Asset(NAME, job.reflector.name, {}, uniforms, options, dict(job.settings), REQUIRES)


def trace(k, asset, ray) -> Hit:
    """The point where the ray leaves the box: the slab method's far distance."""
    if not asset.options["walls"]:
        return environment.answer(k, asset, ray.direction, ray.spread, spaces.STATUS_FELL_BACK)
    u = asset.uniforms
    start = ray.origin - u["center"]

    def to_box(v):
        return k.vec3(k.dot(u["box_x"], v), k.dot(u["box_y"], v), k.dot(u["box_z"], v)) if asset.options["turned"] else v

    def to_world(v):
        return u["box_x"] * v.x + u["box_y"] * v.y + u["box_z"] * v.z if asset.options["turned"] else v

    low, high = u["box_low"], u["box_high"]
    inside = k.name("box_start", k.min(k.max(to_box(start), low), high))
    along = k.name("box_along", to_box(ray.direction))

    distance = k.name("box_exit", k.min(*(exit_distance(k, inside, along, low, high, axis) for axis in "xyz")))
    # Seen from the centre: undo the clamping by staying in the box's own axes and turning back.
    in_box = k.name("box_wall", inside + along * distance)
    seen = to_world(in_box)
    footprint = (ray.width + ray.spread * distance) / k.max(k.length(seen), 1e-30)
    if asset.options["open"]:
        past = k.max(in_box - u["box_rim_high"], u["box_rim_low"] - in_box)
        to_sky = k.name("to_sky", k.max(past.x, past.y, past.z) > 0.0)
        seen, footprint = k.select(to_sky, ray.direction, seen), k.select(to_sky, ray.spread, footprint)
    return environment.answer(k, asset, seen, footprint, spaces.STATUS_HIT)
