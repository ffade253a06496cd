"""`layered_distance`: marching through layers of cube maps with distances [GPU Gems 3, chapter 17: Umenhoffer, Patow,
Szirmay-Kalos 2007, "Robust Multiple Specular Reflections and Refractions"].

Problem. A guess that is bettered (`distance_map`) may find any of several surfaces, and one map has one surface a
direction.
Idea. A layered distance map holds the surface that is seen from the centre, the one behind it, and so on (17.2.1,
core/depth_layers.py). The ray marches in steps of a texel or two until it passes from before a layer's surface to
behind it or back (linear search), then false positions find the place (secant search, 17.2.2); the nearest layer wins.
Where we depart. All layers march together, so the first crossing ends the march. g of core/distance_search.py instead
of a ratio. Silhouettes are no surfaces: between two texels of very different distance the ray flies on (the chapter takes
the crossing there). The chapter has an environment that is met everywhere; here a ray that meets nothing is answered by
the last sky that it passed (`contact` without lamps: 0.2 % false hits; 10.6 % by its direction). Distances of single
texels: blended ones cost four times the fetches, and RMSE was less on one sample, more on two. No normals: they serve
the chapter's second bounce, and no kernel here reads them.
Limits. The reflector is in no layer, so it does not see itself (the chapter's does). Surfaces that the centre sees at a
slant have few texels. A step costs a fetch a layer. Shader nodes unroll the march, and compile for minutes.
"""

from dataclasses import dataclass, replace

import numpy as np

from .. import cubemap, distance_search, spaces
from ..asset import Asset, half_with_scale
from ..depth_layers import Layer, layers_behind
from ..job import BakeJob
from ..kernel import Hit
from ..kernel.values import Value
from ..outlines import of_center as outlines  # noqa: F401  the method's own (methods/__init__.py)
from ..settings import Setting
from . import environment

NAME = "layered_distance"
LABEL = "Layered Distance Map"
REQUIRES = ()
BAKE_EFFORT = 1.5
EFFORT = 25.0
SETTINGS = {
    "layers": Setting("Layers", "Surfaces behind each other that the map holds in each direction. More find what is hidden "
                      "behind other things and cost time for each pixel", soft_high=8, advanced=True),
    "stride": Setting("Stride", "Texels of the map that a step of the march covers. Fewer find thinner things, slower",
                      soft_high=16, advanced=True),
    "iterations": Setting("Iterations", "Steps that refine the hit once the march has found it", soft_high=16, advanced=True),
}  # fmt: skip
# layers: at most, as many as hold surfaces; stride: texels a step; iterations: false positions after the march.
DEFAULTS = {**environment.DEFAULTS, "layers": 3, "stride": 2, "iterations": 3}


def bake(job: BakeJob) -> Asset:
    """The environment map, and above it in the same image the layers behind what it sees."""
    hide = (job.reflector.object_name,)
    front = environment.capture(job, NAME, hide)
    n, center = int(front.uniforms["cube_size"]), np.asarray(front.uniforms["center"])
    if not len(cubemap.surface_points(front.images["radiance_tx"], front.uniforms)[0]):
        return replace(front, options={"layers": 0})
    rays = cubemap.bundle(center, n)
    behind = layers_behind(job, rays, int(job.settings["layers"]) - 1, hide, int(job.settings["samples"]))
    images, scales = _images(front, behind, n, center)
    stride = int(job.settings["stride"])
    return replace(
        front,
        images={"radiance_tx": np.concatenate([front.images["radiance_tx"], *images])},
        uniforms={
            **front.uniforms, **scales,
            "layer_height": float(cubemap.image_size(n)[0]), "march_texels": n / 2 / stride,
        },  # fmt: skip
        options={
            "layers": 1 + len(behind),
            # A path as long as the cube's edge, which few of a round reflector's rays exceed: they take longer steps.
            "steps": -(-n // stride),
            "iterations": int(job.settings["iterations"]),
        },
    )


def _images(front: Asset, behind: list[Layer], n: int, center: np.ndarray) -> tuple[list[np.ndarray], dict[str, float]]:
    """(pyramids of the layers behind, their common scales). Where a layer ends, it shows the one before it, so that its
    edge blends as the edges of the environment do."""
    level = front.images["radiance_tx"][: n + 2, : 6 * (n + 2), :3]
    before = level.astype(np.float32) * front.uniforms["radiance_scale"]
    levels = []
    for layer in behind:
        level = np.zeros((*before.shape[:2], 4), np.float32)
        hit = layer.hit.reshape(before.shape[:2])
        before = level[..., :3] = np.where(hit[..., None], layer.radiance.reshape(before.shape), before)
        distance = np.linalg.norm(layer.position - center, axis=-1).reshape(hit.shape)
        level[..., 3] = np.where(hit, distance, 0.0)
        levels.append(level)
    if not levels:
        return [], {"back_radiance_scale": 1.0, "back_distance_scale": 1.0}
    radiance, radiance_scale = half_with_scale(np.stack([level[..., :3] for level in levels]))
    distance_scale = max(float(level[..., 3].max()) for level in levels) / cubemap.FARTHEST
    for level, half in zip(levels, radiance, strict=True):
        level[..., :3] = half
        level[..., 3] /= distance_scale
    scales = {"back_radiance_scale": radiance_scale, "back_distance_scale": distance_scale}
    return [cubemap.pyramid(level) for level in levels], scales


@dataclass(frozen=True)
class Met:
    """Where a ray ends in the map."""

    seen: Value  # vec3: the direction of it from the map's centre
    footprint: Value  # as seen from there
    bottom: Value  # row where the layer begins that shows it
    scales: list[Value]  # of radiance and distance in that layer
    solid: Value  # bool: a surface was met; else it is the backdrop
    far: Value  # m along the ray


def meet(k, asset, ray) -> Met:
    """March, then false positions in the layer that was met."""
    layers, u = asset.options["layers"], asset.uniforms
    way = distance_search.path(k, asset, ray)

    def nearness_of(layer: int, q):
        stored = cubemap.stored_distance(k, asset, q, u["layer_height"] * float(layer) if layer else 0.0)
        return distance_search.nearness(k, way, q, stored, u["back_distance_scale"] if layer else u["distance_scale"])

    k.cite("GPU Gems 3, 17.2.2: linear search")
    found = distance_search.march(k, way, nearness_of, layers, asset.options["steps"], u["march_texels"])
    is_behind, met = found.layer > 0.0, k.name("met", found.layer >= 0.0)
    bottom = k.name("bottom", k.max(found.layer, 0.0) * u["layer_height"])
    scales = [k.select(is_behind, u[f"back_{name}"], u[name]) for name in ("radiance_scale", "distance_scale")]

    def place():
        def g(t):
            q = way.towards(t)
            stored = cubemap.stored_distance(k, asset, q, bottom)
            return distance_search.nearness(k, way, q, stored, scales[1]) - (1.0 - t)

        k.cite("GPU Gems 3, 17.2.2: secant search")
        t = distance_search.refine(k, g, asset.options["iterations"], found.low, found.high)
        return way.towards(t), way.footprint(k, t, ray), way.along(k, t)

    def backdrop():
        return k.select(found.sky >= 0.0, way.towards(found.sky), ray.direction), ray.spread, spaces.FAR

    seen, footprint, far = k.branch(met, place, backdrop)
    return Met(seen, footprint, bottom, scales, met, far)


def trace(k, asset, ray) -> Hit:
    """What the ray meets, as the map shows it."""
    if not asset.options["layers"]:  # a bare sky
        return environment.answer(k, asset, ray.direction, ray.spread, spaces.STATUS_FELL_BACK)
    met = meet(k, asset, ray)
    radiance, distance = cubemap.look_up(k, asset, met.seen, met.footprint, met.bottom, met.scales)
    position = asset.uniforms["center"] + k.normalize(met.seen) * distance
    return Hit(radiance, position, 1.0, k.select(met.solid, spaces.STATUS_HIT, spaces.STATUS_FELL_BACK))
