"""The surface of a mirror that stands as a quad or a depth map with normals: where a ray meets it, and how it is turned there [popescu-2006 3.1, step 5a].

Problem. A reflective quad stands through the middle of a volume, and a ray that goes on from there shows the wrong place of all that is near.
Idea. Beside its normal a texel holds the height of the surface above the quad, and a ray that meets the quad goes to the surface in
RELIEF_STEPS steps of a fixed-point iteration [Szirmay-Kalos 2005, for distance maps].
"""

from dataclasses import dataclass

from . import billboard_kernel, moved_rows
from .billboard_kernel import fetch
from .cubemap import blend_levels

# Steps from the quad's plane towards the surface that stands there.
RELIEF_STEPS = 2
# Cosine at which a ray meets a quad below which its way to the surface is no longer told by the height there.
LEAST_FACING = 0.1


@dataclass(frozen=True)
class Surface:
    """What a ray meets of a mirror that stands as a quad with normals and heights."""

    distance: object  # m along the ray to the surface, before or behind the quad's plane
    u: object
    v: object
    normal: object  # unit, world
    turn: object  # rad: change of the normal across the ray's footprint
    share: object  # of the surface that mirrors


def surface_at(k, asset, ray, met) -> Surface:
    """met: (distance m, row, u, v) of a reflective row. asset.options: relief (whether its surface lies at the heights of normal_tx above it), partly."""
    distance, row, u, v = met
    detail, place, placed = (fetch(k, asset, name, row) for name in ("detail", "place", "normals"))
    image, block = asset.images["normal_tx"], k.vec4(placed.xy, place.zw)
    level = billboard_kernel.level_of(k, ray, distance, detail)

    def look(at_u, at_v):
        texel = billboard_kernel.texel(k, asset, ray, distance, row, at_u, at_v)
        relief = blend_levels(k, level, detail.x, lambda i: billboard_kernel.sample(k, image, block, i, at_u, at_v))
        return relief.xyz, relief.w, texel.w

    normal, height, alpha = look(u, v)
    nearer = distance
    if asset.options["relief"]:
        plane, axis_u, axis_v, eye = (fetch(k, asset, name, row) for name in ("plane", "u", "v", "eye"))
        facing = k.max(-k.dot(ray.direction, plane.xyz), LEAST_FACING)
        half_width = k.name("half_width", 0.5 * place.z / detail.y)
        eye_u, eye_v = k.dot(eye.xyz, axis_u.xyz) + axis_u.w, k.dot(eye.xyz, axis_v.xyz) + axis_v.w

        def metres(height, alpha):
            return height * (half_width / k.max(alpha, billboard_kernel.LEAST_ALPHA))

        plane_u, plane_v = u, v
        for _ in range(RELIEF_STEPS):
            k.cite("the ray's point as high above the plane as the surface at its last place, as the capture's camera saw it")
            high = metres(height, alpha)
            back = ray.direction * k.max(-high / facing, -distance)
            grown = 1.0 / k.max(1.0 - high * eye.w, 0.5)
            next_u = eye_u + (plane_u + k.dot(back, axis_u.xyz) - eye_u) * grown
            next_v = eye_v + (plane_v + k.dot(back, axis_v.xyz) - eye_v) * grown
            next_u, next_v = k.clamp(next_u, -1.0, 1.0), k.clamp(next_v, -1.0, 1.0)
            found = look(next_u, next_v)
            # Past the contour there is no surface to be met.
            solid = found[2] >= billboard_kernel.SOLID
            before = (normal, height, alpha, u, v)
            normal, height, alpha, u, v = (
                k.select(solid, new, old) for new, old in zip((*found, next_u, next_v), before, strict=True)
            )
        nearer = k.max(distance - metres(height, alpha) / facing, 0.0)
    normal = moved_rows.turned(k, asset, row, normal)
    turn = _turn(k, image, block, level, u, v) * (ray.width + ray.spread * distance) * detail.y
    share = 1.0
    if asset.options["partly"]:
        # Means of normals are shorter than one, so half of it must do: the contour of the part that mirrors.
        share = k.clamp(2.0 * k.length(normal) / k.max(alpha, billboard_kernel.LEAST_ALPHA), 0.0, 1.0)
    return Surface(
        k.name("surface_distance", nearer), u, v, k.name("mirror_normal", k.normalize(normal)),
        k.name("turn", turn), share,
    )  # fmt: skip


def _turn(k, image, block, level, u, v):
    """Change of the normal in radians over one texel of the finest level, root mean square of two directions."""
    # Of the nearest level, towards the middle, where the quad goes on. Not the level's floor: logarithms round differently on
    # graphics cards, and footprints of whole texels are the usual ones.
    whole = k.floor(level + 0.5)
    finest = k.exp2(-whole)
    step = k.vec2(2.0, 2.0) / (block.zw * finest)
    here = billboard_kernel.sample(k, image, block, whole, u, v).xyz

    def turned(at_u, at_v):
        other = billboard_kernel.sample(k, image, block, whole, at_u, at_v).xyz
        change = k.normalize(other) - k.normalize(here)
        return k.select(k.dot(other, other) > billboard_kernel.LEAST_ALPHA, k.dot(change, change), 0.0)

    across, along = u + k.select(u > 0.0, -step.x, step.x), v + k.select(v > 0.0, -step.y, step.y)
    return k.sqrt(0.5 * (turned(across, v) + turned(u, along))) * finest
