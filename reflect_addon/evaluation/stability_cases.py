"""The stress cases of the stability table: each a scene, settings of the bake, and rays that are hard for it."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..core.asset import Asset
from ..core.billboard_atlas import ROW
from ..core.depth_camera import DepthCamera
from ..core.depth_choice import views_for
from ..core.depth_fit import DepthView
from ..core.rays import Rays
from ..core.snapshot import SceneSnapshot
from .stability_scene import MATTE, MIRROR, ball, box, broken, grid, scene_of, torus

AT = np.array([0.3, -0.2, 0.1])  # middle of the mirror ball, radius 0.5
BESIDE = np.array([[1.6, 0.3, 0.2], [-1.5, 1.0, -0.6], [-1.0, -1.3, 0.2]])  # torus, crate, second mirror
HITHER, YON = 1e-3, 1e2


@dataclass(frozen=True)
class Case:
    """rays(rng, count, assets) -> Rays; views: depth_maps', as depth_choice.views_for; light: Surfaces.job's."""

    name: str
    scene: SceneSnapshot
    rays: Callable[[np.random.Generator, int, dict[str, Asset]], Rays]
    settings: dict = field(default_factory=dict)
    views: Callable = views_for
    light: Callable | None = None


def cases() -> tuple[Case, ...]:
    """All of them; none needs a file."""
    room = scene_of(_room())
    small = scene_of(_room() | {"Torus": (ball(0.004, (1.6, 0.3, 0.2), 6), MATTE), "Needle": (box((1e-4, 1e-4, 1.2), (0.2, 1.7, 0)), MATTE)})
    return (
        *(Case(f"scale {size:g}", _placed(size, 0.0), _reflected(size, 0.0)) for size in (1e-4, 1.0, 1e5)),
        Case("2 km from the origin", _placed(1.0, 2000.0), _reflected(1.0, 2000.0)),
        Case("grazing rays", room, _grazing),
        Case("epipole inside the image", room, _epipoles),
        Case("coplanar, zero-area triangles", scene_of(_room(broken)), _reflected(1.0, 0.0)),
        Case("objects of one texel", small, _reflected(1.0, 0.0)),
        Case("seams between slabs, components 0", room, _seams),
        Case("suns of 7e4, negative and infinite light", room, _reflected(1.0, 0.0), light=_extreme),
        Case("light fields of 2 views", room, _seams, {"views": 2}),
        Case("depth maps of 4 texels", room, _reflected(1.0, 0.0), {"texels": 4, "resolution": 4}),
        Case("yon/hither 1e5", scene_of(_deep()), _along_the_deep, {"self_reflections": False}, _deep_view),
    )


def _room(change=lambda shape: shape) -> dict:
    """A mirror ball in a room without a ceiling, a torus (a volume with a hole), a crate (flat sides), a second mirror."""
    return {
        "Mirror": (change(ball(0.5, AT)), MIRROR),
        "Room": (change(box((6, 5, 3), inside=True, top=False)), MATTE),
        "Torus": (change(torus(0.4, 0.15, (1.6, 0.3, 0.2))), MATTE),
        "Crate": (change(box((0.7, 0.5, 0.4), (-1.5, 1.0, -0.6))), MATTE),
        "Other": (change(ball(0.35, (-1.0, -1.3, 0.2))), MIRROR),
    }


def _placed(size: float, away: float) -> SceneSnapshot:
    return scene_of({n: ((p * size + away, f), m) for n, ((p, f), m) in _room().items()})


def _reflected(size: float, away: float):
    """From the mirror ball, all over and in all directions above its surface; two in three towards what stands beside it."""

    def rays(rng, count, assets):
        out = _unit(rng.normal(size=(count, 3)))
        direction = _unit(out + 0.999 * _unit(rng.normal(size=(count, 3))))
        towards = _unit(BESIDE[rng.integers(len(BESIDE), size=count)] + rng.normal(size=(count, 3)) * 0.25 - AT - 0.501 * out)
        seen = ((towards * out).sum(1) > 0.01) & (np.arange(count) % 3 > 0)
        direction[seen] = towards[seen]
        return _rays((AT + 0.501 * out) * size + away, direction)

    return rays


def _grazing(rng, count, assets) -> Rays:
    """Along the mirror's surface, along the floor, the walls and the crate's top, off by 1e-7 to 1e-2; towards edges."""
    parts = np.array_split(np.arange(count), 4)
    slant = 10.0 ** rng.uniform(-7, -2, count)[:, None] * rng.choice([-1, 1], (count, 1))
    origin, direction = rng.uniform([-2.9, -2.4, -1.4], [2.9, 2.4, 1.4], (count, 3)), _unit(rng.normal(size=(count, 3)))
    out = _unit(rng.normal(size=(len(parts[0]), 3)))
    origin[parts[0]] = AT + 0.5001 * out
    direction[parts[0]] = np.cross(out, direction[parts[0]])
    direction[parts[0]] = _unit(direction[parts[0]]) + out * np.abs(slant[parts[0]])
    for part, axis, at in ((parts[1], 2, -1.5), (parts[2], 0, 3.0), (parts[3], 2, -0.4)):
        origin[part, axis] = at - np.sign(at) * 10.0 ** rng.uniform(-7, -1, len(part)) * (1 if axis != 2 or at < -1 else -1)
        direction[part, axis] = slant[part, 0]
    return _rays(origin, _unit(direction))


def _seams(rng, count, assets) -> Rays:
    """From the mirror's surface and the planes, edges and corners of the box around it; along axes, planes and diagonals exactly,
    where slabs of a light field meet, and off them by 1e-7 to 1e-2."""
    axes = np.array([v for v in np.ndindex(3, 3, 3) if v != (1, 1, 1)]) - 1.0
    direction = axes[rng.integers(len(axes), size=count)]
    some = np.arange(count) % 3 == 0
    direction[some] += (10.0 ** rng.uniform(-7, -2, count)[:, None] * rng.choice([-1, 0, 1], (count, 3)))[some]
    plane = np.arange(count) % 5 == 1
    direction[plane, rng.integers(0, 3, plane.sum())] *= rng.uniform(0, 1, plane.sum())
    out = _unit(rng.normal(size=(count, 3)))
    start = 0.5 * out
    for share, fixed in ((2, 1), (11, 2), (29, 3)):  # on sides, edges, corners
        some = np.arange(count) % share == 1
        start[some] = rng.uniform(-0.5, 0.5, (some.sum(), 3))
        start[some, :fixed] = np.sign(start[some, :fixed]) * 0.5
    return _rays(AT + start, _unit(direction))


def _extreme(radiance: np.ndarray) -> np.ndarray:
    """The same with suns as bright as half floats do not hold, and with light that is less than none and without end."""
    out, place = radiance.copy(), np.floor(radiance[:, 0] * 1e4).astype(int) % 50
    out[place == 0], out[place == 1], out[place == 2], out[place == 3] = 7e4, -1.0, np.inf, -np.inf
    return out


def _epipoles(rng, count, assets) -> Rays:
    """Through the eyes of depth cameras or close by, from them and towards them; parallel to their images; null rays."""
    asset = assets["depth_maps"]
    maps = asset.images["billboard_buf"][[*_maps(asset)]].astype(np.float64)
    axes = maps[:, [ROW["plane"], ROW["u"], ROW["v"]]]
    eyes = np.array([np.linalg.solve(a[:, :3], -a[:, 3]) for a in axes]) + asset.uniforms["center"]
    which = rng.integers(len(maps), size=count)
    target = maps[which, ROW["ball"], :3] + asset.uniforms["center"] + 0.2 * rng.normal(size=(count, 3))
    direction = _unit(target - eyes[which])
    off = np.where(np.arange(count) % 3, 10.0 ** rng.uniform(-8, -1, count), 0)[:, None] * rng.normal(size=(count, 3))
    origin = eyes[which] + off + direction * rng.uniform(-3, 1, (count, 1))
    kind = np.arange(count) % 8
    origin[kind == 1] = (eyes[which] + off)[kind == 1]
    direction[kind == 2] *= -1
    forward = _unit(axes[which, 0, :3])
    direction[kind == 3] = _unit(np.cross(forward, direction))[kind == 3]
    origin[kind == 3] = target[kind == 3] - 2 * direction[kind == 3]
    direction[kind == 4] = forward[kind == 4]
    direction[:8] = 0
    return _rays(origin, direction)


def _maps(asset: Asset) -> range:
    """Rows of the asset's depth maps that are only lit."""
    return range(asset.options["count"] - asset.options["maps"], asset.options["count"])


def _deep() -> dict:
    """A mirror beside a spiral that fills a depth camera's image from 1 mm to 100 m; the camera stands at the origin."""
    s, t = np.meshgrid(np.linspace(-0.9, 0.9, 120), np.linspace(-0.6, 0.6, 8), indexing="ij")
    z = 2 * HITHER * (0.25 * YON / HITHER) ** ((s + 0.9) / 1.8)
    return {"Mirror": (ball(0.5, (-2.0, 0.0, -2.0)), MIRROR), "Spiral": (grid(np.stack([s, t, np.ones_like(s)], -1) * z[..., None]), MATTE)}


def _deep_view(job, volumes) -> list[DepthView]:
    axes = np.array([[1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0]])
    return [DepthView("Spiral", DepthCamera(np.zeros(3), *axes, 1.0, HITHER, YON))]


def _along_the_deep(rng, count, assets) -> Rays:
    """From in front of the spiral at all its depths, towards places at all its depths."""

    def places(share):
        s, t = rng.uniform(-0.9, 0.9, count), rng.uniform(-0.6, 0.6, count)
        return np.stack([s, t, np.ones(count)], -1) * (share * 2 * HITHER * (0.25 * YON / HITHER) ** ((s + 0.9) / 1.8))[:, None]

    origin = places(rng.uniform(0.05, 0.9, count))
    return _rays(origin, _unit(places(np.ones(count)) - origin))


def _rays(origin, direction) -> Rays:
    return Rays(np.asarray(origin).astype(np.float32), np.asarray(direction).astype(np.float32))


def _unit(vectors) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)
