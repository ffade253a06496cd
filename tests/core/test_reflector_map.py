"""Reflector maps: what rays from the centre meet, closed beyond rims, side by side in an atlas, looked up with their slopes."""

from types import SimpleNamespace

import analytic_reflectors as shapes
import numpy as np
import pytest
import tolerances
from analytic import unit

from reflect_addon.core import reflector_map
from reflect_addon.core.errors import ReflectError
from reflect_addon.core.kernel import evaluate, record_function
from reflect_addon.core.reflector_map import IMAGES, atlas, build, look
from reflect_addon.evaluation import known_reflectors as known

KINDS = {**shapes.OPEN, **{name: shapes.ROUND[name] for name in ("sphere", "ellipsoid")}}


def looked_up(images, block, direction, dtype=np.float64):
    """Outputs of `look`, (N, ...)."""

    def kernel(k, scope, direction, block):
        here = look(k, scope, block, direction)
        return {name: getattr(here, name) for name in ("point", "normal", "point_x", "point_y", "normal_x", "normal_y", "inside")}

    program = record_function(kernel, {"direction": "vec3", "block": "vec4"}, IMAGES)
    inputs = {"direction": direction, "block": np.tile(block, (len(direction), 1))}
    return evaluate(program, inputs, SimpleNamespace(images=images, uniforms={}), dtype=dtype)


@pytest.mark.parametrize("name", KINDS)
def test_look_ups_err_by_the_square_of_a_texel(rng, name):
    """Across the edges of faces as well as within."""
    direction = unit(rng.normal(size=(4000, 3)))
    edges = direction / np.sort(np.abs(direction), -1)[:, 1:2]
    direction = unit(np.where(rng.random((4000, 1)) < 0.5, direction, np.clip(edges, -1, 1)))
    distance, normal, inside = KINDS[name].surface(direction)
    direction, point, normal = direction[inside], (direction * distance[:, None])[inside], normal[inside]
    clear = KINDS[name].there(point, 6 / 64)
    worst = []
    for side in (64, 128):
        images, blocks = atlas([known.map_of(KINDS[name], side)])
        here = looked_up(images, (*blocks[0], 1.0), direction[clear])
        assert (here["inside"] == 1).all()
        worst.append([np.abs(here[key] - want[clear]).max() for key, want in (("point", point), ("normal", normal))])
    worst = np.array(worst)
    assert (worst[0] <= tolerances.MAP_ERROR).all()
    assert ((worst[1] < worst[0] / 3) | (worst[1] < 1e-6)).all(), "a plane has no error to fall"


def test_slopes_are_differences(rng):
    images, blocks = atlas([known.map_of(shapes.ROUND["ellipsoid"], 32)])
    s, t = rng.uniform(-0.9, 0.9, (2, 500))
    s, t = (np.where(np.abs((x * 16 + 0.5) % 1 - 0.5) < 0.05, x + 0.1 / 16, x) for x in (s, t))
    h = 1e-5
    block = (*blocks[0], -1.0)

    def at(s, t):
        return looked_up(images, block, np.stack([np.ones_like(s), s, t], -1))

    here = at(s, t)
    for key in ("point", "normal"):
        for axis, (ds, dt) in (("x", (h, 0)), ("y", (0, h))):
            difference = (at(s + ds, t + dt)[key] - at(s - ds, t - dt)[key]) / (2 * h) * (2 / 32)
            near = np.abs(difference - here[f"{key}_{axis}"]).max(-1) < 1e-6
            assert near.mean() > 0.99, "but for those whose differences reach across a texel's edge"


def test_atlas_blocks_do_not_touch(rng, monkeypatch):
    """Maps of several sizes, in columns, answer as each does alone."""
    monkeypatch.setattr(reflector_map, "TALLEST", 60)
    maps = [known.map_of(shapes.ROUND[name], side) for name, side in (("sphere", 16), ("ellipsoid", 32), ("ellipsoid 5:1", 8), ("sphere", 50))]
    images, blocks = atlas(maps)
    assert images[IMAGES[0]].shape[0] <= 60 and len({x for x, _, _ in blocks}) > 1
    direction = rng.normal(size=(500, 3))
    for one, block in zip(maps, blocks, strict=True):
        alone, (there,) = atlas([one])
        for key, values in looked_up(images, (*block, 1.0), direction).items():
            np.testing.assert_allclose(values, looked_up(alone, (*there, 1.0), direction)[key], atol=1e-6)


def test_a_plane_goes_on_beyond_its_rim():
    made = known.map_of(shapes.OPEN["plane"], 64)
    closed = made.position[..., 3] == 0
    near = closed & (np.linalg.norm(made.position[..., :3], axis=-1) < 1.8) & (made.position[..., 2] > 0.3)
    assert near.sum() > 1000
    np.testing.assert_allclose(made.position[near, 2], 0.7, atol=1e-4)
    np.testing.assert_allclose(made.normal[near, :3], np.broadcast_to([0, 0, 1], (near.sum(), 3)), atol=1e-5)


@pytest.mark.parametrize("name", KINDS)
def test_closed_maps_are_whole(name):
    """Unit normals, distances neither 0 nor far away, and the piece itself untouched."""
    made = known.map_of(KINDS[name], 32)
    distance = np.linalg.norm(made.position[..., :3], axis=-1)
    assert np.isfinite(made.position).all() and distance.min() > 0.05 and distance.max() < 4
    np.testing.assert_allclose(np.linalg.norm(made.normal[..., :3], axis=-1), 1, atol=1e-5)
    on = made.position[..., 3] == 1
    want, normal, _ = KINDS[name].surface(unit(made.position[on, :3].astype(np.float64)))
    np.testing.assert_allclose(distance[on], want, rtol=1e-5)
    np.testing.assert_allclose(made.normal[on, :3], normal, atol=1e-5)


@pytest.mark.parametrize("distance, inside, size", [(1.0, False, 1.0), (0.0, True, 1.0), (np.nan, True, 1.0), (np.inf, True, 1.0), (1.0, True, 0.0)])
def test_degenerate_surfaces_make_finite_maps(distance, inside, size):
    made = build(np.zeros(3), size, 4, lambda d: (np.full(len(d), distance), d, np.full(len(d), inside)))
    assert made.side == 4 and np.isfinite(made.position).all() and np.isfinite(made.normal).all()
    if size == 0 or distance != 1 or not inside:
        assert (np.linalg.norm(made.position[..., :3], axis=-1) > 0).all() and set(np.unique(made.position[..., 3])) <= {0.0, 1.0}


def test_maps_that_no_image_holds_are_refused(monkeypatch):
    monkeypatch.setattr(reflector_map, "TALLEST", 10)
    monkeypatch.setattr(reflector_map, "MAX_SIDE", 3 * 60)
    one = known.map_of(shapes.ROUND["sphere"], 8)
    assert len(atlas([one] * 3)[1]) == 3
    with pytest.raises(ReflectError, match="Lower Map Texels"):
        atlas([one] * 4)


def band(low, high, tall=0.4):
    """What is between two heights of an ellipsoid, convex and open above and below."""
    whole = known.ellipsoid(1, 1, tall).surface

    def surface(directions):
        distance, normal, inside = whole(directions)
        height = directions[:, 2] * distance
        return distance, normal, inside & (height > low) & (height < high)

    return surface


@pytest.mark.parametrize("low, high", [(-0.2, 0.2), (-0.1, 0.4), (0.0, 0.05)])
def test_what_closes_a_convex_surface_leaves_it_convex(rng, low, high):
    """Points between two of the closed surface are inside of it; the surface itself is as it was."""
    made = build(np.zeros(3), 1.0, 64, band(low, high), convex=True)
    direction = unit(rng.normal(size=(6000, 3)))
    found = looked_up(*_one(made), direction)
    point, inside = found["point"], found["inside"] > 0.5
    assert 0.02 < inside.mean() < 0.98
    middle = (point[:3000] + point[3000:]) / 2
    there = looked_up(*_one(made), unit(middle))["point"]
    assert (np.linalg.norm(middle, axis=1) / np.linalg.norm(there, axis=1)).max() < 1 + 5e-3  # a texel's bend at the rim's corner
    distance, normal, _ = band(-1, 1)(direction)
    own = found["inside"] > 0.999
    assert np.abs(np.linalg.norm(point, axis=1) - distance)[own].max() < 2e-3


def _one(made):
    images, blocks = atlas([made])
    return images, (*blocks[0], 1.0)
