"""core/ground_fit.py and ground_map.py: which scenes have a ground, where its box ends, what is left out, and that it helps."""

from dataclasses import replace

import numpy as np
import pytest
import tolerances
import trimesh
from analytic import unit
from mesh_scenes import job, snapshot, tracer

from reflect_addon.core import billboard_atlas, ground_fit, ground_map, methods, metrics
from reflect_addon.core.billboard_capture import capture
from reflect_addon.core.errors import ReflectError
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.methods import billboards, environment
from reflect_addon.core.rays import Rays

SETTINGS = {**billboards.DEFAULTS, "resolution": 64, "samples": 1, "texels": 64, "sky_error": 0}
RADIUS = 0.2


def sheet(half: float, z=0.0) -> trimesh.Trimesh:
    corners = [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]]
    return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)


def terrain(half=150.0, flat=6.0, hills=2.0, bumps=0.002, n=120) -> trimesh.Trimesh:
    """Flat but for bumps within `flat` m of the middle, hills and valleys beyond; finer towards the middle."""
    g = np.sinh(np.linspace(-6, 6, n)) / np.sinh(6) * half
    x, y = np.meshgrid(g, g)
    z = np.clip((np.hypot(x, y) - flat) / 20, 0, 1) * hills * np.sin(x / 7) * np.cos(y / 9)
    z = z + bumps * np.sin(13 * x) * np.sin(11 * y)
    i = np.arange(n * n).reshape(n, n)
    squares = i[:-1, :-1], i[:-1, 1:], i[1:, 1:], i[1:, :-1]
    faces = np.concatenate([np.stack([squares[k] for k in three], -1).reshape(-1, 3) for three in ((0, 1, 2), (0, 2, 3))])
    return trimesh.Trimesh(np.stack([x, y, z], -1).reshape(-1, 3), faces, process=False)


def box(size, at) -> trimesh.Trimesh:
    return trimesh.creation.box(size).apply_translation(at)


def ball(at=(0, 0, RADIUS)) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(3, RADIUS).apply_translation(at)


def crate() -> trimesh.Trimesh:
    return box((0.3, 0.3, 0.4), [0.8, 0.3, 0.2])


def tiles(count: int, size: float) -> dict:
    steps = [(i, j) for i in range(-count, count + 1) for j in range(-count, count + 1)]
    return {f"Tile {i} {j}": box((size, size, 0.1), [size * i, size * j, -0.05]) for i, j in steps}


def found(scene, **settings):
    work = job(scene, {**SETTINGS, **settings})
    quads, hidden = billboards.quads_for(work)
    return work, quads, hidden, ground_fit.find(work, quads, hidden, work.center())


GROUNDS = {
    "a plane": lambda: {"Ground": sheet(250), "Crate": crate()},
    "a slab": lambda: {"Ground": box((500, 500, 0.1), [0, 0, -0.05]), "Crate": crate()},
    "a terrain": lambda: {"Ground": terrain(), "Crate": crate()},
    "tiles": lambda: tiles(3, 40.0),
    "under a table": lambda: {"Table": box((2, 1, 0.05), [0, 0, -0.025]), "Ground": sheet(250, -0.8)},
    "on a slope": lambda: {"Ground": sheet(250).apply_transform(trimesh.transformations.rotation_matrix(0.1, [1, 0.3, 0]))},
}


@pytest.mark.parametrize("name", GROUNDS)
@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e5])
def test_a_ground_that_goes_on_is_found(name, scale):
    shapes = {key: shape.apply_scale(scale) for key, shape in GROUNDS[name]().items()}
    height = RADIUS + (0.8 if name == "under a table" else 0.02 if name == "on a slope" else 0.0)
    middle = ball((0, 0, RADIUS + 0.02 if name == "on a slope" else RADIUS)).apply_scale(scale)
    work, quads, hidden, ground = found(snapshot(middle, **shapes))
    assert ground is not None
    assert abs(-ground.low[2] / scale - height) < 0.01 * height
    radius = RADIUS * np.sqrt(3) * scale
    if name != "a terrain":
        # Where parallax is ANGLE, as near as the steps of the search.
        reach = radius / ground_fit.ANGLE
        for side in (*-ground.low[:2], *ground.high):
            assert reach / 1.2 < side <= reach * (1 + tolerances.FLOAT32)
    else:
        assert 2 * scale < min(*-ground.low[:2], *ground.high) and max(*-ground.low[:2], *ground.high) < 12 * scale
    left, gone = ground_map.in_the_map(work, ground, quads, hidden)
    assert {q.instance for q in left} == {q.instance for q in quads} - set(ground.members), "only the ground's quads go"
    assert set(gone) == set(hidden) - set(ground.members)


@pytest.mark.parametrize(
    "shapes",
    [
        {"Table": box((2, 1, 0.05), [0, 0, -0.025])},
        {"Ground": sheet(2), "Crate": crate()},
        {"Ground": sheet(40)},
        {"Room": box((6, 5, 3), [0, 0, 1.5]), "Crate": crate()},
        {"Floor": sheet(3), **{f"Wall {i}": box((6, 0.1, 3), [0, 3, 1.5]).apply_transform(
            trimesh.transformations.rotation_matrix(i * np.pi / 2, [0, 0, 1])) for i in range(4)}},
        {"Rotunda": trimesh.creation.cylinder(3.0, 4.0, sections=200).apply_translation([0, 0, 2])},
        {"Table and floor": trimesh.util.concatenate([box((2, 1, 0.05), [0, 0, -0.025]), sheet(2, -0.8)])},
        {"Pole": box((0.1, 0.1, 200), [0, 0, -100])},
        {"Wall": box((500, 0.1, 500), [0, 1, 0])},
        {"Above": sheet(250, 1.0)},
        {},
    ],
    ids=["table", "floor", "large floor", "room", "walls", "rotunda", "one mesh", "pole", "wall", "ceiling", "nothing"],
)  # fmt: skip
def test_what_ends_is_no_ground(shapes):
    assert found(snapshot(ball(), **shapes))[3] is None


def test_the_morph_turns_no_ray_by_more_than_the_angle(rng):
    """Automatic size and H on a plane: on the walls the blend is within ANGLE of both rays it is made of."""
    work, _, _, ground = found(snapshot(ball(), Ground=sheet(250)))
    low, high = ground.low[:2], ground.high
    assert ground.height == pytest.approx(2 * RADIUS, rel=1e-3), "the reflector's own height above the ground"
    start = RADIUS * unit(rng.normal(size=(20_000, 3)))
    d = unit(np.c_[rng.normal(size=(20_000, 2)), rng.normal(size=20_000) * 0.005])
    with np.errstate(divide="ignore"):
        t = np.minimum(*(np.where(d[:, a] > 0, high[a] - start[:, a], low[a] - start[:, a]) / d[:, a] for a in (0, 1)))
    met = start + t[:, None] * d
    share = (met[:, 2] - ground.low[2]) / ground.height
    wall = (share >= 0) & (share <= 1)
    assert wall.sum() > 500
    blend = unit(met * (1 - share[:, None]) + d * (share * t)[:, None])[wall]
    for ray in (unit(met), d):
        assert np.linalg.norm(blend - ray[wall], axis=1).max() < ground_fit.ANGLE


def test_settings_say_how_large():
    scene = snapshot(ball(), Ground=sheet(250))
    ground = found(scene, ground_size=8.0, ground_morph=1.5)[3]
    np.testing.assert_allclose([*ground.low[:2], *ground.high, ground.height], [-4, -4, 4, 4, 1.5])
    assert found(scene, ground_size=0.1)[3] is None, "smaller than the reflector"
    assert found(snapshot(ball(), Ground=sheet(40)), ground_size=8.0)[3] is not None, "one that ends too early by itself"
    assert found(snapshot(ball(), Ground=sheet(3)), ground_size=8.0)[3] is None, "no ground where the walls would stand"


@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf"), "2", None, True])
def test_a_length_is_a_number_from_nought(value):
    methods.check_settings(("billboards",), {"ground_size": 3, "ground_height": 0.25})
    with pytest.raises(ReflectError, match="ground_size cannot be"):
        methods.check_settings(("billboards",), {"ground_size": value})


def test_the_worlds_own_ground_is_there_on_request():
    scene = snapshot(ball(), Crate=crate())
    assert found(scene)[3] is None
    ground = found(scene, ground_height=0.2)[3]
    assert ground.members == () and ground.low[2] == -0.2 and not ground.options()["ground_seen"]
    both = found(snapshot(ball(), Ground=sheet(250)), ground_height=1.0)[3]
    assert both.members == ("Ground",), "a ground that is there is measured, not asked for"


def test_a_stone_in_the_map_ends_the_box():
    """Something that has no stand-in and stands on the ground would be painted onto it."""
    scene = snapshot(ball(), Ground=sheet(250), Stone=box((0.6, 0.6, 1.0), [4.0, 0, 0.5]))
    work = job(scene, SETTINGS)
    quads, hidden = billboards.quads_for(work)
    ground = ground_fit.find(work, [q for q in quads if q.instance != "Stone"], tuple(h for h in hidden if h != "Stone"), work.center())
    assert 2.5 < ground.high[0] < 3.7 and ground.low[0] < -3


def test_a_quad_where_its_texels_are_finer():
    """Measured on reflected rays: a coarse map gets a quad near the reflector, a fine one does not."""
    work, quads, hidden, ground = found(snapshot(ball(), Ground=sheet(250)))
    assert ground_map.finer_quad(work, ground, 512) is None
    finer = ground_map.finer_quad(replace(work, settings={**SETTINGS, "texels": 1024}), ground, 32)
    assert finer is not None and RADIUS < finer.half_u < 32 * RADIUS
    asset = billboards.bake(replace(work, settings={**SETTINGS, "texels": 256, "resolution": 8}))
    assert asset.options["count"] == 1 and asset.options["ground"]


def test_what_stands_on_the_ground_leaves_no_mark_in_the_map():
    """A crate is hidden from the map; the ground inside it, which no light reaches, gets the radiance around it."""
    scene = snapshot(ball(), Ground=sheet(250), Crate=crate())

    def paint(position, owner):
        under = np.all(np.abs(position[:, :2] - [0.8, 0.3]) < 0.15, axis=1) & (np.abs(position[:, 2]) < 0.05)
        return np.where(under, 0.0, 1.0)[:, None] * np.ones(3)

    work = job(scene, SETTINGS, paint=paint)
    asset = billboards.bake(work)
    n = SETTINGS["resolution"]
    assert asset.options["ground"] and {q for q in asset.images} == {"radiance_tx", "billboard_tx", "billboard_buf"}
    assert asset.images["radiance_tx"][: n + 2, ..., 0].min() == 1.0
    raw = environment.capture(work, "environment", hide=("Mirror", "Crate"))
    assert (raw.images["radiance_tx"][: n + 2, ..., 0] == 0).sum() > 20, "or there was nothing to mend"


def checks(position, owner):
    """A chequered ground, 0.25 m; everything else in its own colour."""
    check = (np.floor(position[:, 0] / 0.25) + np.floor(position[:, 1] / 0.25)) % 2
    # Far away checks are finer than any texel.
    near = np.exp(-np.linalg.norm(position, axis=1) / 2)
    ground = 0.5 + (check - 0.5) * near
    sky = 1.5 + unit(position)[:, 2]
    return np.where(owner == 1, ground, np.where(owner < 0, sky, 0.2 * (owner + 1)))[:, None] * np.array([1.0, 0.9, 0.7])


@pytest.mark.parametrize("name", ["a plane", "a terrain"])
def test_it_is_nearer_to_the_truth(rng, name, record_property):
    """Reflected rays of the ball, against Embree: with the box, with a small quad instead, and with the map alone."""
    scene = snapshot(ball(), **GROUNDS[name]())
    settings = {**SETTINGS, "resolution": 128, "texels": 128}
    work = job(scene, settings, paint=checks)
    _, _, hidden, ground = found(scene)
    boxed = billboards.bake(work)
    quad = ground_map.square(ground, 8 * RADIUS)
    small = bake_with_quad(work, quad, hidden)
    plain = environment.bake(job(scene, {**settings, "resolution": 128}, paint=checks))
    normal = unit(rng.normal(size=(20_000, 3)))
    view = unit(rng.normal(size=(20_000, 3)))
    view = np.where((view * normal).sum(1, keepdims=True) > 0, -view, view)
    d = view - 2 * (view * normal).sum(1, keepdims=True) * normal
    rays = Rays((normal * RADIUS * 1.001 + [0, 0, RADIUS]).astype("f"), d.astype("f"))
    truth = tracer(scene, checks)(rays, hide=("Mirror",))
    rmse, p50 = {}, {}
    for key, asset, kernel in (("box", boxed, billboards), ("quad", small, billboards), ("map", plain, environment)):
        answer = run_numpy(record(kernel.trace, asset), asset, rays)
        rmse[key] = metrics.rmse(answer.radiance, truth.radiance)
        on_ground = truth.object == 1
        p50[key] = float(np.median(np.linalg.norm(answer.position - truth.position, axis=1)[on_ground]))
    record_property("rmse", rmse)
    record_property("hit_p50", p50)
    print(name, "rmse", rmse, "hit_p50 m", p50, "bytes", {k: a.bytes() for k, a in (("box", boxed), ("quad", small), ("map", plain))})
    assert rmse["box"] < tolerances.GROUND_RMSE * rmse["map"] and rmse["box"] < rmse["quad"]
    assert p50["box"] < tolerances.GROUND_HIT * p50["map"] and p50["box"] <= p50["quad"] * 1.05


def bake_with_quad(work, quad, hidden):
    """Billboards as they were: a quad of the ground near the reflector, the ground hidden only where the quad is."""
    quads, _ = billboards.quads_for(work)
    quads = [q for q in quads if q.instance != "Ground"] + [quad]
    images = [texels.radiance for texels in capture(work, quads)]
    table, placed = billboard_atlas.pack(images)
    backdrop = environment.capture(work, "billboards", hide=("Mirror", *(h for h in hidden if h != "Ground")))
    opaque = [bool(i[..., 3].min() == 1) for i in images]
    rows = billboard_atlas.table_rows(quads, placed, opaque, backdrop.uniforms["center"])
    return replace(
        backdrop, images={**backdrop.images, "billboard_tx": table.astype(np.float16), "billboard_buf": rows},
        uniforms={**backdrop.uniforms, "billboard_scale": 1.0},
        options={"count": len(quads), "mirrors": 0, "glossy": 0, "lamps": 0, "contours": not all(opaque), "ground": False},
    )  # fmt: skip
