"""Objects that move drag their reflection along: what a session re-makes and uploads, counted, and what is then seen."""

from dataclasses import replace

import hand_scenes
import numpy as np
import pytest
import tolerances
import trimesh
from analytic import directions, rotation, smooth
from mesh_scenes import job, snapshot, tracer

from reflect_addon.core import methods, spaces, surface_radiance
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.look import Look
from reflect_addon.core.methods import billboards
from reflect_addon.core.rays import Rays

SETTINGS = {**billboards.DEFAULTS, "resolution": 16, "samples": 1, "texels": 64, "sky_error": 0}
SURFACES = {**surface_radiance.DEFAULTS, "surface_samples": 1, "surface_tolerance": 0.02}
VOLUMES, FLAT, MIRRORS = ("Torus", "Rock"), ("Floor", "Crate"), ("Mirror", "Second")
CAMERA = hand_scenes.camera((-2, -4, 2.5), (0.5, 0, 0.5), (96, 64))


def at(shape, *place):
    return shape.apply_translation(place)


def scene_of_two_mirrors():
    crate = trimesh.creation.box((0.5, 0.6, 0.7))
    found = snapshot(
        at(trimesh.creation.icosphere(3, 0.4), 0, 0, 0.5),
        Second=at(trimesh.creation.icosphere(3, 0.4), 2.2, 0, 0.5),
        Torus=at(trimesh.creation.torus(0.35, 0.15), 1.0, 1.0, 0.5),
        Rock=at(trimesh.creation.icosphere(3, 0.3), 1.0, -1.2, 0.35),
        Floor=at(trimesh.creation.box((8, 8, 0.01)), 0, 0, 0),
        Crate=at(crate, -1.5, 1, 0.4),
    )
    instances = tuple(replace(i, is_reflector=i.name in MIRRORS, materials=(int(i.name not in MIRRORS),)) for i in found.instances)
    return replace(found, instances=instances, light_hash="day")


def paint_of(scene):
    """Paint that is on the objects and goes where they go."""
    inverse = [np.linalg.inv(i.world_from_object) for i in scene.instances]

    def paint(position, owner):
        out = np.zeros((len(position), 3))
        for k, matrix in enumerate(inverse):
            mine = owner == k
            out[mine] = smooth(3 * (position[mine] @ matrix[:3, :3].T + matrix[:3, 3])) + 0.2 * k
        return out

    return paint


def bake(scene):
    """({reflector: asset}, surface radiance of the volumes), through Embree."""
    paint = paint_of(scene)
    assets = {r.name: billboards.bake(replace(job(scene, SETTINGS, paint=paint), reflector=r)) for r in scene.reflectors()}
    moving = tuple(i for i in scene.instances if i.name in (*VOLUMES, *MIRRORS))
    return assets, surface_radiance.bake(scene, tracer(scene, paint), moving, SURFACES)


SCENE = scene_of_two_mirrors()


@pytest.fixture(scope="module")
def baked():
    return bake(SCENE)


@pytest.fixture
def shown(device, baked):
    """A session on the scene, drawn once; `shown(scene)` shows another state of it and returns what that cost."""
    from reflect_addon.gpu import session
    from reflect_addon.gpu.state import drawing_state  # noqa: F401  the GPU is there

    assets, surfaces = baked
    now = [SCENE]
    view = session.ViewportSession(lambda: now[0], lambda last: last or Look(), kernel=lambda kind: methods.get(kind).trace)

    def show(scene=None, camera=CAMERA, source=surfaces, assets=assets):
        if scene is not None:
            now[0] = scene
            view.set_assets("billboards", assets, source)
        before = view._renderer.counts() if view._renderer else {}
        view.refresh()
        renderer = view.current_renderer()
        renderer.picture(camera)
        after = renderer.counts()
        return {name: after[name] - before.get(name, 0) for name in after}

    show.view, show.assets = view, assets
    show(SCENE)
    yield show
    view.free()


def change(scene, name, matrix=None, mesh=None):
    index = next(k for k, i in enumerate(scene.instances) if i.name == name)
    instance, meshes = scene.instances[index], scene.meshes
    if matrix is not None:
        instance = replace(instance, world_from_object=matrix @ instance.world_from_object)
    if mesh is not None:
        meshes = tuple(mesh(m) if k == instance.mesh else m for k, m in enumerate(meshes))
    return replace(scene, meshes=meshes, instances=(*scene.instances[:index], instance, *scene.instances[index + 1 :]))


def step(x=0.0, y=0.0, z=0.0):
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def test_a_camera_re_makes_nothing(shown):
    for eye in ((3, -4, 2), (0, 5, 2)):
        cost = shown(camera=hand_scenes.camera(eye, (0.5, 0, 0.5), (96, 64)))
        assert (cost["captures"], cost["uploads"], cost["compiles"], cost["readbacks"]) == (0, 0, 0, 1)  # 1: the picture


def test_the_same_scene_again_re_makes_nothing(shown):
    cost = shown(replace(SCENE, frame=9))
    assert (cost["captures"], cost["uploads"], cost["compiles"], cost["allocations"]) == (0, 0, 0, 0)


def test_a_volume_re_makes_one_quad_a_reflector(shown):
    first = shown(change(SCENE, "Torus", step(0.2)))
    assert first["captures"] == 2 and first["uploads"] == 1 + 2  # the torus' surface, and two tables
    second = shown(change(SCENE, "Torus", step(0.3)))
    assert (second["captures"], second["uploads"], second["compiles"], second["allocations"]) == (2, 2, 0, 0)
    assert second["upload_bytes"] == sum(a.images["billboard_buf"].nbytes for a in shown.assets.values())
    assert shown(change(SCENE, "Torus", step(0.3)))["captures"] == 0
    assert shown.view.current_renderer().followed.stale == ()


def test_flat_things_only_move(shown):
    for name in FLAT:
        cost = shown(change(SCENE, name, step(0.1, 0.2)))
        assert (cost["captures"], cost["uploads"]) == (0, 2)
        assert shown(SCENE)["uploads"] == 2  # and back
    for name, asset in shown.assets.items():
        np.testing.assert_array_equal(
            shown.view.current_renderer().asset_shown(asset).images["billboard_buf"], asset.images["billboard_buf"], err_msg=name
        )


def test_a_reflector_re_makes_its_volumes(shown):
    """The two volumes. Mirrors that are seen in mirrors need normals, which only a bake makes: their quads are named."""
    cost = shown(change(SCENE, "Mirror", step(-0.2, 0.1)))
    assert cost["captures"] == 2 and set(shown.view.current_renderer().followed.stale) == {"Mirror", "Second"}


def test_what_deforms_is_made_again(shown):
    bent = lambda m: replace(m, positions=m.positions * np.float32([1, 1, 1.3]))  # noqa: E731
    cost = shown(change(SCENE, "Rock", mesh=bent))
    assert cost["captures"] == 2 and shown.view.current_renderer().followed.stale == ()


def test_light_is_no_reason_to_capture(shown):
    """The radiance that could be captured is the old light's: as before, the asset is stale and nothing else."""
    cost = shown(replace(SCENE, light_hash="night"))
    assert (cost["captures"], cost["uploads"]) == (0, 0)


@pytest.mark.parametrize("source", ["none", "another light"])
def test_without_surfaces_what_moves_is_named(shown, baked, source):
    surfaces = None if source == "none" else replace(baked[1], light_hash="night")
    moved = change(change(SCENE, "Torus", step(0.2)), "Floor", step(0.1))
    cost = shown(moved, source=surfaces)
    assert (cost["captures"], cost["uploads"]) == (0, 2) and shown.view.current_renderer().followed.stale == ("Torus",)
    cost = shown(moved, source=baked[1])
    assert cost["captures"] == 2 and shown.view.current_renderer().followed.stale == ()


def test_assets_without_parts_stay(shown, baked):
    plain = {name: replace(asset, parts=()) for name, asset in baked[0].items()}
    shown(SCENE, assets=plain)
    assert shown(change(SCENE, "Torus", step(0.2)), assets=plain)["captures"] == 0


@pytest.mark.parametrize("row", [-1, 99])
def test_rows_that_are_not_there_are_not_followed(shown, baked, row):
    assets = {n: replace(a, parts=(a.parts[0], replace(a.parts[1], row=row))) for n, a in baked[0].items()}
    shown(SCENE, assets=assets)
    cost = shown(change(SCENE, "Torus", step(0.2)), assets=assets)
    assert (cost["captures"], cost["uploads"]) == (0, 0)


def test_a_thousand_small_steps_add_up_to_none(shown):
    """Rows are moved from where they were captured, not from where they were shown last."""
    renderer, turn = shown.view.current_renderer(), step(1e-3, 5e-4)
    scene = SCENE
    for _ in range(30):
        scene = change(scene, "Crate", turn)
        renderer.update(scene)
    one = np.array(renderer.asset_shown(shown.assets["Mirror"]).images["billboard_buf"])
    renderer.update(SCENE)
    renderer.update(change(SCENE, "Crate", step(30e-3, 15e-3)))
    two = renderer.asset_shown(shown.assets["Mirror"]).images["billboard_buf"]
    np.testing.assert_allclose(one, two, rtol=0, atol=2e-6)


def rays_at(scene, name, count=4000):
    """Mirror-like rays of a reflector: from its surface outwards."""
    rng = np.random.default_rng(5)
    low, high = scene.bounds([scene.named()[name]])
    out = directions(rng, count)
    return Rays(((low + high) / 2 + 0.41 * out).astype("f"), out.astype("f"))


def seen(asset, rays):
    return run_numpy(record(billboards.trace, asset), asset, rays)


def row_of(asset, name):
    return next(p.row for p in asset.parts if p.instance == name)


MOTIONS = {
    "a volume": [("Torus", 0.45, 0.25, 0.1)],
    "a volume turns": [("Torus", 0.1, 0.0, 0.0, "turn")],
    "a reflector": [("Mirror", -0.3, 0.2, 0.15)],
    "a flat thing": [("Crate", 0.3, 0.4, 0.0)],
    "several": [("Rock", 0.2, 0.5, 0.2, "turn"), ("Floor", 0.0, 0.0, -0.1), ("Second", 0.1, -0.3, 0.1)],
}


@pytest.mark.parametrize("what", MOTIONS)
def test_after_the_move_it_is_as_if_baked_anew(shown, what):
    """Against a bake of the moved scene: close to it, and much closer than the old asset."""
    scene = SCENE
    for name, x, y, z, *turn in MOTIONS[what]:
        matrix = step(x, y, z)
        if turn:
            place = scene.named()[name].world_from_object[:3, 3]
            matrix[:3, :3] = rotation(np.random.default_rng(3))
            matrix[:3, 3] += place - matrix[:3, :3] @ place
        scene = change(scene, name, matrix)
    shown(scene)
    fresh, _ = bake(scene)
    renderer = shown.view.current_renderer()
    captured = 0
    for reflector, old in shown.assets.items():
        now = renderer.asset_shown(old)
        captured += now.source == "capture"
        rays = rays_at(scene, reflector)
        # What the environment shows is not followed: rays that meet a stand-in are compared.
        truth, found, before = (seen(asset, rays) for asset in (fresh[reflector], now, old))
        stands = truth.status == spaces.STATUS_HIT
        off = [np.abs(a.radiance - truth.radiance).max(1)[stands] / (truth.radiance.max(1)[stands] + 0.1) for a in (found, before)]
        assert np.mean(found.status != truth.status) < 0.01
        assert np.median(off[0]) < tolerances.CAPTURE_RADIANCE[0]
        assert np.mean(off[0] > 0.1) < 0.25 * np.mean(off[1] > 0.1) + 0.005
    assert captured == {"a flat thing": 0, "a reflector": 1}.get(what, 2)


def test_what_is_hidden_is_not_seen(shown):
    hidden = replace(SCENE, instances=tuple(i for i in SCENE.instances if i.name != "Rock"))
    assert shown(hidden)["captures"] == 0
    asset = shown.view.current_renderer().asset_shown(shown.assets["Mirror"])
    rays = rays_at(SCENE, "Mirror")
    at_rock = SCENE.named()["Rock"].world_from_object[:3, 3] - rays.origin
    rays = Rays(rays.origin, (at_rock / np.linalg.norm(at_rock, axis=1, keepdims=True)).astype("f"))
    center, around = SCENE.named()["Rock"].world_from_object[:3, 3], 0.35
    meets = lambda a: np.linalg.norm(seen(a, rays).position - center, axis=1) < around  # noqa: E731
    assert meets(shown.assets["Mirror"]).mean() > 0.4 and not meets(asset).any()
    shown(SCENE)
    again = shown.view.current_renderer().asset_shown(shown.assets["Mirror"])
    np.testing.assert_array_equal(again.images["billboard_buf"], shown.assets["Mirror"].images["billboard_buf"])
    # A mirror that is hidden for a while follows when it is back.
    alone = replace(SCENE, instances=tuple(i for i in SCENE.instances if i.name != "Mirror"))
    shown(change(alone, "Torus", step(0.2)))
    assert shown(change(SCENE, "Torus", step(0.2)))["captures"] == 1


def test_a_window_with_another_subdivision_has_no_deformed_meshes(shown):
    """Bakes see render levels: other triangles at first sight are the same object; its motion is followed all the same."""
    from reflect_addon.gpu.renderer import Renderer

    coarse = replace(SCENE, meshes=tuple(replace(m, triangles=m.triangles[::2], corner_normals=m.corner_normals[::2],
                                                 material_index=m.material_index[::2]) for m in SCENE.meshes))  # fmt: skip
    renderer = Renderer(coarse, shown.assets, kernel=lambda kind: methods.get(kind).trace, surfaces=shown.view.surfaces)
    assert renderer.counts()["captures"] == 0
    renderer.update(change(coarse, "Torus", step(0.2)))
    assert renderer.counts()["captures"] == 2 and renderer.followed.stale == ()
    renderer.free()
