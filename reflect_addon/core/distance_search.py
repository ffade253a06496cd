"""Where a ray meets what cube maps of distances saw: one function of one parameter, its root, and the march to it.

Problem. A cube map with distances knows of each direction how far the surface is [Szirmay-Kalos 2005]. A ray
that starts elsewhere meets that surface where its own point is as far from the centre as the map says.
Idea. Seen from the centre the ray runs from the direction of its start to its own: from s to e, which are the two
divided by their largest components (points on the cube; GPU Gems 3, 17.2.2). With q(t) = s (1 - t) + e t the point of
the ray is q(t) a / (1 - t), a the start's largest component, and t = 1 is its point at infinity. It is as far as the
map's surface, |q| a / (1 - t) = w, where

    g(t) = |q(t)| a / w(q(t)) - (1 - t) = 0;    g < 0 in front of the surface ("undershooting"), g > 0 behind it.

Where we depart. The papers compare |l| / |l'| as a function of the distance along the ray. That ratio is linear for a
plane; so is g, through the same two points, and it needs no infinite distances: the sky (w infinite) and the point at
infinity are ordinary values, and the first guess of Szirmay-Kalos 2005, |r'| (1 - |p| / |p'|), is g's false position
between 0 and 1.
"""

from dataclasses import dataclass

from .kernel.values import Value
from .spaces import FAR

# A start nearer to the centre than this, in m, sees everything in its own direction: guards the division by `a`.
AT_CENTRE = 1e-20
# A guess is good when the ray's point and the surface are this near, relative to their distance from the centre (the
# papers: 1e-3 and 1e-4).
MET = 1e-3
# Between two steps of a march a surface may come nearer or go farther this many times as fast as the ray passes
# sideways; what is steeper is a silhouette, between whose sides the ray flies through. Measured: 5 to 50 are alike.
STEEPEST = 10.0
NOTHING = -3.0  # see march


@dataclass(frozen=True)
class Path:
    """A ray as seen from a cube map's centre."""

    start: Value  # vec3 s
    end: Value  # vec3 e
    reach: Value  # a, m
    stretch: Value  # largest component of the direction

    def towards(self, t):
        """vec3 q(t)."""
        return self.start + (self.end - self.start) * t

    def along(self, k, t):
        """m along the ray; at its point at infinity FAR."""
        return k.min(self.reach * t / (self.stretch * k.max(1.0 - t, 1e-7)), FAR)

    def footprint(self, k, t, ray):
        """The ray's footprint at t as an angle seen from the centre."""
        # Width over distance, both times (1 - t) / a.
        size = ray.width * (1.0 - t) / k.max(self.reach, AT_CENTRE) + ray.spread * t / self.stretch
        return size / k.max(k.length(self.towards(t)), 1e-6)  # past the centre the footprint is everything


@dataclass(frozen=True)
class Crossing:
    """Two neighbouring places of a march, with a surface between them unless `layer` is negative."""

    low: Value  # t
    high: Value
    layer: Value  # whose surface; -1 = none was met
    sky: Value  # t of the last place where layer 0 shows the sky; -1 = nowhere


def path(k, asset, ray) -> Path:
    """The ray's path from the centre of the asset's map. That of a null direction stays in the start's."""
    offset = k.name("offset", ray.origin - asset.uniforms["center"])
    reach = k.name("reach", k.max(k.abs(offset.x), k.abs(offset.y), k.abs(offset.z)))
    d = ray.direction
    stretch = k.name("stretch", k.max(k.abs(d.x), k.abs(d.y), k.abs(d.z), 0.5))  # of a unit vector at least 0.57
    end = k.name("path_end", d * (1.0 / stretch))
    start = k.name("path_start", k.select(reach > AT_CENTRE, offset * (1.0 / k.max(reach, AT_CENTRE)), end))
    return Path(start, end, reach, stretch)


def nearness(k, way: Path, q, stored, scale):
    """|q| a / w: 0 for the sky. stored: the map's distance over `scale`."""
    return k.select(stored > 0.0, k.length(q) * (way.reach / scale) / k.max(stored, 1e-30), 0.0)


def false_position(k, low, at_low, high, at_high):
    """The root of the line through two values of g at low and high, kept between them."""
    return low + (high - low) * k.clamp(at_low / k.away_from_zero(at_low - at_high), 0.0, 1.0)


def refine(k, g, count: int, low, high):
    """t between low and high where g is 0, by `count` false positions at most; g(t): a look-up, two more for the ends.

    An end that stays halves its value, so that the other does not creep towards the root [Dowell and Jarratt 1971].
    """
    first, second = k.name("at_low", g(low)), k.name("at_high", g(high))
    rises = k.name("rises", second > first)

    def step(i, low, at_low, high, at_high, guess, last):
        guess = k.name("guess", false_position(k, low, at_low, high, at_high))
        value = k.name("value", g(guess))
        # The root lies before the guess.
        past = k.name("past", (value >= 0.0) & rises | (value < 0.0) & ~rises)
        at_low = k.select(past, k.select(last > 0.0, at_low * 0.5, at_low), value)
        at_high = k.select(past, value, k.select(last < 0.0, at_high * 0.5, at_high))
        low, high = k.select(past, low, guess), k.select(past, guess, high)
        return (low, at_low, high, at_high, guess, k.select(past, 1.0, -1.0)), k.abs(value) <= MET * (1.0 - guess)

    return k.loop(count, (low, first, high, second, high, 0.0), step)[4]


def march(k, way: Path, nearness_of, layers: int, steps: int, texels) -> Crossing:
    """The first place where the ray passes the surface of one of the layers; `linear search` of GPU Gems 3, 17.2.2.

    nearness_of(layer, q): one look-up; texels: steps for one unit along the path; at most `steps` are taken. A place
    where a layer shows the sky ends what was found of that layer before it. A surface may be passed from either side.
    """
    long = k.name("path_length", k.length(way.end - way.start))
    dt = k.name("dt", 1.0 / k.clamp(k.ceil(long * texels), 1.0, float(steps)))
    steepest = k.name("steepest", long * dt * STEEPEST)
    first = [nearness_of(layer, way.start) for layer in range(layers)]

    # All states decide on stopping: what does not, Cycles computes after the last step, its sources held till then.
    # `end`: at least 0: the layer that was met; -2..-1: -1 - t of the last sky; NOTHING: neither.
    def step(i, *state):
        *before, place, end = state
        t = k.name("t", k.min((place + 1.0) * dt, 1.0))
        ahead = k.name("ahead", 1.0 - k.min(place * dt, 1.0))  # 1 - t of the place before
        q = k.name("q", way.towards(t))
        now = [k.name(f"nearness{layer}", nearness_of(layer, q)) for layer in range(layers)]
        end, first_root = k.select(now[0] > 0.0, end, -1.0 - t), 2.0
        for layer, (a, b) in enumerate(zip(before, now, strict=True)):
            low, high = a - ahead, b - (1.0 - t)
            passes = (low < 0.0) & (high >= 0.0) | (low >= 0.0) & (high < 0.0)
            solid = (a > 0.0) & (b > 0.0) & (k.abs(a - b) <= steepest * k.min(a, b))
            root = low / k.away_from_zero(low - high)
            nearer = k.name(f"meets{layer}", passes & solid & (root < first_root))
            first_root, end = k.select(nearer, root, first_root), k.select(nearer, float(layer), end)
        return (*now, place + 1.0, end), (end >= 0.0) | (t >= 1.0)

    *_, place, end = k.loop(steps, (*first, 0.0, k.select(first[0] > 0.0, NOTHING, -1.0)), step)
    low, high = k.min((place - 1.0) * dt, 1.0), k.min(place * dt, 1.0)
    is_sky = (end < 0.0) & (end > NOTHING)
    return Crossing(low, high, k.max(end, -1.0), k.select(is_sky, -1.0 - end, -1.0))
