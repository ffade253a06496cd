"""`auto` from end to end: planned, baked, proved, kept, overruled by hand; and what its rays meet against Cycles."""

import json
from dataclasses import replace
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from blender_scenes import glowing_room
from mathutils import Vector
from panel_text import drawn
from tolerances import HIT_POINT_OF_DIAGONAL, RAYS_ON_EDGES

import reflect_addon
from reflect_addon import cli
from reflect_addon.core import methods, metrics
from reflect_addon.core.camera import Camera
from reflect_addon.core.errors import ReflectError
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.planning.goal import Goal
from reflect_addon.core.planning.plan import FILE_NAME, read_plan
from reflect_addon.core.processes import temporary_folder
from reflect_addon.core.rays import Rays
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.evaluation.rows import read_rows
from reflect_addon.scene import live
from reflect_addon.scene.auto import bake_auto
from reflect_addon.scene.bake import bake_assets
from reflect_addon.scene.camera import camera_of
from reflect_addon.scene.geometric_trace import geometric_tracer
from reflect_addon.scene.intersect import first_hits
from reflect_addon.scene.load import PLANNED, load_assets
from reflect_addon.scene.native_materials import remove_from_materials, use_in_materials
from reflect_addon.scene.places import assets_of
from reflect_addon.scene.planner import plan
from reflect_addon.scene.properties import object_properties
from reflect_addon.scene.raymap_numpy import ray_mapper
from reflect_addon.scene.raytrace import trace
from reflect_addon.scene.views import jobs_without_light, views_of
from sample_blends import scene_parts as parts

SMALL = ("--set", "resolution=32", "--set", "texels=32", "--set", "samples=1", "--set", "views=4", "--set", "view_texels=16", "--set", "turns=12")


@pytest.fixture
def hall(fresh_file, tmp_path):
    """A closed room with a ball in it, another far behind a pillar, saved; a camera sees both."""
    _, walls = glowing_room("hall")
    parts.box("Pillar", (0.5, 0.5, 1.5), (1.5, 0.6, 0.75), walls)
    parts.sphere("Near", 0.4, parts.mirror(), 32, location=(0.3, -0.2, 1.0))
    parts.sphere("Far", 0.15, bpy.data.materials["Mirror"], 32, location=(-1.2, 1.2, 0.8))
    parts.camera((0, -1.9, 1.3), (0.1, 1.0, 1.1), lens=24)
    path = tmp_path / "hall.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def run(capfd, *arguments):
    capfd.readouterr()
    status = cli.main([str(a) for a in arguments])
    return status, *capfd.readouterr()


def silent(_share, _text):
    return True


def test_rays_meet_what_cycles_says(hall, rng):
    scene = bpy.context.scene
    with open_frame(scene, None) as snapshot:
        origin = rng.uniform((-1.5, -1.5, 0.3), (1.5, 1.5, 2.5), (3000, 3)).astype("f")
        direction = rng.normal(size=(3000, 3))
        rays = Rays(origin, (direction / np.linalg.norm(direction, axis=-1, keepdims=True)).astype("f"))
        ours = geometric_tracer(snapshot, first_hits(snapshot))
        for hide in ((), ("Room",), ("Near", "Pillar")):
            a, b = ours(rays, hide), trace(rays, hide, scene=scene)
            names = [np.array([*h.object_names, ""])[h.object] for h in (a, b)]
            alike = (a.hit == b.hit) & (names[0] == names[1])
            assert np.mean(~alike) <= RAYS_ON_EDGES + 1e-3
            both = alike & a.hit
            assert np.abs(a.position - b.position)[both].max() <= HIT_POINT_OF_DIAGONAL * snapshot.diagonal()
            assert np.einsum("nx,nx->n", a.normal, b.normal)[both].min() > 0.98  # a ball's facets beside its shading
        none = ours(Rays(origin[:0], rays.direction[:0]))
        assert len(none.hit) == 0
        along = Rays(np.array([[-1, -1, 1.0]], "f"), np.array([[0, 0, -1.0]], "f"))  # an axis: no direction is divided by
        assert ours(along).hit.all() and np.abs(ours(along).position[0] - (-1, -1, 0)).max() < 1e-4


def test_it_is_planned_baked_proved_and_kept(hall, tmp_path, capfd):
    status, out, err = run(capfd, "analyse", hall, "--plan", *SMALL)
    assert status == 0 and "Auto, asked for 1 degrees, for what the camera sees" in out and "Near: " in out, err
    status, out, err = run(capfd, "bake", hall, "--methods", "auto", *SMALL)
    assert status == 0, err
    folder = next((hall.parent / "reflect").iterdir())
    made = read_plan(folder / PLANNED)
    assert {row.reflector for row in made.rows} == {"Near", "Far"}
    for row in made.rows:
        assert row.measured <= 1.0 and row.promised <= 1.0 and "cheapest" in row.reason, row
    assert {p.name.partition("-")[0] for p in (folder / PLANNED).iterdir() if p.is_dir()} >= {row.method for row in made.rows}
    before = {p: p.stat().st_mtime_ns for p in folder.rglob("*") if p.is_file()}
    status, out, err = run(capfd, "bake", hall, "--methods", "auto", *SMALL)
    assert status == 0 and {p: p.stat().st_mtime_ns for p in folder.rglob("*") if p.is_file()} == before, "nothing is planned or baked twice"
    status, out, err = run(capfd, "render", hall, "--method", "auto", "--size", "32x24", "--samples", 1, "--assets", folder, "--out", tmp_path / "p.png")
    assert status == 0 and (tmp_path / "p.png").is_file(), err
    status, out, err = run(capfd, "analyse", hall, "--json")
    assert json.loads(out)["plan"]["goal"]["tolerance"] == 1.0
    status, out, err = run(capfd, "bake", hall, "--methods", "auto", "--objects", "Far", "--set", "tolerance=90", *SMALL)
    mixed = read_plan(folder / PLANNED)
    assert status == 0 and {row.reflector for row in mixed.rows} == {"Near", "Far"} and mixed.row_of("Far").method == "environment"
    assert mixed.row_of("Near") == made.row_of("Near") and not mixed.inputs, "of two goals: no bake takes it for its own"
    (folder / PLANNED / FILE_NAME).write_text("{")
    status, out, err = run(capfd, "render", hall, "--method", "auto", "--size", "32x24", "--samples", 1, "--assets", folder, "--out", tmp_path / "p.png")
    assert status == 1 and "damaged" in err and "Traceback" not in err


def test_it_is_no_worse_than_what_it_chose_among(hall, tmp_path, capfd):
    """Rows by the method that is best for both, and by auto without a tolerance, on rays and by a truth that no plan has seen."""
    status, out, err = run(
        capfd, "evaluate", hall, "--methods", "environment,box_proxy,billboards,auto", "--size", "64x48", "--samples", 2, "--backend", "numpy",
        "--set", "tolerance=0", "--out", tmp_path, *SMALL,
    )  # fmt: skip
    assert status == 0, err
    rows = {row.method: row for row in read_rows(tmp_path)}
    best = min((rows[m].angle_p95 for m in ("environment", "box_proxy", "billboards")))
    assert rows["auto"].angle_p95 <= max(1.1 * best, 0.05) and rows["auto"].flip <= 1.1 * min(rows[m].flip for m in ("environment", "box_proxy", "billboards"))


def test_what_is_chosen_by_hand_is_taken(hall):
    scene = bpy.context.scene
    with object_properties(), open_frame(scene, None) as snapshot:
        scene.objects["Far"].reflect_stand_in = "sphere_proxy"
        made, choices = plan(scene, snapshot, Goal(1.0), {}, silent)
        assert made.row_of("Far").method == "sphere_proxy" and made.settings == ('Far="sphere_proxy"',)
        far = next(c for c in choices if c.seen.reflector.name == "Far")
        assert far.taken.cost >= 1.0 and all("by hand" in c.pruned for c in far.candidates if c.errors is None)
        scene.objects["Far"].reflect_stand_in = "AUTO"
        assert plan(scene, snapshot, Goal(1.0), {}, silent)[0].row_of("Far").method != "sphere_proxy"


def test_what_is_locked_keeps_its_stand_in_and_settings(hall):
    """Whatever is asked for now, and whatever the scene has become; unlocked it is left to the plan again."""
    scene = bpy.context.scene
    small = {"resolution": 32, "texels": 32, "samples": 1}
    with object_properties(), open_frame(scene, None) as snapshot:
        made, _ = plan(scene, snapshot, Goal(1.0), small, silent)
        far = made.row_of("Far")
        assert far.method != "environment"
        scene.objects["Far"].reflect_stand_in = "KEPT"
        loose = {"resolution": 64, "samples": 1}
        kept, choices = plan(scene, snapshot, Goal(90.0), loose, silent, earlier=made)
        row = kept.row_of("Far")
        assert kept.row_of("Near").method == "environment" and row.method == far.method and row.by_hand and "kept as it is" in row.reason
        assert row.own_settings().items() >= {**far.own_settings(), "resolution": 32, "texels": 32}.items()
        assert all(c.errors is None for c in choices[[r.reflector for r in kept.rows].index("Far")].candidates[1:])
        again, _ = plan(scene, snapshot, Goal(90.0), loose, silent, earlier=kept)
        assert again.row_of("Far").settings == row.settings, "however often"
        assert plan(scene, snapshot, Goal(90.0), loose, silent)[0].row_of("Far").method == "environment", "nothing is known that it could keep"
        scene.objects["Far"].reflect_stand_in = "AUTO"
        assert plan(scene, snapshot, Goal(90.0), loose, silent, earlier=kept)[0].row_of("Far").method == "environment"


def test_a_bake_for_another_goal_leaves_what_is_locked_on_disk(hall):
    scene, folder = bpy.context.scene, hall.parent / "reflect"
    settings = {"resolution": 32, "texels": 32, "samples": 1}
    with object_properties(), open_frame(scene, None) as snapshot:
        bake_auto(scene, snapshot, folder, settings=settings)
        before = read_plan(folder / PLANNED).row_of("Far")
        files = {p: p.stat().st_mtime_ns for p in (folder / PLANNED).glob(f"{before.method}-Far/*")}
        scene.objects["Far"].reflect_stand_in = "KEPT"
        bake_auto(scene, snapshot, folder, settings={**settings, "tolerance": 90.0})
        after = read_plan(folder / PLANNED)
        assert after.goal.tolerance == 90 and after.row_of("Near").method == "environment"
        assert (after.row_of("Far").method, after.row_of("Far").settings) == (before.method, before.settings) and 0 <= after.row_of("Far").measured < 1
        assert files and files == {p: p.stat().st_mtime_ns for p in (folder / PLANNED).glob(f"{before.method}-Far/*")}
        assert load_assets(snapshot, methods.AUTO, folder)["Far"].kind == before.method


def test_views_around_where_there_is_no_camera_and_nothing_reflective(hall):
    scene = bpy.context.scene
    scene.camera = None
    with open_frame(scene, None) as snapshot:
        made, choices = plan(scene, snapshot, Goal(1.0), {}, silent)
        assert not made.by_cameras and all(len(c.seen.planned.rays) > 500 for c in choices)
        assert abs(sum(c.seen.share for c in choices) - 1) < 1e-6
        matte = replace(snapshot, instances=tuple(replace(i, is_reflector=False) for i in snapshot.instances))
        assert plan(scene, matte, Goal(1.0), {}, silent)[0].rows == ()


def test_what_a_view_beside_the_camera_shows_counts(hall, tmp_path):
    """Far is behind the camera; whoever looks from the other side sees it alone, in a larger picture."""
    scene = bpy.context.scene
    scene.objects["Far"].location = (0.3, -2.2, 1.3)
    scene.view_layers[0].update()
    with open_frame(scene, None) as snapshot:
        high = int(160 * scene.render.resolution_y / scene.render.resolution_x)
        own = camera_of(scene, None, 160, high)
        turn = np.diag([-1.0, 1.0, -1.0, 1.0])
        view = Camera.of(json.loads(json.dumps(replace(own, world_from_camera=own.world_from_camera @ turn, width=1600, height=10 * high).plain())))
        job_of = jobs_without_light(snapshot)
        (alone, _), by_cameras = views_of(scene, snapshot, snapshot.reflectors(), job_of)
        both, _ = views_of(scene, snapshot, snapshot.reflectors(), job_of, [view])
        by_name = {one.reflector.name: one for one in both}
        assert by_cameras and by_name["Far"].share > 0.01 and len(by_name["Far"].planned.rays) > 300
        assert np.isfinite(by_name["Far"].planned.pixel).all() and (by_name["Far"].planned.pixel > 0).all()
        assert alone.share / 2 == pytest.approx(by_name[alone.reflector.name].share, rel=1e-6)
        assert plan(scene, snapshot, Goal(1.0), {}, silent)[0].row_of("Far").share == 0
        assert plan(scene, snapshot, Goal(1.0), {}, silent, views=[view])[0].row_of("Far").share > 0.01
        scene.camera = None
        assert views_of(scene, snapshot, snapshot.reflectors(), job_of, [view])[1] is False, "a 3D view alone is no reason to leave anything out"


def test_a_bare_sky_and_what_nobody_sees_need_a_map_alone(hall):
    scene = bpy.context.scene
    scene.objects["Far"].location = (0, -4, 1)  # behind the camera, outside
    with open_frame(scene, None) as snapshot:
        made, _ = plan(scene, snapshot, Goal(1.0), {}, silent, [r for r in snapshot.reflectors() if r.name == "Far"])
        (row,) = made.rows
        assert row.method == "environment" and "camera" in row.reason and made.row_of("Near") is None
    scene.objects["Far"].location, scene.objects["Far"].scale = (-1.2, 1.2, 0.8), (0.15, 0.15, 0.15)
    scene.view_layers[0].update()
    with open_frame(scene, None) as snapshot:
        made, _ = plan(scene, snapshot, Goal(1e-6), {}, silent, [r for r in snapshot.reflectors() if r.name == "Far"])
        (row,) = made.rows
        assert 0 < row.share < 2e-4 and {t.method for t in row.tried if t.pruned.endswith("little of the picture")} >= {"depth_maps", "light_field"}
    scene.objects["Far"].scale = (1, 1, 1)
    for name in ("Room", "Pillar"):
        bpy.data.objects.remove(bpy.data.objects[name])
    scene.camera = None
    bpy.data.objects.remove(bpy.data.objects["Near"])
    with open_frame(scene, None) as snapshot:
        (row,) = plan(scene, snapshot, Goal(1.0), {}, silent)[0].rows
        assert row.method == "environment" and "sky" in row.reason and row.promised == 0


def test_a_plan_with_a_method_from_elsewhere_is_refused(hall, tmp_path, capfd):
    status, _, err = run(capfd, "bake", hall, "--methods", "auto", "--set", "tolerance=90", *SMALL)
    assert status == 0, err
    folder = next((hall.parent / "reflect").iterdir())
    text = (folder / PLANNED / FILE_NAME).read_text()
    (folder / PLANNED / FILE_NAME).write_text(text.replace('"method": "environment"', '"method": "nowhere"'))
    with open_frame(bpy.context.scene, None) as snapshot, pytest.raises(ReflectError, match="nowhere"):
        load_assets(snapshot, methods.AUTO, folder)


@pytest.fixture
def sidebar(hall):
    """The hall in a Blender with the add-on, auto chosen."""
    reflect_addon.register()
    bpy.context.scene.reflect.method = methods.AUTO
    yield bpy.context.scene
    reflect_addon.unregister()


def test_the_sidebar_shows_the_plan_and_is_overruled(sidebar):
    from reflect_addon.ops.plan_row import REFLECT_OT_plan_row

    state = live.of(sidebar)
    assert "Bake makes a plan" in drawn() and "Best" in drawn()
    for preset, tolerance in (("DRAFT", 5.0), ("BEST", 0.0), ("BALANCED", 1.0)):
        sidebar.reflect.auto.megabytes = 7.0
        assert bpy.ops.reflect.plan_preset(preset=preset) == {"FINISHED"}
        assert (sidebar.reflect.auto.tolerance, sidebar.reflect.auto.megabytes) == (tolerance, 0.0)
    settings = {name: value for name, value in (word.split("=") for word in SMALL[1::2])}
    with open_frame(sidebar, None) as snapshot:
        bake_auto(sidebar, snapshot, assets_of(sidebar), settings={name: int(value) for name, value in settings.items()})
    state.reload(sidebar)
    text = drawn()
    assert "Near: " in text and "Far: " in text and "the camera sees" in text and "reflect_stand_in" not in text and not state.problems
    shown = state.joined()
    assert {name: asset.kind for name, asset in shown.items()} == {row.reflector: row.method for row in state.loaded.plan.rows}
    assert not (state.compared.missing or state.stale or state.compared.other_settings)
    sidebar.objects["Far"].reflect_stand_in = "light_field"
    assert state.compared.other_settings == ("Far",)
    sidebar.objects["Far"].reflect_stand_in, sidebar.reflect.auto.tolerance = "AUTO", 2.0
    assert state.compared.other_settings == ("Near", "Far")
    sidebar.reflect.auto.tolerance = 1.0
    assert not state.compared.other_settings
    assert bpy.ops.reflect.plan_lock(reflector="Far") == {"FINISHED"} and sidebar.objects["Far"].reflect_stand_in == "KEPT"
    assert not state.compared.other_settings
    sidebar.reflect.auto.tolerance = 2.0
    assert state.compared.other_settings == ("Near",), "what is locked needs no bake for another goal"
    sidebar.reflect.auto.tolerance = 1.0
    assert bpy.ops.reflect.plan_lock(reflector="Far") == {"FINISHED"} and sidebar.objects["Far"].reflect_stand_in == "AUTO"
    assert bpy.ops.reflect.plan_lock(reflector="nobody") == {"CANCELLED"}
    row = SimpleNamespace(reflector="Far")
    assert "cheapest" in REFLECT_OT_plan_row.description(bpy.context, row)
    assert "does not know" in REFLECT_OT_plan_row.description(bpy.context, SimpleNamespace(reflector="nobody"))
    assert bpy.ops.reflect.plan_row(reflector="Far") == {"FINISHED"} and bpy.context.object.name == "Far"
    assert "reflect_stand_in" in drawn()
    assert bpy.ops.reflect.plan_row(reflector="nobody") == {"CANCELLED"}
    done = use_in_materials(sidebar, state.snapshot, shown, methods.AUTO)
    assert "2 materials of 2 objects" in done.counts(), done.counts()
    remove_from_materials(sidebar.objects)
    sidebar.objects["Pillar"].location.x += 0.2
    sidebar.view_layers[0].update()
    state.look(sidebar)
    assert set(state.stale) <= {"Near", "Far"} and state.stale
    assert bpy.ops.reflect.delete_assets() == {"FINISHED"} and not assets_of(sidebar).exists()
    assert live.of(sidebar).loaded.plan is None


def test_a_tolerance_in_pixels(hall):
    """A pixel on a ball is as many degrees as the picture's pixel makes of it: counted by rays of two neighbouring pixels of a finer picture."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 640, 480, 100
    with open_frame(scene, None) as snapshot:
        job_of = jobs_without_light(snapshot)
        near, _ = views_of(scene, snapshot, snapshot.reflectors()[:1], job_of)[0][0], None
        look = ray_mapper(snapshot)(camera_of(scene, scene.camera, 640, 480))
        mask = look.reflector == 0
        pairs = mask[:, :-1] & mask[:, 1:]
        first, second = (Rays(a[pairs], b[pairs]) for a, b in ((look.origin[:, :-1], look.direction[:, :-1]), (look.origin[:, 1:], look.direction[:, 1:])))
        ends = [job_of(near.reflector).trace(Rays(r.origin + 1e-3 * r.direction, r.direction)) for r in (first, second)]
        far = np.linalg.norm(ends[0].position - first.origin, axis=-1)
        counted = np.degrees(np.arctan2(np.linalg.norm(ends[1].position - ends[0].position, axis=-1), far))
        assert np.median(near.planned.pixel) == pytest.approx(np.median(counted), rel=0.3)
        strict, _ = plan(scene, snapshot, Goal(0.1, unit="pixels"), {}, silent)
        loose, _ = plan(scene, snapshot, Goal(1e3, unit="pixels"), {}, silent)
        assert all(row.method == "environment" for row in loose.rows) and any(row.method != "environment" for row in strict.rows)
        scene.camera = None
        with pytest.raises(ReflectError, match="no camera"):
            plan(scene, snapshot, Goal(1.0, unit="pixels"), {}, silent)


@pytest.mark.parametrize("scale", [1e-4, 1e5])
def test_a_scene_of_any_size_has_the_same_plan(hall, scale):
    scene = bpy.context.scene
    with open_frame(scene, None) as snapshot:
        plain, _ = plan(scene, snapshot, Goal(1.0), {}, silent)
    for obj in scene.objects:
        obj.location *= scale
        if obj.type == "MESH":
            obj.scale *= scale
    data = scene.camera.data
    data.clip_start, data.clip_end = 0.01 * scale, 100 * scale
    scene.view_layers[0].update()
    with open_frame(scene, None) as snapshot:
        scaled, _ = plan(scene, snapshot, Goal(1.0), {}, silent)
    for a, b in zip(plain.rows, scaled.rows, strict=True):
        assert (a.method, a.settings) == (b.method, b.settings) and a.share == pytest.approx(b.share, rel=0.02)
        assert a.promised == pytest.approx(b.promised, rel=0.1, abs=0.02)


def test_everything_reflective_and_one_thing_filling_the_view(hall):
    scene = bpy.context.scene
    for obj in scene.objects:
        if obj.type == "MESH":
            obj.data.materials.clear()
            obj.data.materials.append(bpy.data.materials["Mirror"])
    with open_frame(scene, None) as snapshot:
        made, _ = plan(scene, snapshot, Goal(1.0, megabytes=1e-9, cost=1e-9), {}, silent)
        assert {row.reflector for row in made.rows} == {"Room", "Pillar", "Near", "Far"} and len(made.warnings) >= 2
        assert all(row.method == "environment" for row in made.rows)
    scene.camera.location = scene.objects["Near"].location - scene.camera.matrix_world.to_quaternion() @ Vector((0, 0, -0.41))
    scene.view_layers[0].update()
    with open_frame(scene, None) as snapshot:
        filled, _ = plan(scene, snapshot, Goal(1.0), {}, silent)
        shares = {row.reflector: row.share for row in filled.rows}
        assert shares["Near"] > 0.99 and shares["Room"] < 0.01


def test_what_is_left_out_is_not_missed(hall):
    """Each thing that a plan leaves out is put back, alone: what the reflectors show changes by less than the noise of the bake."""
    scene = bpy.context.scene
    parts.box("Behind", (0.08, 0.08, 0.08), (1.8, 0.66, 0.3), bpy.data.materials["Walls"])  # in the lee of the pillar, for both balls
    with open_frame(scene, None) as snapshot:
        made, choices = plan(scene, snapshot, Goal(1.0), {}, silent)
        settings = {"resolution": 64, "texels": 64, "samples": 4, "turns": 12}
        put_back = 0
        for choice in choices:
            out = [one for one in choice.taken.changes if isinstance(one[1], tuple)]
            assert bool(out) == bool(choice.left_out) and all(one.cost >= -0.01 and one.why for one in choice.left_out)
            for name, names in out:
                images = []
                for own in ({**dict(choice.taken.changes)}, {**dict(choice.taken.changes), name: ()}):
                    with temporary_folder("reflect-test-") as folder:
                        reflector = choice.seen.reflector.name
                        bake_assets(snapshot, (choice.taken.method,), folder, reflectors=(reflector,), settings=settings, own_settings={reflector: own})
                        asset = load_assets(snapshot, choice.taken.method, folder)[reflector]
                        answer = run_numpy(record(methods.get(asset.kind).trace, asset), asset, choice.seen.held_out.rays)
                        images.append(answer.radiance)
                truth = [trace(choice.seen.held_out.rays, samples=4, seed=seed, scene=scene).radiance for seed in (1, 2)]
                floor = metrics.rmse(*truth)
                assert metrics.rmse(*images) <= max(floor, 1e-3), (choice.seen.reflector.name, name, names, floor)
                put_back += 1
        assert put_back
