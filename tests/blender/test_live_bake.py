"""What a bake for moving objects adds, from Blender's own scene: surface radiance, once, and the keys that it depends on."""

import numpy as np
import pytest

import reflect_addon
from reflect_addon.core.asset_files import load_asset
from reflect_addon.core.errors import ReflectError
from reflect_addon.core.methods import check_settings
from reflect_addon.core.surface_asset import meshes_of
from sample_blends import scene_parts as parts

SETTINGS = {"resolution": 8, "texels": 16, "samples": 1, "sky_error": 0}
SURFACES = {"surface_samples": 1}


@pytest.fixture
def stage(fresh_file):
    """Two mirror balls and two glowing ones in the dark: no noise."""
    scene = parts.prepare(fresh_file.context.scene, "live")
    parts.set_world(scene, (0, 0, 0))
    for name, x in (("Mirror", 0.0), ("Second", 3.0)):
        parts.sphere(name, 0.5, parts.mirror(colour=(1, 1, 1)), 16, location=(x, 0, 0))
    for name, x, colour in (("Red", 1.5, (0.8, 0.2, 0.1)), ("Blue", -1.5, (0.1, 0.2, 0.8))):
        parts.sphere(name, 0.3, glow(fresh_file, name, colour), 16, location=(x, 1, 0))
    fresh_file.context.view_layer.update()
    return fresh_file


def glow(bpy, name, colour):
    made = bpy.data.materials.new(name)
    shader = next(n for n in made.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (0, 0, 0, 1)
    shader.inputs["Specular IOR Level"].default_value = 0
    shader.inputs["Emission Color"].default_value = (*colour, 1)
    shader.inputs["Emission Strength"].default_value = 1
    return made


def snapshot(bpy):
    from reflect_addon.scene.snapshot import take_snapshot

    return take_snapshot(bpy.context.evaluated_depsgraph_get())


def test_surfaces_are_baked_once_and_for_what_may_move(stage, tmp_path):
    from reflect_addon.scene.bake import bake_assets

    scene, bundles = snapshot(stage), []

    def tracer(*arguments, **more):
        from reflect_addon.scene.raytrace import trace

        bundles.append(len(arguments[0]))
        return trace(*arguments, **more)

    def bake(live=True, **more):
        bundles.clear()
        bake_assets(scene, ["billboards"], tmp_path, settings={**SETTINGS, **SURFACES, "live": live}, tracer=tracer, **more)
        return len(bundles)

    path = tmp_path / "surface_radiance-all"
    assert bake(live=False) and not path.exists()
    first = bake(reflectors=["Mirror"])  # its billboards are fresh: `live` changes nothing in them
    assert first >= 2 and set(meshes_of(load_asset(path))) == {"Red", "Blue", "Second"}, "what the mirror sees, the other mirror too"
    bake(reflectors=["Second"])
    asset = load_asset(path)
    meshes = meshes_of(asset)
    assert set(meshes) == {"Red", "Blue", "Second", "Mirror"}, "an earlier bake's are kept"
    assert not meshes["Mirror"].radiance.any(), "a bare metal has no light of its own"
    assert asset.light_hash == scene.light_hash == load_asset(tmp_path / "billboards-Mirror").light_hash != ""
    assert bake() == 0, "all is fresh"
    (path / "asset.json").write_text("{")
    assert bake() >= 2 and set(meshes_of(load_asset(path))) == set(meshes)
    np.testing.assert_allclose(meshes["Red"].radiance, np.broadcast_to([0.8, 0.2, 0.1], meshes["Red"].radiance.shape), rtol=1e-4)
    own = scene.meshes[scene.named()["Red"].mesh]
    assert len(meshes["Red"].triangles) == len(own.triangles), "an even glow is not subdivided"


def test_settings_are_checked():
    check_settings(["billboards"], {"live": True, "surface_levels": 3})
    for bad in ({"live": 1}, {"live": "yes"}, {"surface_levels": 0}):
        with pytest.raises(ReflectError, match="cannot be"):
            check_settings(["billboards"], bad)
    with pytest.raises(ReflectError, match="no setting"):
        check_settings(["environment"], {"live": True})


def test_light_has_a_key_of_its_own(stage):
    """Motion and shape are not in it; materials, who has them, lamps and the world are."""
    bpy, keys = stage, [snapshot(stage).light_hash]

    def key():
        bpy.context.view_layer.update()
        keys.append(snapshot(bpy).light_hash)
        return keys[-1] == keys[-2]

    red = bpy.data.objects["Red"]
    red.location.x += 0.5
    assert key()
    red.data.vertices[0].co.x += 0.1
    red.data.update()
    assert key()
    red.active_material.roughness += 0.1  # which the viewport alone shows
    assert key()
    red.active_material.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value += 0.1
    assert not key()
    red.data.materials[0] = bpy.data.materials["Blue"]
    assert not key()
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    bpy.context.scene.collection.objects.link(lamp)
    assert not key()
    lamp.location.x += 1
    assert not key()
    bpy.context.scene.world.node_tree.nodes["Background"].inputs[0].default_value = (1, 0, 0, 1)
    assert not key()


def test_an_object_moved_in_blender_is_followed(stage, tmp_path, device):
    """The whole way: a bake by Cycles, Blender's depsgraph, a session, the GPU; then a bake of the moved scene beside it."""
    from reflect_addon.core import methods, spaces
    from reflect_addon.core.kernel import record, run_numpy
    from reflect_addon.core.look import Look
    from reflect_addon.core.rays import Rays
    from reflect_addon.gpu.session import ViewportSession
    from reflect_addon.scene.bake import bake_assets
    from reflect_addon.scene.load import load_assets

    settings = {**SETTINGS, **SURFACES, "live": True, "texels": 32}
    before = snapshot(stage)
    bake_assets(before, ["billboards"], tmp_path / "before", settings=settings)
    assets = load_assets(before, "billboards", tmp_path / "before")
    view = ViewportSession(lambda: snapshot(stage), lambda last: last or Look())
    surfaces = load_asset(tmp_path / "before" / "surface_radiance-all")
    view.set_assets("billboards", assets, surfaces)
    view.refresh()
    renderer = view.current_renderer()
    try:
        assert renderer.counts()["captures"] == 0, "the bake's scene and the window's are the same"
        stage.data.objects["Red"].location = (1.0, 0.9, 0.5)
        stage.context.view_layer.update()
        view.set_assets("billboards", assets, surfaces)
        assert view.refresh() and view.current_renderer() is renderer
        assert renderer.counts()["captures"] == 2 and renderer.scene.followed.stale == ()
        shown = renderer.scene.asset_shown(assets["Mirror"])
    finally:
        view.free()
    after = snapshot(stage)
    bake_assets(after, ["billboards"], tmp_path / "after", settings={**settings, "live": False})
    fresh = load_assets(after, "billboards", tmp_path / "after")["Mirror"]
    way = np.random.default_rng(1).normal(size=(20_000, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    rays = Rays((0.5 * way).astype("f"), way.astype("f"))

    def red(asset):
        found = run_numpy(record(methods.get("billboards").trace, asset), asset, rays)
        return (found.status == spaces.STATUS_HIT) & (found.radiance[:, 0] > 0.5)

    truth, now, old = red(fresh), red(shown), red(assets["Mirror"])
    assert truth.sum() > 100 and (truth & now).sum() > 0.95 * (truth | now).sum() and (truth & old).sum() < 0.5 * truth.sum()


def test_the_window_loads_surfaces_and_hands_them_over(stage, tmp_path):
    from reflect_addon.scene import live
    from reflect_addon.scene.bake import bake_assets
    from reflect_addon.scene.places import assets_of

    reflect_addon.register()
    try:
        bpy = stage
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "live.blend"))
        scene = bpy.context.scene
        scene.reflect.method = "billboards"
        assert scene.reflect.bake_settings()["live"] is True and "live=true" in scene.reflect.bake_arguments()
        bake_assets(snapshot(bpy), ["billboards"], assets_of(scene), settings={**SETTINGS, **SURFACES, "live": True})
        state = live.of(scene)
        state.reload(scene)
        assert state.surfaces.kind == "surface_radiance" and state.problems == () and len(state.joined()) == 2
        assert all(kind == "billboards" for kind, _ in state.assets)
        next(assets_of(scene).glob("surface_radiance-all/*.npy")).unlink()
        state.reload(scene)
        assert state.surfaces is None and "missing" in state.problems[0] and len(state.joined()) == 2
    finally:
        reflect_addon.unregister()
