"""core/second_order.py: mirrors seen in mirrors, against Embree and closed forms; what they cost; what is a mirror at all."""

from dataclasses import replace

import numpy as np
import pytest
import tolerances
import trimesh
from analytic import directions, unit
from mesh_scenes import MATTE, MIRROR, job, mirror_reflectance, smooth_mirror, snapshot

from reflect_addon.core import mirrors, spaces
from reflect_addon.core.kernel import Counts, counted, emit_glsl, record, run_numpy
from reflect_addon.core.methods import billboards, depth_maps
from reflect_addon.core.rays import Rays
from reflect_addon.core.snapshot import Material, SceneSnapshot

SETTINGS = {"resolution": 128, "samples": 1, "texels": 128, "sky_error": 0}
LACQUER = Material("lacquer", roughness=0.0, ior=1.5, is_reflector=True)


def ball(at=(0.0, 0.0, 0.0), radius=0.5, material=MIRROR) -> trimesh.Trimesh:
    return smooth_mirror(trimesh.creation.icosphere(4, radius).apply_translation(at), material)


def sheet(width, height, at=(0.0, 0.0, 0.0), material=MATTE) -> trimesh.Trimesh:
    """A rectangle that faces +Z and -Z."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [width / 2, height / 2, 0] + at
    shape = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)
    shape.metadata["material"] = material
    return shape


def floor_and_sky(scene: SceneSnapshot, name="Floor"):
    """paint: tiles on the floor, under a sky that differs in all directions."""
    index = [i.name for i in scene.instances].index(name)
    # Tiles follow the floor's size, so that scaled scenes look the same.
    low, high = scene.bounds([scene.instances[index]])
    tile = np.max(high - low) / 9

    def paint(position, owner):
        sky = 0.6 + 0.3 * unit(position)
        odd = (np.floor(position[:, 0] / tile) + np.floor(position[:, 1] / tile)) % 2
        return np.where((owner == index)[:, None], 0.1 + odd[:, None] * [1.0, 0.5, 0.2], sky)

    return paint


def answer(asset, rays, trace=billboards.trace, counts=None):
    return run_numpy(record(trace, asset), asset, rays, counts=counts)


def from_the_ball(rng, count, radius=0.5, toward=(1.0, 0.0, 0.0)) -> Rays:
    """Rays from the side of a ball at the origin that looks `toward`, at up to 64 degrees from its normals."""
    normal = unit(0.6 * directions(rng, count) + np.asarray(toward))
    direction = unit(normal + 0.9 * rng.permutation(directions(rng, count)))
    return Rays((1.001 * radius * normal).astype("f"), direction.astype("f"))


def first_order(scene: SceneSnapshot) -> SceneSnapshot:
    """The same scene, its other mirrors marked as none: they show what was captured."""
    return replace(scene, instances=tuple(replace(i, is_reflector=i.name == "Mirror") for i in scene.instances))


def rmse(a, b) -> float:
    return float(np.sqrt(np.mean((a - b) ** 2)))


@pytest.mark.parametrize("gap", [1.3, 2.0, 3.0])
def test_a_ball_seen_in_a_ball(rng, gap):
    """Nearly exact where it is second order; what it mirrors of the first ball is third order, and looked through."""
    scene = snapshot(ball(), Ball=ball((gap, 0.1, 0.0)), Floor=sheet(9, 9, (0, 0, -0.5)))
    paint = floor_and_sky(scene)
    works = [job(s, SETTINGS, paint=paint) for s in (scene, first_order(scene))]
    assets = [billboards.bake(work) for work in works]
    assert [(a.options["count"], a.options["mirrors"]) for a in assets] == [(1, 1), (2, 0)]
    rays = from_the_ball(rng, 20_000)
    truth = works[0].trace(rays)
    of_ball = truth.object == 1
    assert of_ball.sum() > 200
    second, first = (answer(asset, rays).radiance for asset in assets)
    error, before = rmse(second[of_ball], truth.radiance[of_ball]), rmse(first[of_ball], truth.radiance[of_ball])
    assert error < tolerances.SECOND_ORDER_RMSE * before
    middle, was = (np.median(np.abs(x - truth.radiance)[of_ball]) for x in (second, first))
    assert middle < tolerances.SECOND_ORDER_MEDIAN * was
    np.testing.assert_array_equal(second[truth.object == 2].shape, first[truth.object == 2].shape)
    rest = ~of_ball
    assert rmse(second[rest], truth.radiance[rest]) < 1.02 * rmse(first[rest], truth.radiance[rest]), "the rest is as it was"


def test_the_position_is_the_first_hit(rng):
    """Of the mirror itself, on its surface: the place that the eye looks at."""
    scene = snapshot(ball(), Ball=ball((2.0, 0.1, 0.0)), Floor=sheet(9, 9, (0, 0, -0.5)))
    work = job(scene, SETTINGS, paint=floor_and_sky(scene))
    rays = from_the_ball(rng, 20_000)
    truth, found = work.trace(rays), answer(billboards.bake(work), rays)
    steps = answer(billboards.bake(work), rays, counted(billboards.trace)).radiance[:, 0]
    both = (truth.object == 1) & (steps == 3)
    assert both.sum() > 200 and np.all(found.status[both] == spaces.STATUS_HIT)
    away = np.linalg.norm(found.position[both] - truth.position[both], axis=1)
    assert np.median(away) < 1e-3 and np.percentile(away, 90) < 0.05


@pytest.mark.parametrize("material", [MIRROR, replace(MIRROR, base_color=(1.0, 0.6, 0.3)), LACQUER])
def test_a_flat_mirror_is_exact(rng, material):
    """A wall behind a ball mirrors a picture: the picture's own colours, mirrored, times the reflectance of the wall."""
    wall = sheet(6, 6, (0, 0, -2.0), material)
    picture = sheet(4, 4, (0.5, 0.2, 2.0))
    scene = snapshot(ball(), Wall=wall, Picture=picture)
    on_wall, seen = np.array([0.3, 0.2, 0.1]), np.array([1.0, 0.7, 0.4])

    def paint(position, owner):
        steep = seen * (1 + 0.1 * position[:, :1])
        return np.select([(owner == 1)[:, None], (owner == 2)[:, None]], [on_wall, steep], 0.25)

    work = job(scene, SETTINGS, paint=paint)
    asset = billboards.bake(work)
    assert (asset.options["count"], asset.options["mirrors"], asset.options["relief"]) == (1, 1, False)
    rays = from_the_ball(rng, 20_000, toward=(0.0, 0.0, -1.0))
    found = answer(asset, rays)
    d, o = rays.direction.astype(np.float64), rays.origin.astype(np.float64)
    down = d[:, 2] < -0.05
    t = (-2 - o[:, 2]) / np.where(down, d[:, 2], 1)
    at = o + t[:, None] * d
    hit = down & (np.abs(at[:, :2]) < 2.99).all(1)
    up = at + d * [1, 1, -1] * (4 / np.abs(d[:, 2:]))
    inside = np.abs(up[:, :2] - [0.5, 0.2]).max(1)
    reflected = mirror_reflectance(material, np.abs(d[:, 2:]))
    kept = (1 - material.metallic) * (1 - reflected.max(1, keepdims=True))
    for mask, arriving in ((hit & (inside < 1.95), seen * (1 + 0.1 * up[:, :1])), (hit & (inside > 2.05), 0.25)):
        assert mask.sum() > 300
        wanted = kept * on_wall + reflected * arriving
        np.testing.assert_allclose(found.radiance[mask], wanted[mask], rtol=tolerances.FLAT_MIRROR, atol=1e-3)
        np.testing.assert_allclose(found.position[mask], at[mask], atol=1e-4)


def three_one(count_diffuse: int, count_mirrors: int) -> SceneSnapshot:
    """The reflector among `count_mirrors` - 1 other balls, with `count_diffuse` matte things."""
    things = {}
    for i in range(count_mirrors - 1):
        angle = 2 * np.pi * i / max(count_mirrors - 1, 1)
        things[f"Ball {i}"] = ball((2.5 * np.cos(angle), 2.5 * np.sin(angle), 0.0))
    for i in range(count_diffuse):
        things[f"Thing {i}"] = sheet(9, 9, (0, 0, -0.6)) if i == 0 else trimesh.creation.icosphere(3, 0.3).apply_translation((0, 1.5, 1))
    return snapshot(ball(), **things)


@pytest.mark.parametrize("diffuse, reflective, paper", [(2, 2, 5), (1, 4, 5), pytest.param(1, 9, 10, marks=pytest.mark.slow)])
def test_it_costs_what_the_paper_says(rng, diffuse, reflective, paper):
    """Section 3.1: 2 D + R - 1 intersections; Figs 4, 1 and 5. Counted by the kernel, ray by ray and in total. Fig. 5 is slow here; its count is
    pinned by eval/test_bench_mirrors.py too."""
    scene = three_one(diffuse, reflective)
    asset = billboards.bake(job(scene, {**SETTINGS, "texels": 16, "resolution": 8}))
    assert (asset.options["count"], asset.options["mirrors"]) == (diffuse, reflective - 1)
    rays = Rays(*(np.concatenate(part) for part in zip(*(
        (r.origin, r.direction) for r in (from_the_ball(rng, 1000, toward=(np.cos(a), np.sin(a), 0)) for a in np.arange(0, 6.28, 0.4))
    ), strict=True)))  # fmt: skip
    steps = answer(asset, rays, counted(billboards.trace)).radiance[:, 0]
    once, twice = diffuse + reflective - 1, 2 * diffuse + reflective - 1
    assert set(np.unique(steps)) == {once, twice} and twice == paper
    mirrored = steps == twice
    assert 50 < mirrored.sum() < 0.6 * len(rays)
    for some, each in ((mirrored, twice), (~mirrored, once)):
        counts = Counts()
        answer(asset, Rays(rays.origin[some], rays.direction[some]), counts=counts)
        assert counts.steps == each * some.sum()
    # Whose first hit is reflective, said by the quads themselves.
    assert np.all(answer(asset, Rays(rays.origin[mirrored], rays.direction[mirrored])).status == spaces.STATUS_HIT)


@pytest.mark.parametrize("reflectors, paper", [(2, 2), (4, 12), (9, 72)])
def test_how_many_second_order_reflections(reflectors, paper):
    pairs = mirrors.second_order_pairs(three_one(1, reflectors))
    assert len(pairs) == len(set(pairs)) == reflectors * (reflectors - 1) == paper
    assert all(a != b for a, b in pairs)


def test_no_other_mirror_no_second_loop():
    scene = snapshot(ball(), Ball=ball((2, 0, 0), material=MATTE), Floor=sheet(9, 9, (0, 0, -0.5)))
    asset = billboards.bake(job(scene, {**SETTINGS, "texels": 16, "resolution": 8}))
    text = emit_glsl(record(billboards.trace, asset), ("radiance", "position")).source
    assert asset.options == {"count": 2, "mirrors": 0, "glossy": 0, "lamps": 0, "contours": True, "ground": False}
    assert "normal_tx" not in asset.images
    assert text.count("float facing") == 1 and "tertiary" not in text
    one = snapshot(ball(), Ball=ball((2, 0, 0)), Floor=sheet(9, 9, (0, 0, -0.5)))
    asset = billboards.bake(job(one, {**SETTINGS, "texels": 16, "resolution": 8}))
    text = emit_glsl(record(billboards.trace, asset), ("radiance", "position")).source
    assert text.count("float facing") == 2 and "normal_tx" in asset.images
    # The environment's look-up stands in the code once, for the ray and its tertiary ray.
    assert text.count("cube_face =") == 1


def test_only_mirrors_no_loop_for_the_tertiary_ray(rng):
    asset = billboards.bake(job(snapshot(ball(), Ball=ball((2, 0, 0))), {**SETTINGS, "texels": 32, "resolution": 8}))
    assert (asset.options["count"], asset.options["mirrors"]) == (0, 1)
    assert emit_glsl(record(billboards.trace, asset), ("radiance",)).source.count("float facing") == 1
    assert np.isfinite(answer(asset, from_the_ball(rng, 2000)).radiance).all()


MARKED = {
    "shiny": (MIRROR, True, 1),
    "marked as none": (MIRROR, False, 0),
    "marked by hand, dull": (MATTE, True, 0),
    "rough": (replace(MIRROR, roughness=0.3), True, 0),
    "satin": (replace(MIRROR, roughness=0.15), True, 1),
    "black metal": (replace(MIRROR, base_color=(0.0, 0.0, 0.0)), True, 1),
    "lacquer": (LACQUER, True, 1),
    "index of refraction 1": (replace(LACQUER, ior=1.0), True, 1),
}


@pytest.mark.parametrize("case", MARKED)
def test_what_is_a_mirror_to_others(rng, case):
    material, marked, rows = MARKED[case]
    scene = snapshot(ball(), Ball=ball((2, 0, 0), material=material), Floor=sheet(9, 9, (0, 0, -0.5)))
    scene = replace(scene, instances=tuple(replace(i, is_reflector=marked) if i.name == "Ball" else i for i in scene.instances))
    asset = billboards.bake(job(scene, {**SETTINGS, "texels": 32, "resolution": 8}))
    assert (asset.options["count"], asset.options["mirrors"]) == (2 - rows, rows)
    found = answer(asset, from_the_ball(rng, 3000))
    assert np.isfinite(found.radiance).all() and np.isfinite(found.position).all() and found.radiance.min() >= 0


def test_a_black_metal_is_black_but_at_grazing(rng):
    black = replace(MIRROR, base_color=(0.0, 0.0, 0.0))
    scene = snapshot(ball(), Ball=ball((2.0, 0, 0), material=black), Floor=sheet(9, 9, (0, 0, -0.5)))
    work = job(scene, SETTINGS, paint=floor_and_sky(scene))
    rays = from_the_ball(rng, 20_000)
    truth, found = work.trace(rays), answer(billboards.bake(work), rays)
    steep = (truth.object == 1) & (-(truth.normal * rays.direction).sum(1) > 0.8)
    assert steep.sum() > 50 and np.median(found.radiance[steep]) < 1e-3


def test_the_matte_part_of_a_mirror_keeps_its_picture(rng):
    """Half gold, half painted: the painted half shows paint, and no mirror in it."""
    half = ball((2.0, 0, 0), material=(MIRROR, MATTE))
    half.metadata["faces"] = half.triangles_center[:, 2] < 0
    scene = snapshot(ball(), Half=half, Floor=sheet(9, 9, (0, 0, -0.5)))
    red = np.array([0.9, 0.1, 0.05])
    paint = floor_and_sky(scene)
    work = job(scene, SETTINGS, paint=lambda p, owner: np.where((owner == 1)[:, None], red, paint(p, owner)))
    asset = billboards.bake(work)
    assert asset.options["partly"]
    rays = from_the_ball(rng, 20_000)
    truth, found = work.trace(rays), answer(asset, rays)
    clear = (truth.object == 1) & (np.abs(truth.position[:, 2]) > 0.05)
    below = clear & (truth.position[:, 2] < 0)
    assert below.sum() > 50 and (clear & ~below).sum() > 50
    np.testing.assert_allclose(np.median(found.radiance[below], axis=0), red, rtol=2e-3)
    assert np.median(np.abs(found.radiance - truth.radiance)[clear & ~below]) < 0.02


def test_a_room_of_mirrors_stays_in_the_environment_map(rng):
    """What mirrors show of mirrors is looked up there; without the room they would see through its walls."""
    room = trimesh.creation.box((4, 5, 3))
    room.metadata["material"] = MIRROR
    scene = snapshot(ball(), Room=room, Lamp=trimesh.creation.icosphere(3, 0.3).apply_translation([1, 1, 0.8]))
    made = []
    work = job(scene, {**SETTINGS, "texels": 32, "resolution": 16}, made=made)
    quads, hidden = billboards.quads_for(work)
    assert hidden == ("Lamp",) and len(quads) == 7
    asset = billboards.bake(work)
    assert (asset.options["count"], asset.options["mirrors"]) == (1, 6)
    found = answer(asset, from_the_ball(rng, 3000))
    assert np.all(found.status == spaces.STATUS_HIT) and np.isfinite(found.radiance).all()


def test_a_mirror_that_is_part_of_a_room_hides_with_it():
    """A shiny floor in a matte room: five lit walls, one mirror, and no room in the map."""
    room = trimesh.creation.box((4, 5, 3))
    room.metadata.update(material=(MATTE, LACQUER), faces=room.triangles_center[:, 2] < -1.4)
    work = job(snapshot(ball(), Room=room), {**SETTINGS, "texels": 16, "resolution": 8})
    asset = billboards.bake(work)
    assert billboards.quads_for(work)[1] == ("Room",)
    assert (asset.options["count"], asset.options["mirrors"]) == (5, 1)


def test_duplis_of_the_reflectors_own_object_are_seen(rng):
    """They are hidden with it wherever the reflector is, so they stand as quads and are captured in a bundle of their own."""
    scene = snapshot(ball(), Other=ball((2, 0, 0)), Third=ball((-2, 0, 0)), Floor=sheet(9, 9, (0, 0, -0.5)))
    names = {"Mirror": "Dup/1", "Other": "Dup/2", "Third": "Dup/3", "Floor": "Floor"}
    scene = replace(
        scene,
        instances=tuple(
            replace(i, name=names[i.name], object_name="Dup" if i.name != "Floor" else "Floor") for i in scene.instances
        ),
    )
    made = []
    work = job(scene, {**SETTINGS, "texels": 32, "resolution": 8}, paint=floor_and_sky(scene), made=made)
    asset = billboards.bake(work)
    assert (asset.options["count"], asset.options["mirrors"]) == (1, 2)
    assert [hide for _, hide in made] == [("Dup", "Floor"), ("Dup",), (), ()], "map, the floor, the siblings, what they mirror"
    assert len(mirrors.second_order_pairs(scene)) == 6
    rays = from_the_ball(rng, 5000)
    truth, found = work.trace(rays), answer(asset, rays)
    of_sibling = truth.object == 1
    assert np.mean(found.status[of_sibling] == spaces.STATUS_HIT) > 0.9


@pytest.mark.parametrize("scale", [1e-4, 1e-2, 1e5])
def test_any_scale(rng, scale):
    """The same picture at every scale, and nothing that is not finite: null rays, grazing ones, wide footprints."""
    pictures = []
    for size in (1.0, scale):
        shapes = {"Ball": ball((2.0, 0.1, 0.0)), "Floor": sheet(9, 9, (0, 0, -0.5))}
        scene = snapshot(ball().apply_scale(size), **{name: shape.apply_scale(size) for name, shape in shapes.items()})
        asset = billboards.bake(job(scene, {**SETTINGS, "texels": 64, "resolution": 32}, paint=floor_and_sky(scene)))
        rays = from_the_ball(np.random.default_rng(3), 5000)
        direction = rays.direction.copy()
        direction[:5] = 0
        rays = Rays((rays.origin * np.float32(size)), direction)
        program = record(billboards.trace, asset)
        found = run_numpy(program, asset, rays)
        wide = run_numpy(program, asset, rays, 0.3 * size, 2.0)
        for a in (found, wide):
            assert all(np.isfinite(x).all() for x in (a.radiance, a.position, a.status))
        pictures.append(found.radiance)
    close = np.isclose(*pictures, rtol=1e-2, atol=1e-3).all(1)
    assert close.mean() > 0.98


def test_a_footprint_grows_at_a_curved_mirror(rng):
    """Fine stripes on the floor, seen by way of a ball: a wide footprint sees their mean, a narrow one sees stripes."""
    scene = snapshot(ball(), Ball=ball((2.0, 0.1, 0.0)), Floor=sheet(9, 9, (0, 0, -0.5)))

    def stripes(position, owner):
        odd = np.floor(position[:, :1] * 6) % 2
        return np.where((owner == 2)[:, None], odd * np.ones(3), 0.5)

    asset = billboards.bake(job(scene, SETTINGS, paint=stripes))
    rays = from_the_ball(rng, 20_000)
    program = record(billboards.trace, asset)
    mirrored = answer(asset, rays, counted(billboards.trace)).radiance[:, 0] == 3
    rays = Rays(rays.origin[mirrored], rays.direction[mirrored])
    spread = [run_numpy(program, asset, rays, width, 0.0).radiance.std() for width in (0.0, 0.02, 0.1)]
    assert spread[0] > spread[1] > spread[2] and spread[2] < 0.75 * spread[0]


@pytest.mark.parametrize("method", [billboards, depth_maps])
def test_what_faces_only_a_mirror_is_seen_in_it(rng, method):
    """A sheet looks at a mirror ball: in it it sees itself and the side of a block that is turned away from it."""
    others = {"Other": ball((0, 0, 2.5), 1.0), "Block": trimesh.creation.box((0.8, 0.8, 0.4)).apply_translation([0.8, 0, 0.8])}
    scene = snapshot(sheet(4, 4, material=MATTE), **others)
    names = [i.name for i in scene.instances]
    colours = np.array([{"Mirror": [1, 0.1, 0.1], "Block": [0.1, 1, 0.1]}.get(name, [0, 0, 0]) for name in names] + [[0, 0, 0]], float)
    settings = {**method.DEFAULTS, **SETTINGS, "order": 2}
    work = job(scene, settings, paint=lambda position, owner: colours[owner])
    at = np.c_[rng.uniform(-1.5, 1.5, (6000, 2)), np.full(6000, 1e-3)]
    rays = Rays(at.astype("f"), unit([0, 0, 2.5] + 0.9 * directions(rng, 6000) - at).astype("f"))
    truth, found = work.trace(rays), answer(method.bake(work), rays, method.trace)
    for of in range(2):
        seen = (truth.object == names.index("Other")) & (truth.radiance.argmax(1) == of) & (truth.radiance.max(1) > 0.5)
        assert seen.sum() > 100
        assert np.median(np.abs(found.radiance - truth.radiance)[seen].max(1)) < 0.05
    matte = job(snapshot(sheet(4, 4, material=MATTE), **{**others, "Other": ball((0, 0, 2.5), 1.0, MATTE)}), settings)
    assert {q.instance for q in billboards.with_backdrop(matte, "billboards")[0]} == {"Other", "Block"}, "nothing goes on, nothing more is baked"
    assert sum(q.instance == "Block" for q in billboards.quads_for(work)[0]) > sum(q.instance == "Block" for q in billboards.quads_for(matte)[0])


@pytest.mark.parametrize("method", [billboards, depth_maps])
def test_a_ray_meets_neither_side_of_the_sheet_that_it_starts_on(rng, method):
    """A sheet shows a mirror ball, so that it has quads of its own, one for each side; a shader's rays start on it but for roundings, above and below."""
    turn = trimesh.transformations.rotation_matrix(0.4, [1, 0.3, 0])
    scene = snapshot(sheet(4, 4, material=MIRROR).apply_transform(turn), Other=ball((0, 0, 2.5), 0.6))
    asset = method.bake(job(scene, {**method.DEFAULTS, **SETTINGS, "texels": 32, "resolution": 32, "order": 2}, paint=floor_and_sky(scene, "Other")))
    assert sum(part.instance == "Mirror" for part in asset.parts) == 3, "the reflector, and both sides"
    at = np.c_[rng.uniform(-1.5, 1.5, (4000, 2)), np.zeros(4000)] @ turn[:3, :3].T
    normal = turn[:3, 2]
    direction = unit(normal + 0.9 * directions(rng, 4000)).astype("f")
    clear = answer(asset, Rays((at + 1e-3 * normal).astype("f"), direction), method.trace)
    for side in (-1.0, 1.0):
        rounded = answer(asset, Rays((at + side * 1e-6 * normal).astype("f"), direction), method.trace)
        way = rounded.position - at
        assert np.linalg.norm(way, axis=1).min() > 0.1 and (way @ normal > 0).all()
        assert np.median(np.abs(rounded.radiance - clear.radiance).max(1)) < 0.01
