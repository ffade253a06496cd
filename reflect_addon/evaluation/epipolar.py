"""A linear march along a ray's projection on a depth map: what simplified rows are measured against [popescu-2006 4.1].

"One approach for finding the intersection is to walk along r_p until an intersection is found ... similar to inverse
warping [McM97]." One step a texel, the same asset, clip and projection, the same rule for what is a surface; the crossing
is interpolated between the two texels around it. No method: only the bench compares with it.
"""

from ..core.billboard_kernel import fetch
from ..core.depth_refine import texel_at
from ..core.kernel import Hit
from ..core.methods import depth_maps


def trace(k, asset, ray) -> Hit:
    """depth_maps with the march in place of its search along a row; assets with depth maps only."""
    return depth_maps.trace(k, asset, ray, search=march)


def march(k, asset, i, place, steep, first, last):
    """depth_kernel's search: (bool, s)."""
    corner, step = fetch(k, asset, "table", i).zw, last - first
    count = k.name("texels", k.ceil(k.max(k.max(k.abs(step.x), k.abs(step.y)), 1.0)))

    def depth_below(s):
        """(how far the ray is above the map, the map's q; below -0.5 where there is nothing)."""
        at = first + step * s
        stored = texel_at(k, asset, corner, at.xy + 0.5 * place.z)
        return at.z - stored, stored

    def look(j, found, hit, above, stored):
        s = k.name("s", j / count)
        now, q = depth_below(s)
        surface = (stored >= 0.0) & (q >= 0.0) & (k.abs(q - stored) <= steep * k.length(step.xy) / count)
        met = surface & (above >= 0.0) & (now <= 0.0)
        share = k.clamp(above / k.max(above - now, 1e-20), 0.0, 1.0)
        return (met, k.select(met, s + (share - 1.0) / count, hit), now, q), met

    found, s, _, _ = k.loop(count + 1.0, (False, 0.0, 0.0, -1.0), look)
    return found, s
