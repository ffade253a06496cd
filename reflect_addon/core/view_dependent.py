"""Shading at the hit: what a glossy stand-in shows to the reflected ray [popescu-2006 section 6, "view-dependent effects"].

Problem. A highlight belongs to an eye and a lamp; in a captured texel it is where the capture's camera saw it.
Idea. A glossy row (glossy.py) keeps its picture for rays that need no better (a mirror's tertiary ray), and beside it, in the
places of `normal_tx`: its normals, its light without its lobe (`own_tx`), and how much of each lamp reaches a texel
(`seen_tx`). A reflected ray that meets one adds, with itself as eye ray, its lobe over each lamp (lobe.py), and along the
mirror direction the same as a mirror does, with the footprint of its roughness (hit_shading.py, second_order.py).
What is a lamp is measured: lamps are stand-ins too, so their radiance is that of their texels, their shape the row's; a sun's
is what a ray brings. Things that glow count when they are EMITS times as bright as the usual. The LAMPS that light the glossy
things most are taken; tertiary rays of glossy rows pass through them, as they are added already.
Where we depart. A share of each lamp per texel, of LOOKS points on it: without it highlights lie in shadows, and light
from a spot's side; the same rays carry what the lamp sends there.
Where a sun is among the lamps, what a glossy row's mirror direction brings is cut at the sky's brightest thousandth: the sun in
the environment map would be added again.
A point lamp without a size, which no mirror shows, has the intensity that its settings say.
Limits. Spots and suns without a size make no highlight. A lamp that moves takes its
highlights along in the next bake. What else is mirrored has sharp outlines.
"""

from dataclasses import dataclass, replace

import numpy as np

from .asset import Asset
from .billboard_atlas import pack
from .billboard_capture import Texels, part
from .billboard_kernel import SOLID
from .glossy import glossy_of
from .job import BakeJob
from .rays import Rays
from .snapshot import Instance

# As many as a texel has channels.
LAMPS = 4
# What glows is a lamp from this many times the mean radiance of the surroundings on: below, one ray shows it well enough.
EMITS = 8.0
# Points on a lamp, in its half sides, that a texel looks at.
LOOKS = ((-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5))
# Nothing is before a lamp up to this share of the way to it.
REACHED = 1 - 1e-3
# A disk of radius 1 has the area of a square of this half side.
SQUARE = np.sqrt(np.pi) / 2
# A sun stands this many scene's diagonals away.
AWAY = 1e3
# Half side of a lamp without a size over the scene's diagonal: a point to every lobe.
BULB = 1e-3
# Share of the environment map that is darker than what is taken for the sun in it.
SKY = 0.999
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True, eq=False)
class Lamp:
    """A rectangle that shines along u x v; or a ball, turned to whoever looks at it."""

    instance: str
    center: np.ndarray  # (3,) world, m
    u: np.ndarray  # (3,) m, half sides
    v: np.ndarray
    is_ball: bool
    radiance: np.ndarray  # (3,)
    shows: bool = True  # rays see it

    def seen_from(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """((N, 3), (N, 3)) half sides as points (N, 3) see them."""
        if not self.is_ball:
            return tuple(np.broadcast_to(axis, points.shape) for axis in (self.u, self.v))
        to = self.center - points
        to /= np.maximum(np.linalg.norm(to, axis=-1, keepdims=True), 1e-30)
        side = np.where(np.abs(to[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
        u = np.cross(side, to)
        u *= np.linalg.norm(self.u) / np.linalg.norm(u, axis=-1, keepdims=True)
        return u, np.cross(u, to)


@dataclass(frozen=True)
class Glossy:
    """What a bake's stand-ins need for shading at the hit, in the order of their rows."""

    order: list[int]  # the stand-ins': lit, lamps, glossy, mirrors
    captured: list[Texels]  # theirs, in that order
    counts: tuple[int, int, int, int]  # how many of each
    lamps: tuple[Lamp, ...] = ()
    brightest: float = 0.0  # of what a glossy row mirrors: SKY of the backdrop; 0 where no sun is among the lamps

    def split(self, chosen: set[int]) -> list[int]:
        """How many of the chosen stand-ins each of the four groups has."""
        ends = np.cumsum([0, *self.counts])
        return [sum(i in chosen for i in self.order[a:b]) for a, b in zip(ends, ends[1:], strict=False)]


def arranged(job: BakeJob, stand_ins: list, captured: list[Texels], backdrop: Asset) -> Glossy:
    """The order of the rows, and the lamps. backdrop: the environment map."""
    group = [3 * (t.normals is not None) - (t.own is not None) for t in captured]
    lamps, brightest = (), 0.0
    if 2 in group:
        sky = backdrop.images["radiance_tx"][..., :3].astype(np.float64) * backdrop.uniforms["radiance_scale"]
        lamps = _lamps(job, stand_ins, captured, group, float(np.minimum(sky, np.quantile(sky, SKY)).mean((0, 1)) @ LUMINANCE))
        if {lamp.instance for lamp in lamps} & {sun.name for sun in job.scene.suns}:
            brightest = float(np.quantile(sky, SKY))
        names = {lamp.instance for lamp in lamps}
        group = [1 if g in (0, 2) and s.instance in names else g for g, s in zip(group, stand_ins, strict=True)]
    order = sorted(range(len(group)), key=lambda i: group[i])
    # What glows has no lobe that matters beside its own light.
    shown = [replace(captured[i], normals=None, own=None) if group[i] == 1 else captured[i] for i in order]
    return Glossy(order, shown, tuple(group.count(g) for g in range(4)), lamps, brightest)


def _lamps(job: BakeJob, stand_ins: list, captured: list[Texels], group: list[int], surroundings: float) -> tuple[Lamp, ...]:
    """The lamps that light the glossy stand-ins most, at most LAMPS. surroundings: mean luminance of the backdrop."""
    named = job.scene.named()
    official = {lamp.name for lamp in job.scene.lamps}
    lit = [
        (s, _mean(t, s.instance in official))
        for s, t, g in zip(stand_ins, captured, group, strict=True) if g in (0, 2) and t.radiance[..., 3].any()
    ]  # fmt: skip
    usual = [radiance @ LUMINANCE for s, (radiance, _) in lit if s.instance not in official]
    bright = EMITS * np.quantile([surroundings, *usual], 0.5, method="lower")
    found: dict[object, Lamp] = {lamp.instance: lamp for lamp in (*_suns(job), *_bulbs(job))}
    for stand_in, (radiance, coverage) in lit:
        if stand_in.instance in official or radiance @ LUMINANCE > bright:
            instance = named[stand_in.instance]
            key = stand_in if stand_in.shared else stand_in.instance
            found.setdefault(key, _shape(job, stand_in, instance, radiance, coverage))
    places = [
        np.mean(job.scene.bounds([named[s.instance]]), axis=0)
        for s, g in zip(stand_ins, group, strict=True) if g == 2
    ]  # fmt: skip

    def strength(lamp: Lamp) -> float:
        area = np.linalg.norm(np.cross(lamp.u, lamp.v))
        return float(sum(lamp.radiance @ LUMINANCE * area / max(np.sum((lamp.center - p) ** 2), area) for p in places))

    return tuple(sorted(found.values(), key=strength, reverse=True)[:LAMPS])


def _suns(job: BakeJob) -> list[Lamp]:
    if not job.scene.suns:
        return []
    toward = np.array([sun.toward for sun in job.scene.suns], np.float64)
    middle, size = np.mean(job.scene.bounds(), axis=0), max(job.scene.diagonal(), 1e-30)
    origin = middle + toward * size  # outside of all
    shown = job.trace(Rays(origin.astype(np.float32), toward.astype(np.float32)), hide=(), samples=1).radiance
    lamps = []
    for sun, to, radiance in zip(job.scene.suns, toward, shown.astype(np.float64), strict=True):
        side = AWAY * size * np.tan(sun.angle / 2) * SQUARE
        u = np.cross(to, np.eye(3)[np.abs(to).argmin()])
        u *= side / np.linalg.norm(u)
        lamps.append(Lamp(sun.name, middle + to * AWAY * size, u, np.cross(u, to), False, radiance))
    return lamps


def _bulbs(job: BakeJob) -> list[Lamp]:
    side = BULB * max(job.scene.diagonal(), 1e-30)
    u, v = np.array([side, 0.0, 0.0]), np.array([0.0, side, 0.0])
    return [
        Lamp(b.name, np.asarray(b.center, np.float64), u, v, True, np.asarray(b.intensity) / (4 * side**2), False)
        for b in job.scene.bulbs
    ]  # fmt: skip


def _mean(texels: Texels, is_lamp: bool) -> tuple[np.ndarray, float]:
    """(mean radiance (3,) of the solid texels, share of the texels that is solid). Of a lamp those below half of the
    brightest do not count: a ball's rim is dark (billboard_capture.LAMP_LIFT)."""
    solid = texels.radiance[texels.radiance[..., 3] > SOLID].astype(np.float64)
    if not len(solid):
        return np.zeros(3), 0.0
    colours = solid[:, :3] / solid[:, 3:]
    bright = colours @ LUMINANCE
    return colours[bright >= 0.5 * bright.max() * is_lamp].mean(0), float(texels.radiance[..., 3].mean())


def _shape(job: BakeJob, stand_in, instance: Instance, radiance: np.ndarray, coverage: float) -> Lamp:
    if stand_in.shared:
        # As large as what of the quad is solid: a disk's, say.
        scale = np.sqrt(coverage)
        u, v = (np.asarray(axis) * half * scale for axis, half in ((stand_in.u, stand_in.half_u), (stand_in.v, stand_in.half_v)))
        return Lamp(instance.name, np.asarray(stand_in.center, np.float64), u, v, False, radiance)
    low, high = job.scene.bounds([instance])
    side = SQUARE * float(np.mean(high - low)) / 2
    return Lamp(instance.name, (low + high) / 2, np.array([side, 0.0, 0.0]), np.array([0.0, side, 0.0]), True, radiance)


def seen(job: BakeJob, stand_ins: list, shapes: list[tuple[int, int]], lamps: tuple[Lamp, ...]) -> list[np.ndarray]:
    """(h, w, 4) float32 for each stand-in, of these shapes: how much of each lamp reaches a texel, times alpha; zeros for
    mirrors, which need none."""
    named, viewers, most = job.scene.named(), job.scene.bounds([job.reflector]), int(job.settings["texels"])
    out = [np.zeros((*shape, 4), np.float32) for shape in shapes]
    for image, stand_in in zip(out, stand_ins, strict=True):
        if glossy_of(job.scene, named[stand_in.instance]) is None:
            continue
        where = part(job, stand_in, named[stand_in.instance], stand_in.enough(most, viewers))
        for channel, lamp in enumerate(lamps):
            image.reshape(-1, 4)[where.solid, channel] = _reaching(job, lamp, where.start)
    return out


def _reaching(job: BakeJob, lamp: Lamp, start: np.ndarray) -> np.ndarray:
    """(N,) share of the lamp's radiance that reaches points (N, 3): 0 behind something, less beside a spot's cone."""
    if not len(start):
        return np.zeros(0)
    u, v = lamp.seen_from(start)
    to = np.concatenate([lamp.center + u * s + v * t - start for s, t in LOOKS])
    distance = np.linalg.norm(to, axis=-1)
    origin = np.tile(start, (len(LOOKS), 1)).astype(np.float32)
    found = job.trace(Rays(origin, (to / distance[:, None]).astype(np.float32)), hide=(), samples=1)
    free = ~found.hit | (np.linalg.norm(found.position - origin.astype(np.float64), axis=-1) >= distance * REACHED)
    share = np.clip(found.radiance @ LUMINANCE / max(lamp.radiance @ LUMINANCE, 1e-30), 0.0, 1.0)
    return (free * (share if lamp.shows else 1.0)).reshape(len(LOOKS), -1).mean(0)


def images_of(job: BakeJob, glossy: Glossy, stand_ins: list, captured: list[Texels], scale: float, center):
    """(images, uniforms, options) of shading at the hit; nothing for a scene without glossy stand-ins.

    stand_ins, captured: in the order of their rows; scale: what radiance is stored divided by; center: (3,) of the asset."""
    lit, aside, count, _ = glossy.counts
    if not count:
        return {}, {}, {"glossy": 0, "lamps": 0}
    shiny = range(lit + aside, len(stand_ins))
    texels = [captured[i] for i in shiny]
    own = [t.radiance if t.own is None else t.own for t in texels]
    own_image, _ = pack([np.concatenate([image[..., :3] / scale, image[..., 3:]], -1) for image in own])
    looks = seen(job, [stand_ins[i] for i in shiny], [image.shape[:2] for image in own], glossy.lamps)
    table = np.zeros((max(len(glossy.lamps), 1), 4, 4), np.float32)
    for row, lamp in zip(table, glossy.lamps, strict=False):
        row[:, :3] = lamp.center - center, lamp.u, lamp.v, lamp.radiance
        row[0, 3] = lamp.is_ball
    options = {
        "glossy": count, "lamps": aside, "lamp_count": len(glossy.lamps),
        "ball_lamps": any(lamp.is_ball for lamp in glossy.lamps), "suns": glossy.brightest > 0,
    }  # fmt: skip
    seen_image, _ = pack(looks)
    images = {"own_tx": own_image.astype(np.float16), "seen_tx": seen_image.astype(np.float16), "lamp_buf": table}
    return images, {"sky_brightest": glossy.brightest} if glossy.brightest > 0 else {}, options
