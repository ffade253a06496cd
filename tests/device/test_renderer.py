"""The renderer: fill, resolve, look, counts, updates; one shader variant per plan."""

from dataclasses import replace

import hand_scenes as scenes
import numpy as np
import pytest
import tolerances

from reflect_addon.core.errors import ReflectError
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.look import TABLE_SIDE, Look, table_inputs
from reflect_addon.core.rays import Rays
from reflect_addon.core.snapshot import Material

CAMERA = scenes.camera((0, -6, 2), (0, 0, 0))
GOLD = Material("gold", metallic=1.0, roughness=0.0, base_color=(1.0, 0.7, 0.3), is_reflector=True)
PLASTIC = Material("plastic", metallic=0.0, roughness=0.0, ior=1.5, is_reflector=True)


@pytest.fixture
def make(device):
    from reflect_addon.gpu.renderer import Renderer

    return lambda snapshot, assets, **more: Renderer(snapshot, assets, kernel=scenes.kernels, **more)


def two_balls(second=scenes.MIRROR):
    ball = scenes.sphere_mesh()
    return scenes.snapshot(
        ("left", ball, scenes.placed((-1.2, 0, 0)), scenes.MIRROR),
        ("right", ball, scenes.placed((1.2, 0, 0)), second),
        ("floor", scenes.quad_mesh(), scenes.placed((0, 0, -1), 5), scenes.MATTE),
    )


def test_trace_rays_equals_numpy(device, rng):
    """10^5 random and edge rays through the fill shader and through NumPy."""
    from reflect_addon.gpu.fill import trace_rays

    direction = rng.normal(size=(100_000, 3))
    direction[:6] = np.concatenate([np.eye(3), -np.eye(3)])
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    rays = Rays(rng.normal(size=(100_000, 3)).astype(np.float32), direction.astype(np.float32))
    asset = scenes.sky_asset()
    found = trace_rays(asset, scenes.sky_kernel, rays, 0.01, 0.002)
    wanted = run_numpy(record(scenes.sky_kernel, asset), asset, rays, 0.01, 0.002)
    assert found.radiance.shape == (100_000, 3) and found.status.shape == (100_000,)
    assert np.allclose(found.radiance, wanted.radiance, rtol=tolerances.KERNEL_RADIANCE_RELATIVE, atol=1e-5)
    assert np.allclose(found.position, wanted.position, rtol=1e-4, atol=1e2)  # at FAR, 1e9 m
    assert np.array_equal(found.status, wanted.status) and np.array_equal(found.coverage, wanted.coverage)


def test_an_answer_is_the_kernel_on_the_ray_map(make):
    renderer = make(two_balls(), {"left": scenes.sky_asset("left"), "right": scenes.sky_asset("right", (0, 1, 0))})
    rays, found = renderer.ray_map(CAMERA), renderer.answer(CAMERA, footprints=False)
    for index, name in enumerate(rays.reflector_names):
        mask = rays.reflector == index
        assert mask.sum() > 100
        asset = renderer.scene.assets[name]
        wanted = run_numpy(
            record(scenes.sky_kernel, asset), asset, Rays(rays.origin[mask], rays.direction[mask])
        )
        assert np.allclose(found.radiance[mask], wanted.radiance, rtol=2e-3, atol=1e-4)
        assert (found.coverage[mask] == 1).all() and (found.status[mask] == 1).all()
    outside = ~rays.covered()
    assert found.coverage[outside].max() == 0 and found.status[outside].max() == 0


def test_a_shared_asset_is_one_pass_and_one_upload(make):
    shared = make(two_balls(), {"": scenes.sky_asset()})
    apart = make(two_balls(), {"left": scenes.sky_asset(), "right": scenes.sky_asset()})
    mixed = make(two_balls(), {"right": scenes.sky_asset()})
    for renderer in (shared, apart, mixed):
        renderer.answer(CAMERA)
    assert (shared.counts()["passes"], apart.counts()["passes"], mixed.counts()["passes"]) == (1, 2, 1)
    assert apart.counts()["uploads"] == shared.counts()["uploads"] + 1
    assert np.array_equal(shared.answer(CAMERA).radiance, apart.answer(CAMERA).radiance)
    found, rays = mixed.answer(CAMERA), mixed.ray_map(CAMERA)
    assert found.coverage[rays.reflector == 0].max() == 0 and found.coverage[rays.reflector == 1].min() == 1


def test_each_dupli_is_answered_from_its_own_asset(make):
    """Baked assets are named after the instance ("ball/1"), not after the object that it is a copy of."""
    balls = two_balls()
    duplis = {"left": "ball/1", "right": "ball/2"}
    renamed = [replace(i, name=duplis.get(i.name, i.name), object_name="ball") for i in balls.instances]
    renderer = make(
        replace(balls, instances=tuple(renamed)),
        {"ball/1": scenes.sky_asset("ball/1", (1, 0, 0), (1, 0, 0)), "ball": scenes.sky_asset("ball", (0, 1, 0), (0, 1, 0))},
    )
    found, rays = renderer.answer(CAMERA), renderer.ray_map(CAMERA)
    for index, channel in enumerate((0, 1)):  # the first has its own, the second its object's
        radiance = found.radiance[rays.reflector == index]
        assert len(radiance) > 100 and radiance[:, channel].min() > 0 and radiance[:, 1 - channel].max() == 0


def test_picture_is_reflectance_over_background(make):
    """Under white radiance: base colour to white on gold, Fresnel on plastic, the background elsewhere."""
    from reflect_addon.core import shading
    from reflect_addon.core.kernel import evaluate, record_function

    renderer = make(
        scenes.snapshot(
            ("gold", scenes.sphere_mesh(), scenes.placed((-1.2, 0, 0)), GOLD),
            ("plastic", scenes.sphere_mesh(), scenes.placed((1.2, 0, 0)), PLASTIC),
        ),
        {"": scenes.white_asset()},
    )
    rays = renderer.ray_map(CAMERA)
    background = np.full((64, 96, 3), 0.25, np.float32)
    picture = renderer.picture(CAMERA, background)
    assert np.allclose(picture[~rays.covered()], [0.25, 0.25, 0.25, 1])
    program = record_function(
        shading.reflectance, shading.REFLECTANCE_INPUTS, options={"has_metal": True, "has_dielectric": True}
    )
    for index, material in enumerate((GOLD, PLASTIC)):
        mask = rays.reflector == index
        count = int(mask.sum())
        values = {
            "cosine": (rays.normal * rays.direction).sum(-1)[mask],
            "base_color": np.tile(np.float32(material.base_color), (count, 1)),
            "metallic": np.full(count, material.metallic, np.float32),
            "specular_tint": np.ones((count, 3), np.float32),
            "ior": np.full(count, material.ior, np.float32),
            "weight": np.ones(count, np.float32),
        }
        wanted = evaluate(program, values)["reflectance"]
        assert np.abs(picture[mask][:, :3] - 0.25 - wanted).max() < 1e-4
    empty = renderer.picture(CAMERA)
    assert np.array_equal(empty[..., 3] == 1, rays.covered())
    with pytest.raises(ValueError, match="background has shape"):
        renderer.picture(CAMERA, background[1:])


def test_attenuation_and_its_absence(make):
    """White from 1 m away, halved each metre. Off: neither the fade nor a position buffer is in the shader."""
    from reflect_addon.gpu.resolve import Resolve

    snapshot = two_balls()
    plain = make(snapshot, {"": scenes.white_asset()})
    faded = make(snapshot, {"": scenes.white_asset()}, attenuation=1.0)
    first, second = plain.picture(CAMERA), faded.picture(CAMERA)
    assert np.allclose(second[..., :3], first[..., :3] / 2, atol=1e-4)
    sources = []
    for renderer in (plain, faded):
        assert isinstance(renderer.scene.resolve, Resolve)
        sources.append(repr(renderer.scene.resolve._composite_info("linear", "")))
    assert "distance_tx" not in sources[0] and "attenuation_at" not in sources[0]
    assert "distance_tx" in sources[1]
    assert "position" not in plain.shader_source(plain.scene.assets[""])


def test_a_plan_without_metal_has_no_metal(make):
    metal = make(scenes.snapshot(("a", scenes.sphere_mesh(), scenes.placed(), GOLD)), {})
    plastic = make(scenes.snapshot(("a", scenes.sphere_mesh(), scenes.placed(), PLASTIC)), {})
    assert "F82" in repr(metal.scene.resolve._composite_info("linear", ""))
    assert "F82" not in repr(plastic.scene.resolve._composite_info("linear", ""))
    assert "Fresnel" not in repr(metal.scene.resolve._composite_info("linear", ""))


def test_look_on_the_gpu_equals_numpy(make, rng):
    """A table that no view has (channels swapped, a curve), and the Standard path, on colours up to 2^6."""
    values = table_inputs()
    table = (values / (values + 0.5))[..., ::-1].astype(np.float32)
    renderer = make(two_balls(), {})
    background = (rng.random((64, 96, 3)) * np.exp2(rng.uniform(-6, 5, (64, 96, 1)))).astype(np.float32)
    for look in (Look(1.0, table, ("odd",)), Look(-1.0), Look(0.0, table, ("odd",))):
        renderer.scene.set_look(look)
        picture = renderer.picture(CAMERA, background, "display")[..., :3]
        assert np.abs(picture - look.apply(background)).max() < tolerances.LOOK_GPU
    assert TABLE_SIDE == table.shape[0]


def test_update_uploads_only_what_changed(make):
    from dataclasses import replace

    snapshot = two_balls()
    renderer = make(snapshot, {"": scenes.sky_asset()})
    renderer.picture(CAMERA)
    before = renderer.counts()
    nothing = {"meshes": 0, "dropped": 0, "materials": False, "assets": False}
    assert renderer.scene.update(replace(snapshot, frame=2)) == nothing
    moved = replace(snapshot.instances[0], world_from_object=scenes.placed((-1.0, 0, 0.2)))
    assert renderer.scene.update(replace(snapshot, instances=(moved, *snapshot.instances[1:]))) == nothing
    renderer.picture(CAMERA)
    after = renderer.counts()
    assert (after["uploads"], after["compiles"]) == (before["uploads"], before["compiles"])
    assert renderer.scene.update(two_balls(GOLD))["materials"]
    cube = scenes.snapshot(("cube", scenes.cube_mesh(), scenes.placed(), scenes.MIRROR))
    assert renderer.scene.update(cube)["meshes"] == 1
    assert renderer.ray_map(CAMERA).reflector_names == ("cube",)


def test_empty_scenes_and_meshes(make):
    from dataclasses import replace

    empty = make(scenes.snapshot(), {})
    assert not empty.ray_map(CAMERA).covered().any()
    assert empty.picture(CAMERA, np.full((64, 96, 3), 0.5))[..., :3] == pytest.approx(0.5)
    mesh = scenes.quad_mesh()
    none = {name: getattr(mesh, name)[:0] for name in ("triangles", "corner_normals", "material_index")}
    bare = replace(mesh, **none)
    broken = replace(mesh, positions=np.full_like(mesh.positions, np.nan))
    for bad in (bare, broken):
        renderer = make(scenes.snapshot(("bad", bad, scenes.placed(), scenes.MIRROR)), {"": scenes.white_asset()})
        assert not renderer.ray_map(CAMERA).covered().any()
        assert np.isfinite(renderer.picture(CAMERA)).all()


def test_what_does_not_fit_is_refused(device):
    from reflect_addon.gpu import upload
    from reflect_addon.gpu.counts import Counts

    with pytest.raises(ReflectError, match="radiance_tx"):
        upload.check_size("radiance_tx", 10**6, 4)
    with pytest.raises(ReflectError, match="shape"):
        upload.texture_from("radiance_tx", np.zeros((4, 4, 3)), Counts())


def test_half_floats_survive(device):
    """Every finite half pattern, denormals included, and values of an HDR sun."""
    from reflect_addon.gpu import upload
    from reflect_addon.gpu.counts import Counts

    bits = np.arange(0x7C00, dtype=np.uint16).view(np.float16)
    pixels = np.concatenate([bits, -bits]).reshape(-1, 62, 4)
    texture = upload.texture_from("all_tx", pixels, Counts())
    assert np.array_equal(upload.read_texture(texture, Counts()), pixels.astype(np.float32))


def test_time_and_free(make):
    from reflect_addon.gpu.timing import time_in_turns

    renderer = make(two_balls(), {"": scenes.sky_asset()})
    found = time_in_turns([renderer.work(CAMERA)] * 2, turns=3, frames=2)  # of a renderer that has drawn nothing yet
    assert found.ms.shape == (2, 3) and found.median(0) > 0 and found.spread(0) >= 0 and found.ratio(1, 0) > 0
    assert renderer.bytes() > 96 * 64 * 48
    renderer.free()
