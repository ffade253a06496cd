"""Where a ray from a planar mirror meets what the mirror's view shows: a march across the view's pixels, as a kernel.

Problem. A rough mirror sends a ray on in many directions (lobe_rays.py); its view was drawn for one of them, the mirror ray's [nielsen-2002 3.1].
But the view holds a place and a colour for every pixel, and most of what the other rays meet is in it.
Idea. All points of a ray lie on a line of the picture, which starts at the ray's own pixel. The ray is followed along it in steps of a pixel
or a few until it is behind the place that a pixel shows [McGuire and Mara 2014, "Efficient GPU Screen-Space Ray Tracing", JCGT 3(4)]; halving
finds the pixel. A ray that comes to be far behind has passed an edge: it flies on, and is in front again where what hides it ends.
So a leg is met where it is near and the wall behind it where it is far, each by the rays that meet it: no width of a filter is chosen.
A ray that meets nothing before the line's end, and sees the sky there, meets the sky.
Limits. What the virtual eye does not see is not met, nor what lies beyond the window that was drawn (glossy_window.py); such rays are
`found` 0, and distance maps answer them. How thick things are is not known: a ray that is behind by less than some pixels has met them.
"""

from . import spaces

# Steps along a line: some, one more for so many px, and no more than that. They grow along it from next to nothing, since a ray that starts beside
# what it meets has met it within its own pixel; a thing of two pixels may be missed at the end of a long line.
FEWEST, STRIDE, MOST_STEPS = 8.0, 1.5, 48.0
# Halvings of the step in which a ray comes to be behind.
HALVINGS = 6
# px times the footprint there: a ray that is then behind by less has met the surface. A surface at 76 degrees recedes by 4 a pixel.
THICK = 4.0
# Of the ray's depth at its start: a ray that comes towards the eye ends where this is left of it.
LEAST_DEPTH = 0.02

INPUTS = {
    "start": "vec3", "direction": "vec3", "eye": "vec3", "forward": "vec3", "row_x": "vec4", "row_y": "vec4", "row_w": "vec4",
    "window": "vec4", "footprint": "float", "reach": "float",
}  # fmt: skip
IMAGES = ("picture_tx", "place_tx")


def march(k, scope, start, direction, eye, forward, row_x, row_y, row_w, window, footprint, reach, texel=None):
    """{'radiance': vec3, 'distance': float m along the ray, 'found': float, 'pixel': vec2}: what the ray meets in the view, and where in its picture.

    start: of the ray, relative to the eye; row_x, row_y, row_w: of clip coordinates in px, relative to the eye, so that x / w is a pixel; window: px,
    low x, y and high x, y of what was drawn; footprint: of a pixel at depth 1 m, or m of an orthographic one's where w is 1; reach: m;
    texel(name, at): of the picture, name one of IMAGES; None: of the images of these names."""
    texel = texel or (lambda name, at: k.fetch(scope.images[name], at))

    def at_start(row):
        return k.dot(row.xyz, start) + row.w

    x0, y0, w0 = at_start(row_x), at_start(row_y), k.name("w0", at_start(row_w))
    dx, dy, dw = (k.dot(row.xyz, direction) for row in (row_x, row_y, row_w))
    k.cite("the ray ends where it leaves the window, or comes near the eye")
    end = reach
    for value, slope in (
        (x0 - window.x * w0, dx - window.x * dw), (window.z * w0 - x0, window.z * dw - dx),
        (y0 - window.y * w0, dy - window.y * dw), (window.w * w0 - y0, window.w * dw - dy),
        (w0 * (1.0 - LEAST_DEPTH), dw),
    ):  # fmt: skip
        end = k.select(slope < 0.0, k.min(end, k.max(value, 0.0) / k.max(-slope, 1e-20)), end)
    end = k.name("end", end)
    w1 = k.name("w1", w0 + end * dw)
    from_px = k.name("from_px", k.vec2(x0, y0) / w0)
    line = k.name("line", k.vec2(x0 + end * dx, y0 + end * dy) / w1 - from_px)
    depth0, rises = k.dot(start, forward), k.dot(direction, forward)
    last = k.vec2(window.z, window.w) - 0.5

    def time(u):
        """m along the ray at a share of the line: 1 / w is linear along it."""
        return end * u * w0 / (w1 + u * (w0 - w1))

    def behind_by(u, t):
        """m that the ray is behind the place shown where it is seen."""
        at = k.min(from_px + line * u, last)
        place = texel("place_tx", at)
        return depth0 + t * rises - k.dot(place.xyz - eye, forward)

    steps = k.name("steps", k.min(FEWEST + k.ceil(k.length(line) * (1.0 / STRIDE)), MOST_STEPS))

    def halve(i, low, high):
        middle = k.name("middle", 0.5 * (low + high))
        past = behind_by(middle, time(middle)) >= 0.0
        return (k.select(past, low, middle), k.select(past, middle, high)), None

    def step(i, before, was_hidden, met):
        share = (i + 1.0) / steps
        u = k.name("u", share * share)
        hidden = k.name("hidden", behind_by(u, time(u)) >= 0.0)

        def come_behind():
            low, high = k.loop(HALVINGS, (before, u), halve)
            t = k.name("t", time(high))
            thick = (t - time(low)) * k.abs(rises) + THICK * footprint * (w0 + t * dw)
            return (k.select(behind_by(high, t) <= thick, high, -1.0),)

        (met,) = k.branch(hidden & (was_hidden < 0.5), come_behind, lambda: (-1.0,))
        return (u, k.select(hidden, 1.0, 0.0), met), met >= 0.0

    k.cite("along the line, until the ray comes to be a little behind what is seen there")
    _, hidden, met = k.loop(steps, (0.0, 0.0, -1.0), step)
    at = k.select(met >= 0.0, met, 1.0)
    pixel = k.name("pixel", k.min(from_px + line * at, last))
    seen = texel("picture_tx", pixel)
    place = texel("place_tx", pixel)
    sky = (hidden < 0.5) & (k.dot(place.xyz - eye, place.xyz - eye) > (spaces.FAR / 2) * (spaces.FAR / 2)) & (end >= reach)
    return {
        "radiance": seen.rgb,
        "distance": k.select(met >= 0.0, time(at), spaces.FAR),
        "found": k.select((met >= 0.0) | sky, 1.0, 0.0),
        "pixel": pixel,
    }
