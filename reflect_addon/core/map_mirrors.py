"""Mirrors that the rays of a live map meet, planar ones and the ball itself: they are met where they are, and the ray goes on from there, as a kernel.

Problem. A map shows what a mirror shows to the reflector's middle. From elsewhere on the reflector, most of all at its rim, another part of the mirrored
world is seen, round other corners, and the mirror's edge cuts it off elsewhere: a march through images (live_maps.py) knows none of that.
Idea. Where the mirror is, is known exactly: a plane and an outline. A ray that reaches one before it meets what the map shows is mirrored there, times the
mirror's reflectance, and followed through the same map from there; so is that ray, BOUNCES times. What the map shows of images is always
behind the mirror that shows them, so it is never in the way.
A mirrored ray that comes back to the reflector would meet what is not in the map. Where that is a ball it is one more mirror whose place is known; else the
ray is left to the image, which shows the reflector as the map's middle sees it.
Limits. Only what can be told from the outline or radius and constants: mirrors of one metal, as their light is all reflected, that fill their outline, have few corners and
are smooth. A metal's own emission is lost. The nearest MOST are taken. Where a ray is let go, the image takes over with a step in what is shown.
"""

from dataclasses import dataclass

import numpy as np

from . import mirrors
from .curved_views import CurvedMirror
from .mirror_planes import MirrorPlane
from .shading import fresnel_metal, roughness_spread
from .snapshot import Material
from .spaces import FAR

# Mirrors that a ray may meet one after another. A third changed no figure of three mirrors in a corner.
BOUNCES = 2
# Each costs a few operations a ray.
MOST, MOST_CORNERS = 8, 8
# Share of the outline that faces cover: a frame around a hole has less.
FILLED = 0.99
# A ray that starts nearer to a ball than this share of its radius squared leaves it: facets lie within, tangents beyond.
ON_BALL = 0.02
METAL = 0.999


@dataclass(frozen=True)
class Met:
    """The nearest mirror on a ray's way."""

    distance: object  # float, m; FAR: none
    normal: object  # vec3
    reflectance: object  # vec3
    roughness: object  # float: growth of a footprint per metre that it adds


def met_exactly(curved: CurvedMirror, planes: tuple[MirrorPlane, ...]) -> tuple[MirrorPlane, ...]:
    """Of all planes those that a kernel mirrors in, nearest first."""
    found = []
    for plane in planes:
        height = float((curved.center - plane.origin) @ plane.normal)
        if plane.reflector != curved.reflector and height > -curved.radius and _is_exact(plane):
            found.append((float(np.linalg.norm(plane.outline - curved.center, axis=1).min()), plane))
    return tuple(plane for _, plane in sorted(found, key=lambda pair: pair[0])[:MOST])


def meets_ball(curved: CurvedMirror) -> bool:
    """Whether its rays may meet the reflector again as a ball."""
    return _is_metal(curved.ball)


def _is_exact(plane: MirrorPlane) -> bool:
    return _is_metal(plane.material) and plane.filled >= FILLED and len(plane.outline) <= MOST_CORNERS


def _is_metal(material: Material | None) -> bool:
    """A smooth one, of which all light is mirrored."""
    return material is not None and min(material.metallic, material.specular_weight) >= METAL and material.roughness <= mirrors.ROUGHEST


def uniforms_of(curved: CurvedMirror, planes: tuple[MirrorPlane, ...]) -> dict[str, tuple[float, ...] | float]:
    """What `nearest` reads, relative to the ball's middle."""
    values: dict[str, tuple[float, ...] | float] = {"ball": curved.radius}
    if meets_ball(curved):
        values |= _of_metal("ball", curved.ball)
    for number, plane in enumerate(planes):
        outline = plane.outline - curved.center
        values[f"mirror{number}"] = (*map(float, plane.normal), float(plane.normal @ (plane.origin - curved.center)))
        values |= _of_metal(f"mirror{number}", plane.material)
        for edge, (start, end) in enumerate(zip(outline, np.roll(outline, -1, 0), strict=True)):
            inward = np.cross(plane.normal, end - start)
            inward = inward / max(np.linalg.norm(inward), 1e-300)
            values[f"mirror{number}_side{edge}"] = (*map(float, inward), float(-inward @ start))
    return values


def _of_metal(name: str, material: Material) -> dict[str, tuple[float, ...] | float]:
    return {
        f"{name}_color": tuple(map(float, material.base_color)),
        f"{name}_edge_tint": tuple(map(float, material.specular_tint)),
        f"{name}_spread": roughness_spread(material),
    }


def nearest(k, asset, offset, direction) -> Met:
    """The mirror that a ray meets first on the side that mirrors. offset: vec3 of its start from the ball's middle."""
    u, far = asset.uniforms, FAR
    normal, color, tint, spread = k.vec3(0.0, 0.0, 1.0), k.vec3(0.0, 0.0, 0.0), k.vec3(1.0, 1.0, 1.0), 0.0
    for number, corners in enumerate(asset.options["mirrors"]):
        plane = u[f"mirror{number}"]
        falls = k.name("falls", -k.dot(direction, plane.xyz))
        height = k.name("height", k.dot(offset, plane.xyz) - plane.w)
        t = k.name("to_mirror", height / k.max(falls, 1e-9))
        at = k.name("in_plane", offset + direction * t)
        within = (falls > 0.0) & (height > 0.0) & (t < far)
        for edge in range(corners):
            side = u[f"mirror{number}_side{edge}"]
            within = within & (k.dot(at, side.xyz) + side.w >= 0.0)
        within = k.name("within", within)
        far, normal = k.select(within, t, far), k.select(within, plane.xyz, normal)
        color, tint = k.select(within, u[f"mirror{number}_color"], color), k.select(within, u[f"mirror{number}_edge_tint"], tint)
        spread = k.select(within, u[f"mirror{number}_spread"], spread)
    if asset.options["ball"]:
        toward, outside = k.name("toward", k.dot(offset, direction)), k.name("outside", _outside(k, asset, offset))
        inside = k.name("under_root", toward * toward - outside)
        t = k.name("to_ball", -toward - k.sqrt(k.max(inside, 0.0)))
        within = (toward < 0.0) & (inside > 0.0) & (outside > ON_BALL * u["ball"] * u["ball"]) & (t < far)
        within = k.name("on_ball", within)
        far, normal = k.select(within, t, far), k.select(within, (offset + direction * t) * (1.0 / u["ball"]), normal)
        color, tint = k.select(within, u["ball_color"], color), k.select(within, u["ball_edge_tint"], tint)
        spread = k.select(within, u["ball_spread"], spread)
    k.cite("core/shading.py: a metal's reflectance")
    return Met(k.name("mirror_far", far), normal, fresnel_metal(k, k.clamp(-k.dot(direction, normal), 0.0, 1.0), color, tint), spread)


def comes_back(k, asset, offset, direction):
    """bool: whether a ray from there meets the ball around the reflector, or starts in it."""
    toward, outside = k.dot(offset, direction), _outside(k, asset, offset)
    return (outside <= 0.0) | (toward < 0.0) & (toward * toward > outside)


def _outside(k, asset, offset):
    """float: squared distance from the ball's middle, less that of its surface."""
    radius = asset.uniforms["ball"]
    return k.dot(offset, offset) - radius * radius
