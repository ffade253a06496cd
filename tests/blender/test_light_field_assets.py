"""Light fields from Blender's own scenes: a way over frames, assets that stay fresh, go on, are shared and are joined."""

import numpy as np
import pytest

from reflect_addon.core.asset_files import load_asset
from reflect_addon.core.errors import Cancelled
from reflect_addon.core.light_field import cell_of
from reflect_addon.core.unfinished import PREFIX
from sample_blends import scene_parts as parts

SMALL = {"views": 4, "view_texels": 16, "samples": 1}
METHOD = ("light_field",)


@pytest.fixture
def stage(fresh_file):
    """A mirror ball that moves 2 m over ten frames, another one that stands, and a glowing ball."""
    from blender_scenes import emission

    scene = parts.prepare(fresh_file.context.scene, "field")
    parts.set_world(scene, (0.1, 0.1, 0.1))
    scene.frame_start, scene.frame_end = 1, 10
    moving = parts.sphere("Mirror", 0.5, parts.mirror(colour=(1, 1, 1)), 16, location=(0, 0, 0))
    for frame, x in ((1, 0.0), (10, 2.0)):
        moving.location.x = x
        moving.keyframe_insert("location", frame=frame)
    parts.sphere("Second", 0.5, parts.mirror(colour=(1, 1, 1)), 16, location=(4, 0, 0))
    parts.sphere("Red", 0.3, emission("Red", (0.8, 0.2, 0.1)), 16, location=(1, 1.5, 0))
    scene.frame_set(1)
    return fresh_file


def baked(bpy, folder, frame=1, **more):
    """(paths, rays traced) of a bake at a frame."""
    from reflect_addon.evaluation.frame import open_frame
    from reflect_addon.scene.bake import bake_assets
    from reflect_addon.scene.raytrace import trace

    bundles = []

    def tracer(rays, *arguments, **parts):
        bundles.append(len(rays))
        return trace(rays, *arguments, **parts)

    methods = more.pop("methods", METHOD)
    settings = {**SMALL, **more.pop("settings", {})}
    with open_frame(bpy.context.scene, frame) as snapshot:
        paths = bake_assets(snapshot, methods, folder, settings=settings, tracer=tracer, **more)
    return paths, sum(bundles)


def test_the_cell_holds_the_way_and_no_frame_needs_another_bake(stage, tmp_path):
    from reflect_addon.evaluation.frame import open_frame
    from reflect_addon.scene.freshness import is_stale, remark
    from reflect_addon.scene.load import load_assets

    paths, rays = baked(stage, tmp_path, reflectors=["Mirror"])
    assert rays > 0 and stage.context.scene.frame_current == 1
    cell = cell_of(load_asset(paths[0]))
    assert np.allclose(cell.center, [1, 0, 0], atol=0.02) and np.allclose(cell.half, [1.5, 0.5, 0.5], atol=0.03)
    assert baked(stage, tmp_path, frame=7, reflectors=["Mirror"])[1] == 0
    # Moved away by hand it is told, and baked again.
    stage.data.objects["Mirror"].animation_data_clear()
    stage.data.objects["Mirror"].location = (0, -3, 0)
    with open_frame(stage.context.scene, 7) as snapshot:
        asset = load_assets(snapshot, "light_field", tmp_path)["Mirror"]
        mirror = next(r for r in snapshot.reflectors() if r.name == "Mirror")
        assert is_stale(snapshot, asset) and "left its light field's cell" in remark(asset, snapshot, mirror)
    assert baked(stage, tmp_path, frame=7, reflectors=["Mirror"])[1] > 0


def test_only_what_moves_is_gone_through(stage):
    from reflect_addon.scene.snapshot import take_snapshot
    from reflect_addon.scene.ways import may_move, ways

    assert [may_move(stage.data.objects[n]) for n in ("Mirror", "Second", "Red")] == [True, False, False]
    snapshot = take_snapshot(stage.context.evaluated_depsgraph_get())
    low, high = ways(snapshot)(snapshot.instances[1])
    assert np.allclose([low, high], snapshot.bounds([snapshot.instances[1]]))


def test_a_cancelled_bake_keeps_its_slabs_and_says_the_time_left(stage, tmp_path, monkeypatch):
    from reflect_addon.core import light_field_trace

    monkeypatch.setattr(light_field_trace, "TOGETHER", 0)  # as a larger one is baked
    said = []

    def until(share, text):
        said.append(text)
        return len([t for t in said if "slab +Z" in t]) < 1

    with pytest.raises(Cancelled):
        baked(stage, tmp_path, reflectors=["Second"], progress=until)
    assert any("s left" in text for text in said)
    kept = list(tmp_path.glob(f"{PREFIX}*"))
    assert len(kept) == 1 and not list(tmp_path.glob("light_field-*"))
    _, rays = baked(stage, tmp_path, reflectors=["Second"])
    assert not list(tmp_path.glob(f"{PREFIX}*"))
    _, whole = baked(stage, tmp_path, reflectors=["Second"], again=True)
    assert 0 < rays < 0.6 * whole


def test_after_a_change_only_part_is_traced(stage, tmp_path):
    _, whole = baked(stage, tmp_path, reflectors=["Second"])
    stage.data.objects["Red"].location.z += 0.5
    _, part = baked(stage, tmp_path, reflectors=["Second"])
    assert 0 < part < 0.6 * whole
    assert baked(stage, tmp_path, reflectors=["Second"])[1] == 0
    stage.context.scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 3.0
    assert baked(stage, tmp_path, reflectors=["Second"])[1] >= whole


def test_reflectors_share_one_asset(stage, tmp_path):
    from reflect_addon.evaluation.frame import open_frame
    from reflect_addon.scene.freshness import is_stale
    from reflect_addon.scene.load import load_assets

    baked(stage, tmp_path)
    paths, _ = baked(stage, tmp_path, settings={"shared": True})
    assert [p.name for p in tmp_path.iterdir()] == ["light_field-all"] == [p.name for p in paths]
    with open_frame(stage.context.scene, 5) as snapshot:
        assets = load_assets(snapshot, "light_field", tmp_path)
        assert assets["Mirror"] is assets["Second"] and assets["Mirror"].reflector == ""
        assert not is_stale(snapshot, assets["Mirror"])
    assert np.allclose(cell_of(assets["Mirror"]).center, [2, 0, 0], atol=0.03)
    assert baked(stage, tmp_path, settings={"shared": True}, frame=5)[1] == 0


def test_what_is_near_comes_from_the_companion_that_is_there(stage, tmp_path):
    from reflect_addon.evaluation.frame import open_frame
    from reflect_addon.scene.load import load_assets

    coarse = {"resolution": 16, "texels": 16, "turns": 6, "points": 4, "maps": 1, "sky_error": 0}

    def loaded():
        with open_frame(stage.context.scene, 1) as snapshot:
            return load_assets(snapshot, "light_field", tmp_path)["Mirror"]

    only = {"reflectors": ["Mirror"]}
    baked(stage, tmp_path, **only)
    assert "light_field_tx" in loaded().images and len(loaded().images) == 1
    baked(stage, tmp_path, methods=("billboards",), settings=coarse, **only)
    assert "billboard_tx" in loaded().images and "maps" not in loaded().options
    baked(stage, tmp_path, methods=("depth_maps",), settings=coarse, **only)
    assert loaded().options["maps"] + loaded().options["mirror_maps"] > 0
    baked(stage, tmp_path, settings={"contact": False}, **only)
    assert len(loaded().images) == 1


@pytest.mark.parametrize("settings", [{}, {"compressed": True}, {"shared": True}, {"compressed": True, "depth": False}])
def test_memory_is_as_predicted(stage, tmp_path, settings, monkeypatch):
    from reflect_addon.evaluation import analyse

    monkeypatch.setattr(analyse, "assets_of", lambda scene: tmp_path)
    def field(asked):
        return next(m for m in analyse.analyse_scene(stage.context.scene, asked)["methods"] if m["name"] == "light_field")

    predicted = field({**SMALL, **settings})["predicted_bytes"]
    baked(stage, tmp_path, settings=settings)
    found = field({})
    assert found["bytes"] == predicted and found["state"] == "fresh"
    assert found["notes"] and "rays traced" in found["notes"][0]


def test_again_takes_nothing_over(stage, tmp_path):
    """What a thing that moved shades elsewhere needs a whole bake, and there is a way to ask for one."""
    _, whole = baked(stage, tmp_path, reflectors=["Second"])
    stage.data.objects["Red"].location.z += 0.5
    assert baked(stage, tmp_path, reflectors=["Second"], again=True)[1] >= whole
