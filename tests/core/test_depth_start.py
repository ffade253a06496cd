"""core/depth_start.py and orders above the second: two mirror balls grown together, whose rays meet each other at the crease,
against Embree."""

from dataclasses import replace

import numpy as np
import pytest
import tolerances
import trimesh
from analytic import directions, unit
from mesh_scenes import MIRROR, first_hits, job, mirror_reflectance, smooth_mirror, snapshot, world_mesh

from reflect_addon.core import spaces
from reflect_addon.core.billboard_atlas import ROW
from reflect_addon.core.errors import ReflectError
from reflect_addon.core.kernel import emit_glsl, record, run_numpy
from reflect_addon.core.methods import depth_maps
from reflect_addon.core.rays import Rays

SETTINGS = {**depth_maps.DEFAULTS, "resolution": 32, "samples": 1, "texels": 64, "sky_error": 0, "maps": 4}
# Two balls of this radius, their middles at -APART and APART on the x axis: a crease so narrow that rays meet it twice.
RADIUS = 1.0
APART = 0.9
TEXEL = 2 * (RADIUS + APART) / (SETTINGS["texels"] * SETTINGS["self_detail"])
GOLD = replace(MIRROR, base_color=(0.9, 0.7, 0.4))


def grown_together():
    balls = [trimesh.creation.icosphere(5, RADIUS).apply_translation([x, 0, 0]) for x in (-APART, APART)]
    return snapshot(smooth_mirror(trimesh.util.concatenate(balls)), Thing=trimesh.creation.icosphere(3, 0.4).apply_translation([0, 3, 0.5]))


def paint(position, owner):
    """The sky in all directions another; the thing dark."""
    return np.where((owner == 1)[:, None], 0.05, 0.6 + 0.4 * unit(position))


@pytest.fixture(scope="module")
def work():
    return job(grown_together(), SETTINGS, paint=paint)


@pytest.fixture(scope="module")
def asset(work):
    return depth_maps.bake(work)


def from_the_crease(rng, count, most=1.0):
    """Rays from the outside of the left ball, at up to `most` from the crease, to all sides of its normals."""
    up = unit(np.c_[np.zeros(count), rng.normal(size=(count, 2))])
    angle = np.arccos(APART) + rng.uniform(0.01, most, count)  # from +x, where the crease is at the first of these
    normal = np.cos(angle)[:, None] * [1, 0, 0] + np.sin(angle)[:, None] * up
    direction = unit(normal + 0.98 * directions(rng, count))
    start = [-APART, 0, 0] + 1.0005 * RADIUS * normal
    return Rays(start.astype("f"), direction.astype("f"))


def answer(asset, rays):
    return run_numpy(record(depth_maps.trace, asset), asset, rays)


def truth_of(work, rays):
    return first_hits(world_mesh(work.scene, work.scene.instances[0]), rays.origin, rays.direction)[1]


def test_what_is_near_the_start_is_found(work, asset, rng):
    """Hits one to eight texels away: the mirror's own other half."""
    rays = from_the_crease(rng, 6000, 0.3)
    t = truth_of(work, rays)
    near = (t > TEXEL) & (t < 8 * TEXEL)
    assert near.sum() > 400
    shares = []
    for starts in (True, False):
        found = answer(replace(asset, options={**asset.options, "starts": starts}), rays)
        off = np.abs(np.linalg.norm(found.position - rays.origin, axis=1) - t)
        shares.append(np.mean((found.status == spaces.STATUS_HIT)[near] & (off < TEXEL / 4)[near]))
    assert shares[0] > tolerances.NEAR_FOUND
    assert 1 - shares[0] < 0.5 * (1 - shares[1]), "the march finds what rows alone miss"


def test_the_start_itself_is_not_met(work, asset, rng):
    rays = from_the_crease(rng, 6000)
    free = ~np.isfinite(truth_of(work, rays))
    others = work.trace(rays, hide=("Mirror",), bounces=0)
    free &= ~others.hit
    assert free.sum() > 2000
    assert np.mean(answer(asset, rays).status[free] == spaces.STATUS_HIT) < tolerances.FALSE_STARTS


def test_the_third_order(work, asset, rng):
    """Where a ray meets the mirror twice, one order more brings what is seen after that."""
    rays = from_the_crease(rng, 8000, 0.6)
    truth = work.trace(rays)
    first = work.trace(rays, bounces=0)
    own = first.object == 0
    toward = np.einsum("nx,nx->n", rays.direction, first.normal)[:, None]
    onward = Rays((first.position + 1e-4 * first.normal).astype("f"), (rays.direction - 2 * toward * first.normal).astype("f"))
    second = work.trace(onward, bounces=0)
    ways = [np.linalg.norm(hits.position - r.origin, axis=1) for hits, r in ((first, rays), (second, onward))]
    again = own & (second.object == 0) & (np.minimum(*ways) > 2 * TEXEL)
    assert again.sum() > 50
    assert asset.options["order"] == 3
    median = []
    for order in (3, 2):
        found = answer(replace(asset, options={**asset.options, "order": order}), rays)
        median.append(np.median(np.abs(found.radiance - truth.radiance).max(1)[again]))
        once = own & ~again
        assert np.median(np.abs(found.radiance - truth.radiance).max(1)[once]) < tolerances.THIRD_ORDER_MEDIAN
    assert median[0] < tolerances.THIRD_ORDER_MEDIAN < 0.1 * median[1]


@pytest.mark.parametrize("order", [2, 3, 5])
def test_two_walls_that_face_each_other(order, rng):
    """Exact: each order is one reflectance more, and past the last one the wall is looked through."""
    walls = {}
    for name, z in (("Above", 2.0), ("Below", -2.0)):
        corners = np.array([[-90, -90, z], [90, -90, z], [90, 90, z], [-90, 90, z]], float)
        walls[name] = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)
        walls[name].metadata["material"] = GOLD
    scene = snapshot(trimesh.creation.icosphere(3, 0.5), **walls)
    settings = {**SETTINGS, "resolution": 8, "texels": 16, "order": order, "ground": False}
    asset = depth_maps.bake(job(scene, settings, paint=lambda position, owner: np.ones((len(position), 3))))
    direction = unit(np.c_[rng.normal(size=(500, 2)), np.full(500, -1.5)])
    found = answer(asset, Rays((0.5 * direction).astype("f"), direction.astype("f")))
    once = mirror_reflectance(GOLD, -direction[:, 2:])
    np.testing.assert_allclose(found.radiance, once ** (order - 1), rtol=tolerances.FLAT_MIRROR)


def test_the_position_is_the_first_mirrors(work, asset, rng):
    rays = from_the_crease(rng, 4000, 0.6)
    orders = [answer(replace(asset, options={**asset.options, "order": order}), rays).position for order in (2, 3, 4)]
    assert np.array_equal(orders[0], orders[1]) and np.array_equal(orders[1], orders[2])


def test_only_mirrors_that_may_meet_mirrors_pay():
    convex = snapshot(trimesh.creation.icosphere(3), Thing=trimesh.creation.icosphere(3, 0.4).apply_translation([0, 2, 0]))
    small = {**SETTINGS, "texels": 32, "resolution": 8}
    plain = depth_maps.bake(job(convex, small))
    assert not plain.options["starts"] and "mirror_depth_buf" not in plain.images
    one = snapshot(trimesh.creation.icosphere(3), Thing=smooth_mirror(trimesh.creation.icosphere(3, 0.4).apply_translation([0, 2, 0])))
    shown = depth_maps.bake(job(one, small))
    assert (shown.options["order"], shown.options["starts"]) == (2, False)
    assert not shown.images["billboard_buf"][:, ROW["limits"], 2].any()
    text = emit_glsl(record(depth_maps.trace, shown), ("radiance",)).source
    assert "one_step" not in text


@pytest.mark.parametrize("settings, words", [({"self_detail": 3}, "self_detail"), ({"order": 1}, "order")])
def test_impossible_settings_are_refused(settings, words):
    with pytest.raises(ReflectError, match=words):
        depth_maps.bake(job(grown_together(), {**SETTINGS, **settings}))


