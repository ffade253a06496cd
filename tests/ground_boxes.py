"""Assets with a ground's box over an endless plane, in closed form: what tests of the kernel and its emitters run on."""

import numpy as np
from analytic import SKY, directions, hits, smooth, unit

from reflect_addon.core import cubemap
from reflect_addon.core.asset import Asset
from reflect_addon.core.ground_box import Ground
from reflect_addon.core.rays import Rays

N = 64
# A level box about E, 0.4 above the ground, that is neither square nor centred.
LEVEL = Ground(np.zeros(3), np.eye(3), np.array([-3.0, -2.0, -0.4]), np.array([2.0, 4.0]), 0.7, ("Ground",))


def tilted(scale=1.0, members=("Ground",), center=(0.0, 0.0, 0.0)) -> Ground:
    normal = unit([0.15, -0.1, 1.0])
    x = unit(np.array([1.0, 0.2, 0.0]) - normal * np.dot([1.0, 0.2, 0.0], normal))
    axes = np.array([x, np.cross(normal, x), normal])
    return Ground(np.asarray(center), axes, LEVEL.low * scale, LEVEL.high * scale, LEVEL.height * scale, members)


def scaled(scale: float) -> Ground:
    return Ground(np.zeros(3), np.eye(3), LEVEL.low * scale, LEVEL.high * scale, LEVEL.height * scale, ("Ground",))


def asset_of(ground: Ground) -> Asset:
    """An endless plane below a sky; radiance is `smooth` of the direction from the centre."""
    rays = cubemap.bundle(np.zeros(3), N)
    d = rays.direction.astype(np.float64) @ ground.axes.T
    with np.errstate(divide="ignore"):
        t = np.where((d[:, 2] < 0) & bool(ground.members), ground.low[2] / d[:, 2], SKY)
    image, uniforms = cubemap.assemble(np.zeros(3), N, hits(rays, np.minimum(t, SKY), smooth))
    uniforms |= {"center": tuple(map(float, ground.center)), "billboard_scale": 1.0, **ground.uniforms()}
    return Asset("billboards", "", {"radiance_tx": image}, uniforms, {"count": 0, "mirrors": 0, "glossy": 0, "lamps": 0, "contours": False, **ground.options()})


def rays_in(rng, ground: Ground, count: int, spare=0.01) -> Rays:
    """From inside the box, up to twice H."""
    low, high = ground.low, np.array([*ground.high, ground.low[2] + 2 * ground.height])
    local = low + (high - low) * rng.uniform(spare, 1 - spare, (count, 3))
    return Rays(ground.world(local).astype("f"), directions(rng, count).astype("f"))


def rays_everywhere(rng, ground: Ground, count: int) -> Rays:
    """Most of them inside; the rest from outside, from under the ground and up from it; a few null rays."""
    inside = rays_in(rng, ground, count)
    origin, direction = ground.local(inside.origin), inside.direction
    origin[: count // 4] *= 3
    origin[: count // 8, 2] = ground.low[2]
    up = direction[: count // 8] @ ground.axes[2]
    direction[: count // 8] -= np.minimum(2 * up, 0)[:, None] * ground.axes[2].astype("f")
    direction[-10:] = 0
    return Rays(ground.world(origin).astype("f"), direction)
