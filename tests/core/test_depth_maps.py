"""core/depth_kernel.py and methods/depth_maps.py: hits against closed forms and Embree; degenerate rays; several maps."""

from dataclasses import replace

import numpy as np
import pytest
import tolerances
import trimesh
from analytic import directions, unit
from mesh_scenes import first_hits, job, snapshot, world_mesh

from reflect_addon.core import billboard_follow, depth_kernel, row_search, spaces, srdm
from reflect_addon.core.billboard_atlas import ROW
from reflect_addon.core.errors import ReflectError
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.methods import depth_maps
from reflect_addon.core.rays import Rays

SMALL = {**depth_maps.DEFAULTS, "resolution": 16, "samples": 1, "texels": 64, "sky_error": 0, "maps": 1}


def ball(radius=1.0, at=(0, 0, 0), detail=3):
    return trimesh.creation.icosphere(detail, radius).apply_translation(at)


def baked(scene, **settings):
    return depth_maps.bake(job(scene, {**SMALL, **settings}))


def answer(asset, rays, dtype=np.float32):
    return run_numpy(record(depth_maps.trace, asset), asset, rays, dtype=dtype)


def rays_at(rng, count, origin, spread, target=(0, 0, 0)):
    """From around `origin` to around `target`."""
    start = np.asarray(origin) + spread * directions(rng, count)
    end = np.asarray(target) + 0.9 * directions(rng, count)
    return Rays(start.astype("f"), unit(end - start).astype("f"))


@pytest.fixture(scope="module")
def sphere_scene():
    """A mirror ball beside a matt one: its map is taken from the mirror."""
    return snapshot(ball(0.5, (4, 0, 0)), Ball=ball(detail=5))


@pytest.fixture(scope="module")
def sphere(sphere_scene):
    return baked(sphere_scene, points=64, texels=128)


def on_sphere(rays):
    """Distance to the unit sphere in closed form, inf = miss."""
    o, d = rays.origin.astype(float), rays.direction.astype(float)
    b = (o * d).sum(1)
    h = b * b - (o * o).sum(1) + 1
    t = -b - np.sqrt(np.maximum(h, 0))
    return np.where((h > 0) & (t > 0), t, np.inf)


def test_a_sphere_is_met_where_it_is(sphere, rng):
    rays = rays_at(rng, 4000, (4, 0, 0), 0.5)
    found, t = answer(sphere, rays), on_sphere(rays)
    met = found.status == spaces.STATUS_HIT
    front = rays.origin + rays.direction * np.where(np.isfinite(t), t, 0)[:, None]
    seen = np.isfinite(t) & (front[:, 0] > 0.4)  # well inside what the map sees
    assert seen.sum() > 1000 and met[seen].mean() > 0.999
    off = np.linalg.norm(found.position - front, axis=1)[seen & met]
    texel = 2 / 128
    assert np.percentile(off, 95) < texel and np.median(off) < texel / 4
    assert not met[~np.isfinite(t) & (np.linalg.norm(closest(rays), axis=1) > 1 + 2 * texel)].any(), "no hit beside the ball"


def closest(rays):
    """(N, 3) the point of each ray's line that is nearest to the origin."""
    o, d = rays.origin.astype(float), rays.direction.astype(float)
    return o - d * (o * d).sum(1, keepdims=True)


def test_float64_says_the_same(sphere, rng):
    """Rounding decides nothing but on the brink: two float types give the same points."""
    rays = rays_at(rng, 4000, (4, 0, 0), 0.5)
    a, b = answer(sphere, rays), answer(sphere, rays, np.float64)
    same = (a.status == b.status) & (np.linalg.norm(a.position - b.position, axis=1) < 1e-3 * np.linalg.norm(a.position, axis=1))
    assert (~same).mean() < tolerances.DEPTH_BRINKS


def test_degenerate_rays(sphere, sphere_scene, rng):
    camera_row = sphere.images["billboard_buf"][0]
    center = np.asarray(sphere.uniforms["center"])
    forward = camera_row[ROW["plane"], :3].astype(float)
    # z = p.forward + w vanishes at the eye, x and y too: three equations.
    axes = camera_row[[ROW["plane"], ROW["u"], ROW["v"]]].astype(float)
    eye = np.linalg.solve(axes[:, :3], -axes[:, 3]) + center
    # Through the eye: the projection is one point, and the hit is that of the ray.
    target = rng.normal(size=(200, 3)) * 0.3
    through = Rays(np.repeat(eye[None], 200, 0).astype("f"), unit(target - eye).astype("f"))
    found = answer(sphere, through)
    assert np.all(found.status == spaces.STATUS_HIT)
    t = on_sphere(through)
    assert np.abs(np.linalg.norm(found.position - eye, axis=1) - t).max() < 0.05
    # ... and from the other side, along the same lines, the map is not met from behind.
    behind = Rays((eye + through.direction * 40).astype("f"), -through.direction)
    assert not (answer(sphere, behind).status == spaces.STATUS_HIT).any()
    # Parallel to the image plane.
    side = unit(np.cross(forward, rng.normal(size=(200, 3))))
    start = -3 * side + unit(-forward) * rng.uniform(0.4, 0.9, (200, 1))
    flat = Rays(start.astype("f"), side.astype("f"))
    found, t = answer(sphere, flat), on_sphere(flat)
    assert np.all(found.status == spaces.STATUS_HIT)
    assert np.median(np.abs(np.linalg.norm(found.position - start, axis=1) - t)) < 0.03
    # Away from it, behind the camera, and null rays: nothing, and nothing that is not finite.
    none = Rays(np.repeat(eye[None], 3, 0).astype("f"), np.float32([[*-forward], [0, 0, 0], [*side[0]]]))
    for rays in (through, behind, flat, none):
        out = answer(sphere, rays)
        assert all(np.isfinite(getattr(out, f)).all() for f in ("radiance", "position", "status", "coverage"))
    assert not (answer(sphere, none).status == spaces.STATUS_HIT).any()


def test_the_turn_wraps_at_pi(sphere_scene, rng):
    """Projections just above and just below the image's x axis use the first and, as it were, the last turn."""
    asset = baked(sphere_scene, points=32, texels=128, turns=4)
    row = asset.images["billboard_buf"][0].astype(float)
    right, up = unit(row[ROW["u"], :3]), unit(row[ROW["v"], :3])
    towards = -row[ROW["plane"], :3]
    for sign in (1, -1):
        points = []
        for tilt in (-0.02, -1e-4, 0.0, 1e-4, 0.02):
            direction = unit(sign * (right + tilt * up) - 0.2 * towards)
            start = 0.95 * towards - 1.5 * direction
            out = answer(asset, Rays(start[None].astype("f"), direction[None].astype("f")))
            assert out.status[0] == spaces.STATUS_HIT
            points.append(out.position[0])
        assert np.ptp(points, axis=0).max() < 0.1


@pytest.mark.parametrize("points", [3, 8, 16])
def test_bisection_finds_what_the_walk_finds(sphere_scene, points, rng, monkeypatch):
    asset = baked(sphere_scene, points=points)
    rays = rays_at(rng, 2000, (4, 0, 0), 0.5)
    walked = answer(asset, rays)
    monkeypatch.setattr(depth_kernel, "LINEAR", 0)
    assert np.array_equal(answer(asset, rays).position, walked.position)


def test_no_surface_between_two_parts_at_different_depths(rng):
    """One object of a small plate in front of a large one: rays behind the small one's edge reach the large one."""
    front = trimesh.creation.box((0.1, 0.6, 0.6)).apply_translation([1, 0, 0])
    back = trimesh.creation.box((0.1, 2, 2)).apply_translation([-1, 0, 0])
    both = trimesh.util.concatenate([front, back])
    scene = snapshot(ball(0.5, (6, 0, 0)), Both=both)
    asset = replace_volume(scene, both, points=16, texels=128)
    # Steeply from above, behind the front plate: what a map can know of the back plate's middle it learnt beside it.
    start = np.stack([rng.uniform(0.0, 0.6, 500), rng.uniform(-0.2, 0.2, 500), np.full(500, 1.2)], -1)
    end = np.stack([np.full(500, -0.95), rng.uniform(-0.2, 0.2, 500), rng.uniform(0.5, 0.9, 500)], -1)
    rays = Rays(start.astype("f"), unit(end - start).astype("f"))
    found = answer(asset, rays)
    assert (found.status == spaces.STATUS_HIT).mean() > 0.95
    assert np.percentile(np.linalg.norm(found.position - end, axis=1), 95) < 0.05


def replace_volume(scene, shape, **settings):
    """The asset in which the second object is a depth map although it is made of flat parts."""
    one = job(scene, {**SMALL, **settings})
    one.shared[("flat", scene.instances[1].name, False)] = ([], False)
    return depth_maps.bake(one)


def test_more_maps_see_more(rng):
    """A mirror ring around a ball sees it from all sides."""
    scene = snapshot(trimesh.creation.torus(3.0, 0.3), Thing=ball(0.9, (0.2, 0, 0)))
    rays = rays_at(rng, 3000, (0, 0, 0), 3.0)
    missed = []
    for maps in (1, 2, 6):
        asset = baked(scene, maps=maps)
        found = answer(asset, rays)
        _, t = first_hits(world_mesh(scene, scene.instances[1]), rays.origin, rays.direction)
        missed.append(np.mean(np.isfinite(t) & (found.status != spaces.STATUS_HIT)))
    assert missed[2] < 0.5 * missed[1] < 0.5 * missed[0]


def test_a_thin_thing_on_a_wide_mirror_floor_is_seen_from_all_sides(rng):
    """Of thousands of rays from all over the floor a handful meet it; the floor's centre sees its foot."""
    floor = trimesh.Trimesh([[-6, -6, 0], [6, -6, 0], [6, 6, 0], [-6, 6, 0]], [[0, 1, 2], [0, 2, 3]])
    leg = trimesh.creation.cylinder(0.15, 2, sections=48).apply_translation([0, 0, 1])
    scene = snapshot(floor, Leg=leg)
    asset = baked(scene, maps=4, points=16, texels=128)
    angle, height = rng.uniform(0, 2 * np.pi, 2000), rng.uniform(0.05, 1.9, 2000)
    start = np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1) * rng.uniform(1, 5, 2000)[:, None]
    end = np.stack([*rng.uniform(-0.1, 0.1, (2, 2000)), height], -1)
    rays = Rays(start.astype("f"), unit(end - start).astype("f"))
    distance = first_hits(world_mesh(scene, scene.instances[1]), rays.origin, rays.direction)[1]
    found = answer(asset, rays)
    assert (found.status == spaces.STATUS_HIT)[np.isfinite(distance)].mean() > 0.99
    off = np.linalg.norm(found.position - rays.origin - rays.direction * distance[:, None], axis=1)
    assert np.percentile(off[np.isfinite(distance)], 95) < 0.02  # a texel


def test_only_reflectors_that_see_themselves_have_maps_of_themselves():
    far = {"Far": ball(0.2, (9, 0, 0), detail=1)}
    convex, ring = snapshot(ball(), **far), snapshot(trimesh.creation.torus(1.0, 0.3), **far)
    assert baked(convex).options["maps"] == 1
    own = baked(ring, maps=8)
    assert own.options["mirror_maps"] > 2
    near = own.images["billboard_buf"][:, ROW["limits"], 2]
    assert np.count_nonzero(near) == own.options["mirror_maps"], "only its own maps ignore what is nearest"


def test_a_torus_sees_its_other_side(rng):
    scene = snapshot(trimesh.creation.torus(1.0, 0.3, major_sections=96, minor_sections=48), Far=ball(0.2, (9, 0, 0), 1))
    asset = baked(scene, maps=8, texels=128)
    angle = rng.uniform(0, 2 * np.pi, 1000)
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros(1000)], -1)
    start, direction = 0.69 * out, unit(-out + 0.3 * directions(rng, 1000))
    rays = Rays(start.astype("f"), direction.astype("f"))
    _, t = first_hits(world_mesh(scene, scene.instances[0]), rays.origin, rays.direction)
    found = answer(asset, rays)
    met = (found.status == spaces.STATUS_HIT) & np.isfinite(t)
    assert met.sum() > 0.9 * np.isfinite(t).sum()
    assert np.percentile(np.abs(np.linalg.norm(found.position - start, axis=1) - t)[met], 95) < 0.05


def test_without_objects_it_is_the_environment(rng):
    asset = baked(snapshot(ball()))
    assert asset.options["maps"] == asset.options["count"] == 0 and "srdm_buf" not in asset.images
    program = record(depth_maps.trace, asset)
    assert not any(node.op == "loop" for node in program.graph.nodes)


def test_flat_things_have_no_map():
    wall = trimesh.creation.box((0.01, 3, 3)).apply_translation([2, 0, 0])
    asset = baked(snapshot(ball(), Wall=wall))
    assert asset.options["maps"] == 0 and asset.options["count"] >= 1


def test_half_size_tables(sphere_scene, rng):
    """u is a multiple of a half and so exact; q is off by a rounding: hits move by no more than that of the depth range."""
    full, half = baked(sphere_scene), baked(sphere_scene, half=True)
    assert full.images["srdm_buf"].nbytes == 2 * half.images["srdm_tx"].nbytes
    assert np.array_equal(full.images["srdm_buf"][..., 0::2], half.images["srdm_tx"][..., 0::2])
    assert np.abs(full.images["srdm_buf"][..., 1::2] - half.images["srdm_tx"][..., 1::2]).max() <= 2**-12
    rays = rays_at(rng, 2000, (4, 0, 0), 0.5)
    a, b = answer(full, rays), answer(half, rays)
    both = (a.status == 1) & (b.status == 1)
    assert np.mean(a.status == b.status) > 0.999
    assert np.percentile(np.linalg.norm(a.position - b.position, axis=1)[both], 95) < 2e-3


@pytest.mark.parametrize("settings", [{"points": 1}, {"turns": 4000}])
def test_impossible_tables_are_refused(sphere_scene, settings):
    with pytest.raises(ReflectError, match="points|turns"):
        baked(sphere_scene, **settings)


def test_tables_have_the_papers_size(sphere_scene):
    """P13: 60 x 256 x 8 points of two floats."""
    asset = baked(sphere_scene, texels=256, points=8)
    assert asset.images["srdm_buf"].nbytes == 60 * 256 * 8 * 2 * 4
    assert np.abs(asset.images["srdm_buf"]).max() == srdm.FILL


@pytest.mark.parametrize("scale", [1e-4, pytest.param(1e-2, marks=pytest.mark.slow), pytest.param(1e2, marks=pytest.mark.slow), 1e5])
def test_scale_changes_nothing(scale, rng):
    def scene(size):
        return snapshot(ball(0.5 * size, np.array([4, 0, 0]) * size), Ball=ball(size, detail=4))

    rays = rays_at(rng, 1000, (4, 0, 0), 0.5)
    one = answer(baked(scene(1.0)), rays)
    other = answer(baked(scene(scale)), Rays((rays.origin * scale).astype("f"), rays.direction))
    same = one.status == other.status
    assert same.mean() > 0.998 and np.isfinite(other.position).all()
    hit = same & (one.status == spaces.STATUS_HIT)
    assert np.percentile(np.linalg.norm(one.position - other.position / scale, axis=1)[hit], 99) < 1e-3


def test_the_assets_fields_are_what_the_kernel_needs(sphere):
    smaller = replace(sphere, images={k: v for k, v in sphere.images.items() if k != "srdm_buf"})
    with pytest.raises(Exception, match="srdm_buf"):
        record(depth_maps.trace, smaller)


def test_a_rigid_motion_only_moves_the_row(sphere_scene, rng):
    """Section 6: the map, its table and its colours stay; the moved row answers as a map made there would."""
    m = trimesh.transformations.rotation_matrix(0.7, [1, 2, 0.5]) @ trimesh.transformations.translation_matrix([0.3, 0.5, -0.2])
    before = sphere_scene
    moved_instance = replace(before.instances[1], world_from_object=m @ before.instances[1].world_from_object)
    after = replace(before, instances=(before.instances[0], moved_instance))
    asset = baked(before)
    step = billboard_follow.follow(billboard_follow.start(asset, before), after, {})
    assert step.moved == 1 and not step.shots and not step.state.stale
    followed = replace(asset, images={**asset.images, "billboard_buf": step.table})
    rays = rays_at(rng, 2000, (4, 0, 0), 0.5, target=m[:3, 3])
    # The same rays, taken back to where the object was, see the same points of it.
    back = np.linalg.inv(m)
    there = Rays((rays.origin @ back[:3, :3].T + back[:3, 3]).astype("f"), (rays.direction @ back[:3, :3].T).astype("f"))
    now, then = answer(followed, rays), answer(asset, there)
    hit = (now.status == spaces.STATUS_HIT) & (then.status == spaces.STATUS_HIT)
    assert hit.sum() > 500 and np.mean(now.status == then.status) > 0.995
    off = np.linalg.norm(now.position @ back[:3, :3].T + back[:3, 3] - then.position, axis=1)[hit]
    assert np.percentile(off, 99) < 1e-3
    gone = replace(before, instances=before.instances[:1])
    step = billboard_follow.follow(billboard_follow.start(asset, before), gone, {})
    hidden = replace(asset, images={**asset.images, "billboard_buf": step.table})
    assert not (answer(hidden, rays).status == spaces.STATUS_HIT).any()


def test_maps_with_normals_that_turn_are_named_stale():
    """Normals are the world's: the row goes along, and whoever looks is told."""
    scene = snapshot(trimesh.creation.torus(1.0, 0.3), Far=ball(0.2, (9, 0, 0), 1))
    asset = baked(scene, maps=2)
    assert {p.kind for p in asset.parts} == {"reflector", "map", "mirror_map"}
    turn = trimesh.transformations.rotation_matrix(0.5, [1, 0, 0])
    turned = replace(scene.instances[0], world_from_object=turn @ scene.instances[0].world_from_object)
    step = billboard_follow.follow(billboard_follow.start(asset, scene), replace(scene, instances=(turned, scene.instances[1])), {})
    assert step.state.stale == {"Mirror"} and not step.shots
    own = [p.row for p in asset.parts if p.kind == "mirror_map"]
    assert not np.allclose(step.table[own], asset.images["billboard_buf"][own])


def test_a_third_row_is_refused(sphere_scene):
    with pytest.raises(ReflectError, match="rows"):
        baked(sphere_scene, rows=3)


def test_rays_choose_among_any_number_of_maps(rng, monkeypatch):
    """More maps than are chosen from at once: what the loop over all of them answers."""
    places = directions(rng, 13) * 3
    scene = snapshot(ball(), **{f"Thing {k}": ball(0.5, at, detail=2) for k, at in enumerate(places)})
    asset = baked(scene, maps=2, texels=32)
    assert asset.options["maps"] > 2 * row_search.AT_ONCE
    d = directions(rng, 4000)
    rays = Rays((1.001 * d).astype("f"), unit(d + 0.5 * directions(rng, 4000)).astype("f"))
    found = answer(asset, rays)
    monkeypatch.setattr(depth_kernel, "each_row", lambda *a, may: row_search.each_row(*a))
    plain = answer(asset, rays)
    assert np.array_equal(found.radiance, plain.radiance) and np.array_equal(found.position, plain.position)
    assert np.mean(found.status == spaces.STATUS_HIT) > 0.05
