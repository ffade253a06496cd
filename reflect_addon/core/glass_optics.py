"""Light through glass, as kernels: what a pane lets through and mirrors, and a ray's way through a solid convex body.

A pane has two faces of Fresnel's reflectance R, between which light goes on being mirrored [Hecht, Optics, 9.6, summed without phases]; with a
crossing's tint c, and c^2 for a pane, T = c^2 (1 - R)^2 / (1 - R^2) and its reflectance R + T R.
A body bends a ray as it enters (Snell); inside a convex one the ray meets the surface once. Where, is found by planes: convex_map.py holds
for each direction from its middle the plane of the face there. A plane meets the ray at the surface or beyond it, and one taken where the ray is
outside meets it nearer than that: so steps only come nearer, and end on the face itself (Newton's method, on a convex function). There it
leaves, bent again, or is mirrored whole and goes on, up to MOST_INSIDE times. What Fresnel mirrors where it could leave is left out, and
so is what is still inside then: `left` says how much.
Limits. One way out a ray. The colour of a body is its surface's, as Principled's is: none by the length of the way.
"""

from .cubemap import face_of
from .shading import fresnel_dielectric

# Whole reflections inside: a cube has up to three, one a pair of faces.
MOST_INSIDE = 4
# Planes asked on the way to the surface; a ball of 20 000 triangles is met with six.
PLANES = 12
# Cosine between neighbours' shading normals, below which a crease is between them and the nearest counts.
CREASE = 0.998

PANE_INPUTS = {"mirrored": "vec3", "tint": "vec3"}
BODY_INPUTS = {"origin": "vec3", "view": "vec3", "normal": "vec3", "ior": "float", "tint": "vec3", "center": "vec3", "shape": "vec2"}
IMAGES = ("glass_plane_buf", "glass_normal_buf")


def pane(k, scope, mirrored, tint):
    """{'through': vec3, 'mirrored': vec3} of a pane whose one face mirrors so much, and of which a crossing lets through `tint`."""
    k.cite("both faces, and all that goes to and fro between them")
    crossed = tint * tint * (1.0 - mirrored) / (1.0 + mirrored)
    return {"through": crossed, "mirrored": mirrored + crossed * mirrored}


def bent(k, direction, normal, ratio):
    """(direction, whether there is one: bool) by Snell; ratio: index before over index behind; the normal is against the direction."""
    cosine = -k.dot(direction, normal)
    rest = 1.0 - ratio * ratio * (1.0 - cosine * cosine)
    return k.normalize(direction * ratio + normal * (ratio * cosine - k.sqrt(rest))), rest > 0.0


def body(k, scope, origin, view, normal, ior, tint, center, shape):
    """{'origin': vec3, 'direction': vec3 of the ray that leaves, 'through': vec3 share of its radiance, 'found': float 1 where it does, 'left':
    float share that went another way}.

    origin: on the surface, world; view: the ray that meets it; normal: shading, towards where it came from; center: of the map, world; shape:
    m of map space's unit, texels along a face's edge. found is 0 for an eye within the glass."""
    size, side = shape.x, shape.y

    def texel(point):
        face, s, t = face_of(k, point)
        return face * (side + 2.0) + 1.0 + (s + 1.0) * 0.5 * side, 1.0 + (t + 1.0) * 0.5 * side

    def plane_at(point):
        return k.fetch(scope.images[IMAGES[0]], *texel(point))

    def normal_at(point):
        x, y = texel(point)
        nearest = k.fetch(scope.images[IMAGES[1]], x, y).xyz
        smooth = k.sample(scope.images[IMAGES[1]], x, y).xyz
        return k.normalize(k.select(k.dot(smooth, smooth) > CREASE * CREASE, smooth, nearest))

    start = k.name("start", (origin - center) / size)
    cosine = k.clamp(-k.dot(view, normal), 0.0, 1.0)
    entered = 1.0 - fresnel_dielectric(k, cosine, ior)
    inner, _ = bent(k, view, normal, 1.0 / ior)

    def cross(i, point, direction, kept, done):
        b = k.dot(point, direction)
        k.cite("from the ball around the body, of radius 1, nearer plane by plane")
        far = k.sqrt(b * b + 1.0 - k.dot(point, point)) - b

        def nearer(j, way):
            plane = plane_at(point + direction * way)
            down = k.dot(plane.xyz, direction)
            met = (plane.w - k.dot(plane.xyz, point)) / k.max(down, 1e-6)
            return (k.select(down > 1e-6, k.clamp(met, 0.0, way), way),), None

        (way,) = k.loop(PLANES, (far,), nearer)
        at = k.name("at", point + direction * way)
        face = plane_at(at).xyz
        inside = k.name("inside", k.dot(direction, face))
        outward = normal_at(at)
        k.cite("no shading normal turns a ray back that meets the face from within")
        outward = k.name("outward", k.select(k.dot(outward, direction) > 1e-3, outward, face))
        onward, leaves = bent(k, direction, -outward, ior)
        leaves = leaves & (k.dot(onward, face) > 0.0) & (inside > 0.0)
        share = 1.0 - fresnel_dielectric(k, k.clamp(k.dot(direction, outward), 0.0, 1.0), 1.0 / ior)
        back = direction - outward * (2.0 * k.dot(direction, outward))
        back = k.normalize(k.select(k.dot(back, face) < 0.0, back, direction - face * (2.0 * inside)))
        return (
            at, k.select(leaves, onward, back), k.select(leaves, kept * share, kept), k.select(leaves, 1.0, 0.0),
        ), leaves  # fmt: skip

    end, direction, kept, done = k.loop(MOST_INSIDE + 1.0, (start, inner, entered, 0.0), cross)
    k.cite("an eye within the body sees its normal from behind; another dupli's ray starts elsewhere")
    outside = (k.dot(normal, start) > 0.0) & (k.dot(start, start) < 1.01)
    found = k.select((done > 0.5) & outside, 1.0, 0.0)
    return {
        "origin": center + end * size,
        "direction": direction,
        "through": tint * tint * (kept * found),
        "found": k.select(outside, 1.0, 0.0),
        "left": entered - kept * found,
    }
