"""`auto` with a planar mirror: its mirrored view is a candidate, exact, baked with the surfaces that it draws, and drawn beside what gathers."""

import shutil

import bpy
import numpy as np
import pytest
from blender_scenes import glowing_room
from panel_text import drawn

import reflect_addon
from reflect_addon.core import methods, surface_asset
from reflect_addon.core.asset_places import asset_name
from reflect_addon.core.planning.goal import Goal
from reflect_addon.core.planning.shown import mirrored_views
from reflect_addon.core.rays import Rays
from reflect_addon.core.reflected_samples import lifted
from reflect_addon.core.spaces import FAR
from reflect_addon.evaluation.assets import baked_in
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.gpu.renderer import Renderer
from reflect_addon.scene import live
from reflect_addon.scene.auto import bake_auto
from reflect_addon.scene.camera import camera_of
from reflect_addon.scene.load import load_surfaces, plan_in
from reflect_addon.scene.native_materials import remove_from_materials, use_in_materials
from reflect_addon.scene.places import assets_of
from reflect_addon.scene.planner import plan
from reflect_addon.scene.properties import object_properties
from reflect_addon.scene.raytrace import trace
from reflect_addon.scene.views import jobs_without_light, views_of
from sample_blends import scene_parts as parts

COARSE = {"resolution": 32, "texels": 32, "samples": 1, "turns": 12, "view_texels": 16, "views": 4, "surface_samples": 2, "surface_levels": 3}


@pytest.fixture
def dressing_room(fresh_file, tmp_path):
    """A room with a mirror on the floor, a mirror ball above it and a pillar: all that glows is to be seen in both."""
    scene, _ = glowing_room("dressing room")
    parts.box("Pillar", (0.5, 0.5, 1.5), (0.8, 0.9, 0.85), parts.material("Pillar", (0.2, 0.4, 0.8), emission=1.0))
    bpy.ops.mesh.primitive_plane_add(size=2.0, location=(0, 0.2, 0.05), rotation=(0.1, 0, 0.4))
    bpy.context.object.name = "Floor mirror"
    bpy.context.object.data.materials.append(parts.mirror())
    parts.sphere("Ball", 0.3, bpy.data.materials["Mirror"], 32, location=(-0.5, 0.5, 0.9))
    parts.camera((0, -1.9, 1.3), (0.0, 0.4, 0.4), lens=24)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "dressing.blend"))
    return scene


def silent(_share, _text):
    return True


def test_a_planar_mirror_is_shown_by_its_view_and_a_ball_is_not(dressing_room):
    with object_properties(), open_frame(dressing_room, None) as snapshot:
        made, _ = plan(dressing_room, snapshot, Goal(0.2), COARSE, silent)
        floor, ball = made.row_of("Floor mirror"), made.row_of("Ball")
        assert floor.method == "recursive" and floor.promised == 0.0 and "cheapest" in floor.reason
        assert ball.method in methods.gathering()
        assert {t.pruned for t in ball.tried if t.method == "recursive"} == {"it has no planar mirror"}
        tried = next(t for t in floor.tried if t.method == "recursive")
        assert [t.method for t in floor.tried if not t.pruned][-1] == "recursive", "cheaper ones come first, and nothing dearer is tried"
        assert tried.cost > 5 and tried.bytes > 1e6, "a second picture, and the surfaces that it draws"
        without, _ = plan(dressing_room, snapshot, Goal(0.2, views=False), COARSE, silent)
        assert without.row_of("Floor mirror").method in methods.gathering()
        assert {t.pruned for t in without.row_of("Floor mirror").tried if t.method == "recursive"} == {"mirrored views are switched off"}
        dressing_room.objects["Floor mirror"].reflect_stand_in = "KEPT"
        kept, _ = plan(dressing_room, snapshot, Goal(90.0), COARSE, silent, earlier=made)
        assert kept.row_of("Floor mirror").method == "recursive" and kept.row_of("Ball").method == "environment"
    for vertex in dressing_room.objects["Floor mirror"].data.vertices[:1]:
        vertex.co.z += 1.0
    dressing_room.objects["Floor mirror"].data.polygons.foreach_set("use_smooth", [True])
    with object_properties(), open_frame(dressing_room, None) as snapshot:
        bent, _ = plan(dressing_room, snapshot, Goal(90.0), COARSE, silent, earlier=made)
        assert bent.row_of("Floor mirror").method == "recursive" and bent.row_of("Floor mirror").promised > 0, "locked, but no plane any more"


def test_which_rays_start_on_a_planar_mirror(dressing_room, rng):
    with open_frame(dressing_room, None) as snapshot:
        job_of = jobs_without_light(snapshot)
        reflectors = snapshot.reflectors()
        seen = {one.reflector.name: one for one in views_of(dressing_room, snapshot, reflectors, job_of)[0]}
        assert mirrored_views(snapshot, seen["Ball"], {}) is None
        floor = seen["Floor mirror"]
        views = mirrored_views(snapshot, floor, {})
        assert len(views.planes) == 2, "a sheet mirrors on both sides"
        for sample in (floor.planned, floor.held_out):
            assert views.show(sample.rays).all()
            assert not views.show(seen["Ball"].planned.rays).any()
            above = sample.rays.origin + np.array([0, 0, 0.05], "f")
            assert not views.show(Rays(above, sample.rays.direction)).any(), "above the mirror"
            beside = sample.rays.origin + 3.0 * (np.cos(0.4) * np.array([1, 0, 0]) + np.sin(0.4) * np.array([0, 1, 0])).astype("f")
            assert not views.show(Rays(beside, sample.rays.direction)).any(), "on its plane, outside of it"


def test_the_view_is_baked_drawn_and_shows_what_cycles_sees(dressing_room, tmp_path, device):
    """On a device: where each pixel's ray ends, the mirror's by its view, the ball's by what was baked for it."""
    with open_frame(dressing_room, None) as snapshot:
        bake_auto(dressing_room, snapshot, tmp_path / "assets", settings={**COARSE, "tolerance": 0.2}, progress=silent)
        made, baked = plan_in(tmp_path / "assets"), baked_in(tmp_path / "assets", snapshot, methods.AUTO)
        assert made.row_of("Floor mirror").method == "recursive" and made.row_of("Floor mirror").measured == 0.0
        assert baked.surfaces is not None and load_surfaces("billboards", tmp_path / "assets") is None
        with object_properties():
            report = use_in_materials(dressing_room, snapshot, baked.assets, methods.AUTO)
            assert any("Floor mirror has a mirrored view" in said for said in report.sentences) and report.objects == 2
            remove_from_materials(dressing_room.objects)
        camera = camera_of(dressing_room, None, 96, 72)
        renderer = Renderer(snapshot, baked.assets, surfaces=baked.surfaces)
        try:
            rays, shown = renderer.ray_map(camera), renderer.answer(camera)
        finally:
            renderer.free()
        here = rays.reflector == rays.reflector_names.index("Floor mirror")
        off_mirror = lifted(rays.origin[here], rays.normal[here], snapshot.diagonal())
        truth = trace(Rays(off_mirror, rays.direction[here]), scene=dressing_room)
        assert here.sum() > 200
        off = np.linalg.norm(shown.position[here] - truth.position, axis=-1)
        inside = truth.hit & (np.abs(shown.position[here]).max(-1) < FAR / 2)
        assert inside.mean() > 0.95 and np.median(off[inside]) < 0.02 and np.percentile(off[inside], 90) < 0.1


def test_the_window_has_the_view_beside_what_gathers(dressing_room):
    """Loaded with the surfaces that views draw; views switched off ask for another plan; surfaces that are gone are missed."""
    reflect_addon.register()
    try:
        scene = dressing_room
        scene.reflect.method = methods.AUTO
        state = live.of(scene)
        with open_frame(scene, None) as snapshot:
            bake_auto(scene, snapshot, assets_of(scene), settings={**COARSE, "tolerance": 0.2}, progress=silent)
        scene.reflect.auto.tolerance = 0.2
        state.reload(scene)
        assert not state.problems and not state.compared.missing and not state.stale and state.surfaces is not None
        assert state.joined()["Floor mirror"].kind == "recursive" and state.joined()["Ball"].kind in methods.gathering()
        assert "Floor mirror: " in drawn() and "Recursive Mirrors" in drawn()
        scene.reflect.auto.mirrored_views = False
        assert set(state.compared.other_settings) == {"Floor mirror", "Ball"}, "asked for otherwise: another plan"
        scene.reflect.auto.mirrored_views = True
        assert not state.compared.other_settings
        shutil.rmtree(state.loaded.folder / asset_name(surface_asset.KIND, ""))
        state.reload(scene)
        assert state.compared.missing == ("Floor mirror",)
    finally:
        reflect_addon.unregister()
