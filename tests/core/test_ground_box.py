"""core/ground_box.py: the box's kernel against planes in closed form, its seams, and whatever rays may come."""

import numpy as np
import pytest
import tolerances
from analytic import SKY, directions, unit
from ground_boxes import LEVEL, N, asset_of, rays_in, scaled, tilted

from reflect_addon.core import cubemap, spaces
from reflect_addon.core.asset import Asset
from reflect_addon.core.ground_box import Ground
from reflect_addon.core.kernel import emit_glsl, record, run_numpy
from reflect_addon.core.methods import billboards, environment
from reflect_addon.core.rays import Rays

SCALES = [1e-4, 1.0, 1e5]


def answer(asset, rays, width=0.0, spread=0.0, kernel=billboards.trace):
    return run_numpy(record(kernel, asset), asset, rays, width, spread)


def leaves(ground: Ground, rays: Rays):
    """((N, 3) where the rays leave the box, its own axes; (N,) share h / H, 0 on the ground; (N,) on the ground), plane by
    plane in float64."""
    p, d = ground.local(rays.origin), rays.direction.astype(np.float64) @ ground.axes.T
    best, floor = np.full(len(p), np.inf), np.zeros(len(p), bool)
    walls = [(axis, side[axis], sign) for axis in (0, 1) for side, sign in ((ground.low, -1), (ground.high, 1))]
    for axis, value, sign in (*walls, (2, ground.low[2], -1)):
        towards = d[:, axis] * sign > 0
        t = np.full(len(p), np.inf)
        t[towards] = (value - p[towards, axis]) / d[towards, axis]
        floor = np.where(t < best, axis == 2, floor)
        best = np.minimum(best, t)
    met = p + np.minimum(best, SKY)[:, None] * d
    return met, np.where(floor, 0.0, np.clip((met[:, 2] - ground.low[2]) / ground.height, 0, 1)), floor


def looked_along(found, asset) -> np.ndarray:
    """(N, 3) unit: the direction from the centre in which an answer's point lies."""
    return unit(found.position.astype(np.float64) - asset.uniforms["center"])


@pytest.mark.parametrize("ground", [scaled(s) for s in SCALES] + [tilted(s) for s in SCALES] + [tilted(center=(30.0, -20.0, 5.0))])
def test_the_ground_is_the_plane(rng, ground):
    """Its point is the ray's on the plane; its colour the map's along the line from E to that point."""
    rays, asset = rays_in(rng, ground, 20_000), asset_of(ground)
    met, _, floor = leaves(ground, rays)
    found = answer(asset, rays)
    assert 0.2 < floor.mean() < 0.8
    assert np.all(found.status[floor] == spaces.STATUS_HIT)
    size = np.linalg.norm(ground.high)
    rounding = 20 * tolerances.FLOAT32 * (size + np.abs(ground.center).max())
    # At a slant the plane's own rounding is magnified along the ray; across it not.
    off = found.position.astype(np.float64) - ground.world(met)
    across = off - rays.direction * (off * rays.direction).sum(1, keepdims=True)
    assert np.linalg.norm(across[floor], axis=1).max() < rounding
    assert np.abs(ground.local(found.position)[floor, 2] - ground.low[2]).max() < rounding
    by_map = answer(asset, Rays(rays.origin, unit(ground.world(met) - ground.center).astype("f")), kernel=environment.trace)
    apart = np.abs(found.radiance - by_map.radiance)[floor]
    assert apart.max() < 1e-3 + 2 * rounding / -ground.low[2]


@pytest.mark.parametrize("ground", [LEVEL, tilted(), scaled(1e-4), scaled(1e5)])
def test_above_the_walls_it_is_the_environment_to_the_bit(rng, ground):
    rays, asset = rays_in(rng, ground, 20_000), asset_of(ground)
    _, share, floor = leaves(ground, rays)
    width, spread = rng.uniform(0, 0.1, 20_000) * ground.height, rng.uniform(0, 0.3, 20_000)
    found, plain = answer(asset, rays, width, spread), answer(asset, rays, width, spread, environment.trace)
    above = found.status == spaces.STATUS_FELL_BACK
    assert np.array_equal(above[np.abs(share - 1) > 1e-4], (share >= 1)[np.abs(share - 1) > 1e-4]) and 0.2 < above.mean() < 0.8
    for field in ("radiance", "position"):
        assert np.array_equal(getattr(found, field)[above], getattr(plain, field)[above])


@pytest.mark.parametrize("ground", [LEVEL, tilted(), tilted(members=())])
def test_walls_blend_the_two_rays(rng, ground):
    """(1 - w) r_a + w t r_1^d in float64, t at least a quarter of the nearest wall's distance."""
    rays, asset = rays_in(rng, ground, 20_000), asset_of(ground)
    met, share, floor = leaves(ground, rays)
    wall = ~floor & (share < 1)
    p, d = ground.local(rays.origin), rays.direction @ ground.axes.T
    travelled = np.maximum(np.linalg.norm(met - p, axis=1), 0.25 * 2.0 * share)
    blend = (1 - share)[:, None] * met + (share * travelled)[:, None] * d
    found = looked_along(answer(asset, rays), asset)[wall]
    assert wall.mean() > 0.05
    np.testing.assert_allclose(found, unit(blend @ ground.axes)[wall], atol=10 * tolerances.KERNEL_DIRECTION)


def seams(ground: Ground):
    """{name: (M, 3) points on an edge of the box, local}: the ground's rim, H, and the corners."""
    t = np.linspace(0.02, 0.98, 50)[:, None]
    low, high, floor, top = ground.low, ground.high, ground.low[2], ground.low[2] + ground.height
    along_x = [np.c_[low[0] + t * (high[0] - low[0]), np.full_like(t, y), np.full_like(t, floor)] for y in (low[1], high[1])]
    along_y = [np.c_[np.full_like(t, x), low[1] + t * (high[1] - low[1]), np.full_like(t, floor)] for x in (low[0], high[0])]
    rim = np.concatenate(along_x + along_y)
    corner = np.concatenate([
        np.concatenate([np.full_like(t, x), np.full_like(t, y), floor + t * 1.5 * ground.height], 1)
        for x in (low[0], high[0]) for y in (low[1], high[1])
    ])  # fmt: skip
    bottom = np.array([[x, y, floor] for x in (low[0], high[0]) for y in (low[1], high[1])])
    return {"rim": rim, "top": rim + [0, 0, top - floor], "corner": corner, "bottom corner": bottom}


@pytest.mark.parametrize("ground", [LEVEL, tilted(), tilted(members=())])
def test_there_is_no_seam(rng, ground):
    """Rays that turn by 1e-4 across every edge of the box turn the look-up by a few times that, from everywhere inside."""
    asset, step = asset_of(ground), 1e-4
    for name, points in seams(ground).items():
        start = rays_in(rng, ground, 40, spare=0.1).origin
        d = unit(ground.world(points)[None] - start[:, None].astype(np.float64)).reshape(-1, 3)
        origin = np.repeat(start, len(points), 0)
        seen = []
        turn = np.cross(d, unit(rng.normal(size=d.shape)))
        for along in (-1, 1):
            found = answer(asset, Rays(origin, unit(d + along * step / 2 * unit(turn)).astype("f")))
            seen.append(looked_along(found, asset))
        jump = np.linalg.norm(seen[0] - seen[1], axis=1)
        # A start near a wall sees E's angle grow by the ratio of distances; the blend by radius / H.
        t = np.linalg.norm(ground.world(np.tile(points, (40, 1))) - origin, axis=1)
        away = np.linalg.norm(np.tile(points, (40, 1)), axis=1)
        slant = np.abs(unit(ground.world(np.tile(points, (40, 1))) - origin) @ ground.axes.T).min(1)
        bound = step * (t / away / np.maximum(slant, 0.02) * (1 + 6.0 / ground.height)) + 2e-5
        assert np.all(jump < bound), f"{name}: {np.max(jump / bound)} times what the geometry turns"
        assert np.median(jump) < 6 * step, name


def test_a_dense_sweep_across_ground_wall_and_sky(rng):
    """From one point down to up over a wall: the direction looked along never jumps, and on the wall never turns back."""
    for ground in (LEVEL, tilted(members=())):
        asset = asset_of(ground)
        for start in ([0.5, 0.3, 0.2], [-0.6, -0.5, -0.3], [0.0, 0.0, 0.0]):
            elevation = np.linspace(-np.pi / 2, np.pi / 4, 100_001)
            for way in ([1.0, 0.0], unit([2.0, 4.0]), [-0.3, -1.0]):  # the second: towards a corner
                d = np.c_[np.cos(elevation)[:, None] * unit(way), np.sin(elevation)] @ ground.axes
                rays = Rays(np.broadcast_to(ground.world(np.array(start)), d.shape).astype("f"), d.astype("f"))
                seen = looked_along(answer(asset, rays), asset)
                turn = np.linalg.norm(np.diff(seen, axis=0), axis=1)
                assert turn.max() < 20 * (elevation[1] - elevation[0]) + 1e-5
                wall = leaves(ground, rays)[1] > 0
                assert np.all(np.diff((seen @ ground.axes[2])[wall]) > -1e-6)


def test_from_its_own_height_the_ground_goes_on_as_a_plane(rng):
    """H = the start's height: wherever the walls stand the look-up is that of the endless plane."""
    for near in (0.2, 1.0, 5.0):
        ground = Ground(np.zeros(3), np.eye(3), np.array([-near, -near, -0.5]), np.array([near, near]), 0.6, ("Ground",))
        asset = asset_of(ground)
        start = np.c_[rng.uniform(-0.15, 0.15, (5000, 2)), np.full(5000, 0.1)]
        d = unit(np.c_[rng.normal(size=(5000, 2)), -np.exp(rng.uniform(-6, 1, 5000))])
        plane = start + d * (-0.6 / d[:, 2])[:, None]
        found = answer(asset, Rays(start.astype("f"), d.astype("f")))
        np.testing.assert_allclose(looked_along(found, asset), unit(plane), atol=10 * tolerances.KERNEL_DIRECTION)


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("members", [(), ("Ground",)])
def test_any_ray_has_a_finite_answer(rng, scale, members):
    """Null rays, along the axes, in the walls, from under the ground and from far outside."""
    ground = tilted(scale, members)
    count = 30_000
    origin = rng.uniform(-1, 1, (count, 3)) * rng.choice([0.0, 0.3, 1.0, 10.0, 1e4], (count, 1)) * 5 * scale
    on = rng.integers(0, 3, count)
    origin[:9000][np.arange(9000), on[:9000]] = ground.low[on[:9000]]
    d = directions(rng, count)
    d[-50:] = 0
    found = answer(asset_of(ground), Rays(ground.world(origin).astype("f"), d.astype("f")), 0.1 * scale, 0.2)
    for field in (found.radiance, found.position, found.status, found.coverage):
        assert np.isfinite(field).all()
    assert np.abs(found.position).max() <= SKY * (1 + 1e-5)


def test_outside_and_below_it_continues_the_inside(rng):
    """A start that passes a wall or the ground changes the answer by no more than it moved."""
    ground, asset = LEVEL, asset_of(LEVEL)
    step = 1e-4
    low, high = ground.low, np.array([*ground.high, 1.5])
    for axis, value in ((0, low[0]), (1, high[1]), (2, low[2])):
        at = low + (high - low) * rng.uniform(0.1, 0.9, (4000, 3))
        d = directions(rng, 4000)
        d = d[np.abs(d).min(1) > 0.05]
        at = at[: len(d)]
        pair = []
        for side in (-step, step):
            at[:, axis] = value + side
            pair.append(looked_along(answer(asset, Rays(at.astype("f"), d.astype("f"))), asset))
        turned = np.linalg.norm(pair[0] - pair[1], axis=1)
        assert turned.max() < 2 * step * 20 * (1 + 6 / ground.height) / 0.4


def test_without_a_ground_nothing_of_it_is_recorded():
    asset = asset_of(LEVEL)
    plain = Asset("billboards", "", asset.images, asset.uniforms, {**asset.options, "ground": False})
    text = emit_glsl(record(billboards.trace, plain), ("radiance",)).source
    assert "ground" not in text and "box" not in text and "morph" not in text
    assert "morph" in emit_glsl(record(billboards.trace, asset), ("radiance",)).source


@pytest.mark.parametrize("ground", [LEVEL, tilted(), tilted(members=())])
def test_the_footprint_is_the_angle_seen_from_the_centre(rng, ground):
    """Levels hold their own numbers; on the ground the footprint over the distance from E, above the walls the spread."""
    asset = asset_of(ground)
    asset.uniforms["radiance_scale"] = 1.0
    for level in range(cubemap.level_count(N)):
        x, y = cubemap.level_origin(N, level)
        side = (N >> level) + 2
        asset.images["radiance_tx"][y : y + side, x : x + 6 * side, :3] = level
    rays = rays_in(rng, ground, 4000)
    width, spread = rng.uniform(0, 0.3, 4000), rng.uniform(0, 0.3, 4000)
    met, share, floor = leaves(ground, rays)
    t = np.linalg.norm(met - ground.local(rays.origin), axis=1)
    angle = np.where(floor, (width + spread * t) / np.linalg.norm(met, axis=1), spread)
    level = np.log2(np.maximum(angle * N / 2, 1)).clip(0, cubemap.level_count(N) - 1)
    found = answer(asset, rays, width, spread)
    told = floor | (share >= 1)
    np.testing.assert_allclose(found.radiance[told, 0], level[told], atol=1e-2)
