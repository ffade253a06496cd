"""core/map_mirrors.py and live_maps.py: which mirrors rays of a map meet, and what they show then, in a painted ball with two mirrors in it."""

from dataclasses import replace

import numpy as np
import pytest
import tolerances
from analytic import smooth, sphere_distance, unit
from mesh_scenes import MIRROR
from mirror_views import mirror

from reflect_addon.core import cubemap, live_maps, map_mirrors
from reflect_addon.core.curved_views import CurvedMirror
from reflect_addon.core.kernel import evaluate, record, record_function, run_numpy
from reflect_addon.core.rays import Hits, Rays

GOLD = replace(MIRROR, metallic=1.0, base_color=(0.9, 0.7, 0.3))
BALL = CurvedMirror(1, np.array([0.1, -0.2, 0.3]), 0.5, 1.0)
PANES = tuple(replace(mirror(place, normal, half), material=GOLD) for place, normal, half in (
    ((-1.4, 0.0, 0.2), (1, 0, 0), 0.9), ((0.2, 0.4, -1.1), (0.1, 0.0, 1), 0.8),
))  # fmt: skip
ROUND = replace(BALL, ball=GOLD)
WORLD, SIDE = 4.0, 128  # m, of a painted ball around everything; texels of the map


def starts(rng, count=1500):
    """Rays that leave the reflector's ball."""
    normal = unit(rng.normal(size=(count, 3)))
    direction = unit(normal + 0.9 * unit(rng.normal(size=(count, 3))))
    return BALL.center + BALL.radius * normal, direction


def meets(origin, direction, panes, ball=False):
    """(distance, index or -1) of the mirror that each ray meets, by the book; ball: the reflector's too, as the index after the panes'."""
    far, which = np.full(len(origin), np.inf), np.full(len(origin), -1)
    for index, pane in enumerate(panes):
        falls = -direction @ pane.normal
        t = ((origin - pane.origin) @ pane.normal) / np.where(falls > 0, falls, np.nan)
        off = origin + np.nan_to_num(t)[:, None] * direction - pane.origin
        half = np.abs(off @ unit(np.roll(pane.outline, -1, 0) - pane.outline)[:2].T).max(1)
        hit = (t > 0) & (half <= np.linalg.norm(pane.outline[1] - pane.outline[0]) / 2) & (t < far)
        far[hit], which[hit] = t[hit], index
    if ball:
        off = origin - BALL.center
        t = sphere_distance(off, direction, np.zeros(3), BALL.radius)
        hit = (np.linalg.norm(off, axis=1) > BALL.radius * (1 + 1e-6)) & (t < far)
        far[hit], which[hit] = t[hit], len(panes)
    return far, which


def normals_of(origin, far, direction, which):
    """(N, 3) of the mirrors that rays meet."""
    out = (origin + far[:, None] * direction - BALL.center) / BALL.radius
    return np.where((which == len(PANES))[:, None], out, np.array([*(p.normal for p in PANES), np.zeros(3)])[which])


def shown(origin, direction, panes, bounces, ball=False):
    """(radiance, length of the way) in a painted ball, by the book: mirrors reflect gold's share, Schlick's curve to white."""
    share, way = np.ones((len(origin), 3)), np.zeros(len(origin))
    for _ in range(bounces):
        far, which = meets(origin, direction, panes, ball)
        hit = which >= 0
        normal = normals_of(origin[hit], far[hit], direction[hit], which[hit])
        cosine = -np.einsum("nx,nx->n", direction[hit], normal)
        share[hit] *= np.array(GOLD.base_color) * (1 - (1 - cosine[:, None]) ** 5) + (1 - cosine[:, None]) ** 5
        way[hit] += far[hit]
        origin, direction = origin.copy(), direction.copy()
        origin[hit] += far[hit, None] * direction[hit]
        direction[hit] += 2 * cosine[:, None] * normal
    b = np.einsum("nx,nx->n", origin, direction)
    t = -b + np.sqrt(b * b - (origin**2).sum(1) + WORLD**2)
    return share * (0.2 + smooth(2.5 * (origin + t[:, None] * direction))), way + t


@pytest.fixture(scope="module")
def image():
    rays = cubemap.bundle(BALL.center, SIDE)
    origin, direction = rays.origin.astype(float), rays.direction.astype(float)
    radiance, way = shown(origin, direction, PANES, 6)
    place = origin + way[:, None] * direction
    none = np.zeros(len(rays), np.int32)
    return cubemap.assemble(BALL.center, SIDE, Hits(radiance, place, direction, none, none == 0))


def answered(image, origin, direction, panes, bounces=map_mirrors.BOUNCES, ball=BALL):
    texels, uniforms = image
    reach = live_maps.Reach(BALL.center, uniforms["distance_scale"] * cubemap.FARTHEST)
    asset = live_maps.asset_of_map(reach, SIDE, SIDE, texels, ball, panes, bounces)
    asset = replace(asset, uniforms={**asset.uniforms, "radiance_scale": uniforms["radiance_scale"]})
    return run_numpy(record(live_maps.trace, asset), asset, Rays(origin.astype(np.float32), direction.astype(np.float32)))


@pytest.mark.parametrize("ball", [BALL, ROUND])
def test_the_nearest_mirror_is_met(rng, ball):
    """Inside its outline and from the side that mirrors, the ball from without; the rest meets none."""
    origin, direction = starts(rng)
    origin[::3] += 6 * direction[::3]  # also from behind the mirrors
    direction[::6] = unit(ball.center + 0.99 * ball.radius * unit(rng.normal(size=direction[::6].shape)) - origin[::6])  # and towards the ball, not to graze it
    values = {"offset": origin - BALL.center, "direction": direction}
    uniforms = map_mirrors.uniforms_of(ball, PANES)

    def kernel(k, scope, offset, direction):
        met = map_mirrors.nearest(k, scope, offset, direction)
        return {"distance": met.distance, "normal": met.normal}

    options = {"mirrors": tuple(len(p.outline) for p in PANES), "ball": map_mirrors.meets_ball(ball)}
    program = record_function(kernel, dict.fromkeys(values, "vec3"), uniforms=uniforms, options=options)
    found = evaluate(program, values, type("Asset", (), {"images": {}, "uniforms": uniforms}))
    far, which = meets(origin, direction, PANES, ball is ROUND)
    hit = which >= 0
    assert np.bincount(which[hit], minlength=3)[: 2 + (ball is ROUND)].min() > 50 and np.array_equal(found["distance"] < 1e6, hit)
    np.testing.assert_allclose(found["distance"][hit], far[hit], rtol=1e-4)
    np.testing.assert_allclose(found["normal"][hit], normals_of(origin, far, direction, which)[hit], atol=tolerances.BALL_NORMAL)


def test_what_mirrors_show_is_where_it_is(image, rng):
    """Of rays that meet a mirror and do not come back to the ball; as far as the light comes, too. Through images alone it is not."""
    origin, direction = starts(rng)
    far, which = meets(origin, direction, PANES)
    at = origin + np.where(which < 0, 0, far)[:, None] * direction
    normal = np.array([p.normal for p in PANES])[which]
    on = direction - 2 * np.einsum("nx,nx->n", direction, normal)[:, None] * normal
    off = at - BALL.center
    toward = np.einsum("nx,nx->n", off, on)
    clear = (which >= 0) & ((toward > 0) | (toward**2 < (off**2).sum(1) - BALL.radius**2))
    truth, way = shown(origin, direction, PANES, map_mirrors.BOUNCES)
    exact, images = answered(image, origin, direction, PANES), answered(image, origin, direction, ())
    errors = [np.sqrt(((answer.radiance - truth)[clear] ** 2).mean()) for answer in (exact, images)]
    assert clear.sum() > 200 and errors[0] < tolerances.MAP_MIRRORED * errors[1]
    along = np.linalg.norm(exact.position - origin, axis=1)
    assert np.median(np.abs(along / way - 1)[clear]) < tolerances.MAP_DISTANCE
    others = which < 0
    np.testing.assert_array_equal(exact.radiance[others], images.radiance[others])


def test_a_ball_shows_itself_in_mirrors(image, rng):
    """Rays that come back to it from a mirror are mirrored in it and go on; by its image, as the map's middle sees it, they are not."""
    origin, direction = starts(rng, 10_000)
    far, which = meets(origin, direction, PANES)
    at = origin + np.where(which < 0, 0, far)[:, None] * direction
    on = direction - 2 * (direction * normals_of(origin, far, direction, which)).sum(1, keepdims=True) * normals_of(origin, far, direction, which)
    back = (which >= 0) & (meets(at, on, PANES, True)[1] == len(PANES))
    origin, direction = origin[back], direction[back]
    truth, _ = shown(origin, direction, PANES, 4, True)
    exact, images = (answered(image, origin, direction, PANES, 4, ball) for ball in (ROUND, BALL))
    errors = [np.sqrt(((answer.radiance - truth) ** 2).mean()) for answer in (exact, images)]
    assert back.sum() > 100 and errors[0] < tolerances.MAP_MIRRORED * errors[1]


def test_only_a_smooth_metal_ball_is_met():
    assert map_mirrors.meets_ball(ROUND) and not map_mirrors.meets_ball(BALL)
    for other in (replace(GOLD, metallic=0.0), replace(GOLD, roughness=0.4)):
        assert not map_mirrors.meets_ball(replace(BALL, ball=other))


def test_only_what_constants_tell_is_met_exactly():
    pane = PANES[0]
    dull, holed, round_, own = replace(pane, material=None), replace(pane, filled=0.8), mirror(pane.origin, pane.normal, corners=40), replace(pane, reflector=1)
    glass = replace(pane, material=replace(GOLD, metallic=0.0))
    assert map_mirrors.met_exactly(BALL, (dull, PANES[1], holed, replace(round_, material=GOLD), glass, own, pane)) == (PANES[1], pane)
    assert len(map_mirrors.met_exactly(BALL, (pane,) * 20)) == map_mirrors.MOST
