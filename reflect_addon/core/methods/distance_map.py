"""`distance_map`: the environment map localised by its own distances [Szirmay-Kalos, Aszodi, Lazanyi and Premecz 2005,
"Approximate Ray-Tracing on the GPU with Distance Impostors", Computer Graphics Forum 24 (3)].

Problem. The environment is neither far away nor a sphere nor a box, but its map may hold how far each texel's surface
is.
Idea. The point that the ray hits is guessed and the guess bettered: between a point of the ray in front of the surface
("undershooting") and one behind it ("overshooting") the next guess lies where the ray meets the plane through the two
surface points that the map has in these directions. Where both see one plane, the first guess is exact. The search is
the false position of core/distance_search.py between the ray's start and its point at infinity.
Where we depart. An end that stays halves its value ("Illinois"), which at six guesses on `contact` takes a fifth off
the median hit error. Distances are blended of four texels, as graphics cards do: with single ones `contact` has, at six
guesses, 6.5 % false hits instead of 3.5 % (and 8.0 % missed instead of 9.3 %).
Limits. No marching: where several surfaces lie along the ray any of them may be found, and the sky at the ray's end is
taken for the answer though something stands before it. What the centre does not see is not there.
"""

from .. import cubemap, distance_search, spaces
from ..asset import Asset
from ..job import BakeJob
from ..kernel import Hit
from ..outlines import of_center as outlines  # noqa: F401  the method's own (methods/__init__.py)
from ..scene_items import geometry as inputs  # noqa: F401  distances are read, and no light
from ..settings import Setting
from . import environment

NAME = "distance_map"
LABEL = "Distance Map"
REQUIRES = ("environment",)
BAKE_EFFORT = 0.1
READS_REQUIRED = True
EFFORT = 4.0
SETTINGS = {
    "guesses": Setting("Guesses", "Steps that look for the point which a reflected ray hits. Each costs time for each pixel",
                       soft_high=16, advanced=True)
}  # fmt: skip
DEFAULTS = {"guesses": 8}


def bake(job: BakeJob) -> Asset:
    """Options only; the cube map is the environment's."""
    room = job.required[environment.NAME]
    seen, _ = cubemap.surface_points(room.images["radiance_tx"], room.uniforms)
    options = {"guesses": int(job.settings["guesses"]) if len(seen) else 0}
    return Asset(NAME, job.reflector.name, {}, {}, options, dict(job.settings), REQUIRES)


def trace(k, asset, ray) -> Hit:
    """False position between the ray's start and its point at infinity."""
    guesses = asset.options["guesses"]
    if not guesses:  # a bare sky
        return environment.answer(k, asset, ray.direction, ray.spread, spaces.STATUS_FELL_BACK)
    way = distance_search.path(k, asset, ray)

    def g(t):
        q = way.towards(t)
        stored = cubemap.stored_distance(k, asset, q, blended=True)
        return distance_search.nearness(k, way, q, stored, asset.uniforms["distance_scale"]) - (1.0 - t)

    k.cite("szirmay-kalos-2005: first guess from the texels of the start's direction and of the ray's")
    t = distance_search.refine(k, g, guesses, 0.0, 1.0)
    return environment.answer(k, asset, way.towards(t), way.footprint(k, t, ray), spaces.STATUS_HIT)
