"""Where a ray from a curved mirror meets what the mirror's one view shows [nielsen-2002 2.3, 3.2, Fig 5], as a kernel.

Problem. A curved mirror's view-dependent map is one picture, drawn from the middle of the reflector towards whoever looks (curved_views.py). The paper
looks it up by the ray's direction, as if everything were far away: what is near then lies beside its place, and does not move as it should.
Idea. The picture knows the place of what each pixel shows, so each ray is followed across it as those of rough planar mirrors are (mirror_march.py). But
a ray of a curved mirror starts anywhere on it, often beside the picture or behind its eye, and enters the picture later: it is followed from there.
Limits. "The back and parts of the sides of the environment are disregarded" (2.3): rays that go there never enter the picture, or leave it before they
meet anything, and are `found` 0: of a ball's pixels a third is found. What a ray meets before it enters the picture is not seen. What a planar mirror in
the picture shows is as the reflector's middle sees it there.
"""

from . import mirror_march, spaces

INPUTS = {**mirror_march.INPUTS, "nearest": "float"}
IMAGES = mirror_march.IMAGES


def march(k, scope, start, direction, eye, forward, row_x, row_y, row_w, window, footprint, reach, nearest):
    """{'radiance': vec3, 'distance': float m along the ray, 'found': float}: as mirror_march.march, from wherever the ray enters the window.

    nearest: m before the eye, where the picture begins; start, direction, and all else: see there."""
    x, y, w = (k.dot(row.xyz, start) + row.w for row in (row_x, row_y, row_w))
    dx, dy, dw = (k.dot(row.xyz, direction) for row in (row_x, row_y, row_w))
    k.cite("the part of the ray that is seen: beyond the near plane and within the window's four sides")
    enters, leaves = 0.0, reach
    for value, slope in (
        (x - window.x * w, dx - window.x * dw), (window.z * w - x, window.z * dw - dx),
        (y - window.y * w, dy - window.y * dw), (window.w * w - y, window.w * dw - dy), (w - nearest, dw),
    ):  # fmt: skip
        crosses = k.name("crosses", k.abs(value) / k.max(k.abs(slope), 1e-20))
        enters = k.select(value < 0.0, k.select(slope > 0.0, k.max(enters, crosses), reach), enters)
        leaves = k.select(slope < 0.0, k.min(leaves, k.select(value > 0.0, crosses, 0.0)), leaves)
    enters = k.name("enters", enters)

    def follow():
        found = mirror_march.march(k, scope, start + direction * enters, direction, eye, forward, row_x, row_y, row_w, window, footprint, reach)
        place = k.fetch(scope.images["place_tx"], found["pixel"])
        # Pixels of the view are wider than those of the mirror, so radiance is between four. Along a line that looks away from the eye steps of
        # the march are long: the place is nearer to the truth.
        return k.sample(scope.images["picture_tx"], found["pixel"]).rgb, k.max(k.dot(place.xyz - eye - start, direction), 0.0), found["found"]

    radiance, distance, found = k.branch(enters < leaves, follow, lambda: (k.vec3(0.0, 0.0, 0.0), spaces.FAR, 0.0))
    return {"radiance": radiance, "distance": distance, "found": found}
