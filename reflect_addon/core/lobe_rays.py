"""Rough reflectors: the lobe of a surface as a few mirror rays, each with its share of the footprint.

Problem. A footprint that follows a map's levels softens what lies inside a stand-in, but not its outline: on a rough floor
the reflection of a table leg is sharp where it touches and soft further up, and no level of a texture does that to an edge.
Idea. Where stand-ins have outlines, a rough surface sends several rays instead of one, spread over its lobe: the half
vectors that the viewer sees of a GGX surface [Dupuy and Benyoub 2023, "Sampling visible GGX normals with spherical caps"],
on a spiral that a pixel turns by its own angle. Each stands for an equal part of the lobe and carries that part's footprint,
so the levels soften what is left between them. How many follows from how wide the lobe is; a mirror sends one.
Limits. Rays below the surface are dropped, and what several bounces would bring back is left out, as in shading.py.
"""

import numpy as np

from .asset import Asset
from .lobe import GRAZING, smith

# Most rays of one pixel: in a picture, and while somebody moves about.
MOST, LIVE = 64, 16
# Growth of the footprint, per metre, that one ray may have: an edge that is sharper than a degree looks like one of a mirror.
FINE = 0.02
# Blender's roughness squared, GGX's alpha, for each unit of the growth that shading.roughness_spread gives.
ALPHA = 0.25
_GOLDEN = np.pi * (3 - np.sqrt(5))

COUNT_INPUTS = {"spread": "float", "most": "float"}
DIRECTION_INPUTS = {"mirrored": "vec3", "normal": "vec3", "alpha": "float", "turn": "vec2", "share": "float"}


def has_outlines(asset: Asset) -> bool:
    """Whether the asset has stand-ins, whose edges no map's level softens, or views, which have no levels."""
    return bool(asset.options.get("count", 0) + asset.options.get("mirrors", 0) + asset.options.get("views", 0))


def turns() -> np.ndarray:
    """(MOST, 2) cosine and sine of the spiral's angles."""
    angle = _GOLDEN * np.arange(MOST)
    return np.stack([np.cos(angle), np.sin(angle)], -1)


def count(k, scope, spread, most):
    """{'rays': float}: how many rays a surface sends whose roughness widens a footprint by `spread` per metre."""
    wide = spread * (1.0 / FINE)
    return {"rays": k.clamp(k.ceil(wide * wide - 1e-3), 1.0, most)}


def direction(k, scope, mirrored, normal, alpha, turn, share):
    """{'direction': vec3, 'weight': float}: a ray of the lobe around the mirror ray, and what shadowing leaves of it; 0 below the surface.

    turn: cosine and sine of the sample's angle; share: in (0, 1), of the cap that lies above the sample."""
    # A frame around the normal without branches [Duff et al. 2017].
    side = k.select(normal.z < 0.0, -1.0, 1.0)
    a = -1.0 / (side + normal.z)
    b = normal.x * normal.y * a
    tangent = k.vec3(1.0 + side * normal.x * normal.x * a, side * b, -side * normal.x)
    bitangent = k.vec3(b, side + normal.y * normal.y * a, -normal.y)
    cosine = k.clamp(k.dot(mirrored, normal), 0.0, 1.0)
    viewer = 2.0 * cosine * normal - mirrored
    k.cite("stretch the view to where the surface is a hemisphere, pick from the cap that it sees, and back")
    seen = k.normalize(
        k.vec3(alpha * k.dot(viewer, tangent), alpha * k.dot(viewer, bitangent), k.max(cosine, 1e-4))
    )
    height = (1.0 - share) * (1.0 + seen.z) - seen.z
    around = k.sqrt(k.max(1.0 - height * height, 0.0))
    half = k.vec3(around * turn.x + seen.x, around * turn.y + seen.y, height + seen.z)
    half = k.normalize(k.vec3(alpha * half.x, alpha * half.y, k.max(half.z, 1e-6)))
    half = tangent * half.x + bitangent * half.y + normal * half.z
    found = k.normalize(2.0 * k.dot(viewer, half) * half - viewer)
    up = k.dot(found, normal)
    k.cite("Smith's G2 over the G1 of the view, which the sampling has in it")
    seen_by, left_by = 1.0 + smith(k, k.max(cosine, GRAZING), alpha), smith(k, k.max(up, GRAZING), alpha)
    return {"direction": found, "weight": k.select(up > 0.0, seen_by / (seen_by + left_by), 0.0)}
