"""The ground's box: a ground near the reflector that goes over into the environment map [popescu-2006 3.2, Figs. 6 to 9].

Problem. A ground that goes on into the distance cannot be a quad: either it ends where the quad ends, and the reflection
jumps from the quad to the map, or its texels are as large as the reflector.
Idea. The ground near the reflector is a plane inside walls of height H. A ray that meets the ground is looked up in the
environment map along the line from the map's centre E to the point that it meets; a ray that meets a wall at height h is
looked up along a linear blend of that line (h = 0: continuous with the ground) and of its own direction (h = H: plain
environment mapping). Ground and walls are one box, left once. The map is captured with the ground, which needs no texels
of its own.
Where we depart. The two vectors that are blended are a, from E to the wall, and t d, the way that the ray has come: the
blend is a - w p, the wall's point less the share w = h / H of the ray's start p (relative to E). With H the height of
the start above the ground this is exactly where the ray meets a ground that goes on as a plane, so the walls' place shows
nowhere. (A start on the wall has t = 0, and no blend: t is at least NEAR_WALL of the box.) The walls go on above H, where
w stays 1: no test for the box's top.
Limits. One plane. Rays that start outside the box or below the ground are answered from the nearest point in it.
Things in the map that stand inside the box would be painted onto the ground: ground_fit ends the box before them.
"""

from dataclasses import dataclass

import numpy as np

from . import cubemap, spaces
from .slab import exit_distance

# Share of the nearest wall's distance from E: rays that start nearer to the wall they meet are blended as from there.
NEAR_WALL = 0.25

# Share of H within which the point that is shown goes over from the plane to what the map saw, so that it never jumps.
RIM = 1 / 16

# A plane that goes on recedes to infinity towards H; nearer to it than this share 1 - w is a difference of roundings.
LEAST_REST = 1 / 256


@dataclass(frozen=True)
class Ground:
    """A box that stands on the ground around a reflector. All lengths along its axes from `center`, m."""

    center: np.ndarray  # (3,) float64, world, m: E, what the environment map is captured from
    axes: np.ndarray  # (3, 3) float64 rows: two along the ground and its normal, orthonormal, right-handed
    low: np.ndarray  # (3,) float64: two walls and the ground, all below 0
    high: np.ndarray  # (2,) float64: the other two walls, above 0
    height: float  # m: H, of the morph
    members: tuple[str, ...]  # instances that are the ground; (): only the world's picture shows it

    def uniforms(self) -> dict[str, float | tuple[float, ...]]:
        out = {f"ground_{name}": tuple(map(float, axis)) for name, axis in zip("xyz", self.axes, strict=True)}
        out["ground_low"] = tuple(map(float, self.low))
        out["ground_high"] = (*map(float, self.high), 2.0 * spaces.FAR)
        near = NEAR_WALL * min(-self.low[0], -self.low[1], *self.high)
        return out | {"ground_morph": float(self.height), "ground_near": float(near)}

    def options(self) -> dict[str, bool]:
        """turned: not along the world's axes; seen: the map holds the ground's distances."""
        return {"ground": True, "ground_turned": not np.array_equal(self.axes, np.eye(3)), "ground_seen": bool(self.members)}

    def local(self, points: np.ndarray) -> np.ndarray:
        """(..., 3) world points in the box's axes, from its centre."""
        return (np.asarray(points, np.float64) - self.center) @ self.axes.T

    def world(self, points: np.ndarray) -> np.ndarray:
        return np.asarray(points, np.float64) @ self.axes + self.center


def answer(k, asset, ray, start):
    """Kernel: (radiance, position, status) of a ray that meets nothing before the ground's box.

    start: vec3, the ray's origin relative to the asset's centre."""
    return shown(k, asset, ray, *meeting(k, asset, ray, start))


def meeting(k, asset, ray, start):
    """Kernel: (met, along, travelled, share), as `shown` takes them, of a ray from `start` (vec3, from the centre)."""
    u = asset.uniforms
    low, high = u["ground_low"], u["ground_high"]

    k.cite("popescu-2006 3.2: the billboard and the transition walls form a box")
    inside = k.name("box_start", k.min(k.max(to_box(k, asset, start), low), high))
    along = k.name("box_along", to_box(k, asset, ray.direction))
    to_ground = k.name("to_ground", exit_distance(k, inside, along, low, high, "z"))
    to_wall = k.name("to_wall", k.min(*(exit_distance(k, inside, along, low, high, axis) for axis in "xy")))
    travelled = k.name("travelled", k.min(to_wall, to_ground))
    # The box is open above, at 2 FAR: what leaves it there is the sky like all above H.
    met = k.name("box_met", inside + along * travelled)
    share = k.clamp((met.z - low.z) / u["ground_morph"], 0.0, 1.0)
    on_ground = to_ground <= to_wall
    share = k.name("morph", k.select(on_ground & (along.z < 0.0), 0.0, share))
    return met, along, travelled, share


def to_box(k, asset, v):
    """Kernel: a vec3 of the world in the box's axes."""
    u = asset.uniforms
    if not asset.options["ground_turned"]:
        return v
    return k.vec3(k.dot(u["ground_x"], v), k.dot(u["ground_y"], v), k.dot(u["ground_z"], v))


def shown(k, asset, ray, met, along, travelled, share):
    """Kernel: (radiance, position, status) at the point `met` of the box, at the share h / H of a wall (0: the ground).

    met, along: vec3, where the ray leaves the box, from its centre, and its direction, in the box's axes; travelled:
    float, m."""
    u = asset.uniforms
    k.cite("popescu-2006 3.2: r_m, a linear blend of r_1^d (above H) and r_a (on the ground)")
    way = k.name("way", k.max(travelled, u["ground_near"] * share))
    seen = k.name("seen", met * (1.0 - share) + along * (share * way))
    above = k.name("above", share >= 1.0)
    direction = seen
    if asset.options["ground_turned"]:
        direction = u["ground_x"] * seen.x + u["ground_y"] * seen.y + u["ground_z"] * seen.z
    # 1e-20: a null ray travels 2 FAR, and the quotient below must stay finite, as shader nodes select by mixing.
    far = k.name("from_center", k.max(k.length(seen), 1e-20))
    footprint = (ray.width * (1.0 - share) + ray.spread * way) / far
    direction = k.name("direction", k.select(above, ray.direction, direction))
    radiance, distance = cubemap.look_up(k, asset, direction, k.select(above, ray.spread, footprint))
    # Where a plane that goes on would be met: exact on the ground, where a texel's distance is that of the texel's middle.
    bent = k.min(far / k.max(1.0 - share, LEAST_REST), spaces.FAR)
    if asset.options["ground_seen"]:
        going_over = k.mix(bent, distance, k.min(share * (1.0 / RIM), 1.0))
    else:  # the picture of the world has no distances
        going_over = k.select(distance >= spaces.FAR, bent, distance)
    distance = k.select(above, distance, going_over)
    position = u["center"] + k.normalize(direction) * distance
    return radiance, position, k.select(above, spaces.STATUS_FELL_BACK, spaces.STATUS_HIT)
