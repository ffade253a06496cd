"""trace() leaves nothing behind: not in the file, not on the disk, whether it ends, fails or is cancelled."""

import re
import tempfile
from pathlib import Path

import bpy
import numpy as np
import pytest
from blender_dump import dump, dump_saved
from blender_scenes import add_mesh, add_soup, emission, set_world

from reflect_addon.core.errors import Cancelled, ReflectError
from reflect_addon.core.rays import Rays
from reflect_addon.scene import ray_scene, raytrace
from reflect_addon.scene.raytrace import trace
from reflect_addon.scene.restore import attributes

RAYS = Rays(np.tile(np.float32([0, 0, 5]), (900, 1)), np.tile(np.float32([0, 0, -1]), (900, 1)))


@pytest.fixture
def busy_file(fresh_file, rng):
    """A file with a bit of everything that trace() touches, in states it must put back."""
    scene = bpy.context.scene
    world = set_world((0.1, 0.2, 0.3))
    world.cycles_visibility.glossy = False
    for k in range(3):
        soup = add_soup(f"Soup {k}", rng, 10, rng.normal(0, 1, 3), 0.5)
        soup.data.materials.append(emission(f"Glow {k}", (1, 0.5, 0.2)))
        soup.pass_index, soup["custom"] = 40 + k, [1, 2, 3]
    bpy.data.objects["Soup 0"].visible_glossy = False
    bpy.data.objects["Soup 1"].visible_camera, bpy.data.objects["Soup 1"].is_holdout = False, True
    bpy.data.objects["Soup 2"].is_shadow_catcher = True
    bpy.ops.object.light_add(type="POINT", location=(1, 1, 3))
    bpy.ops.object.camera_add(location=(0, -5, 1))
    scene.camera = bpy.context.object
    scene.camera.keyframe_insert("location", frame=1)
    scene.timeline_markers.new("Cut", frame=1).camera = scene.camera
    inner = bpy.data.collections.new("Inner")
    inner.objects.link(add_mesh("Piece", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]))
    scene.collection.objects.unlink(bpy.data.objects["Piece"])
    empty = bpy.data.objects.new("Dupli", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", inner
    scene.collection.objects.link(empty)
    scene.view_layers.new("Second").use = False
    scene.render.engine, scene.render.use_stamp, scene.frame_current = "BLENDER_EEVEE", True, 7
    bpy.context.view_layer.update()
    return scene


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """Where trace() puts its files in this test."""
    monkeypatch.setattr(raytrace, "memory_folder", lambda: str(tmp_path))
    return tmp_path


def run_ok():
    assert trace(RAYS, hide=("Soup 1",)).hit.shape == (900,)


def run_cancelled():
    with pytest.raises(Cancelled):
        trace(RAYS, progress=lambda share, text: share < 0.5)


def run_failing(monkeypatch):
    def fail(path):
        raise OSError("no space left on device")

    monkeypatch.setattr(raytrace, "read_exr", fail)
    with pytest.raises(OSError, match="no space"):
        trace(RAYS, hide=("Soup 0",), as_reflection=False)


@pytest.mark.alone
@pytest.mark.parametrize("how", ["ok", "cancelled", "failing"])
def test_file_and_disk_are_as_before(busy_file, temporary, tmp_path_factory, monkeypatch, how):
    monkeypatch.setattr(raytrace, "PATHS_PER_RENDER", 400)
    folder = tmp_path_factory.mktemp("saved")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "before.blend"), copy=True)
    live, selected = dump(), [o.name for o in bpy.context.selected_objects]
    others = set(Path(tempfile.gettempdir()).glob("*.oso"))
    {"ok": run_ok, "cancelled": run_cancelled, "failing": lambda: run_failing(monkeypatch)}[how]()
    assert dump() == live
    assert [o.name for o in bpy.context.selected_objects] == selected
    assert bpy.context.scene.name == busy_file.name
    assert not list(temporary.iterdir())
    assert set(Path(tempfile.gettempdir()).glob("*.oso")) == others
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "after.blend"), copy=True)
    before, after = dump_saved(folder / "before.blend"), dump_saved(folder / "after.blend")
    assert before == after
    assert len(before) > 15


def test_the_comparison_sees_a_single_changed_value(busy_file):
    live = dump()
    bpy.data.objects["Soup 1"].pass_index += 1
    assert dump() != live
    bpy.data.objects["Soup 1"].pass_index -= 1
    assert dump() == live
    bpy.data.materials["Glow 1"].node_tree.nodes["Emission"].inputs["Strength"].default_value = 1.25
    assert dump() != live


def test_temporary_files_go_where_the_parent_process_says(fresh_file, tmp_path, monkeypatch):
    monkeypatch.setenv("REFLECT_TEMP", str(tmp_path))
    seen = []
    trace(RAYS, progress=lambda share, text: seen.append(len(list(tmp_path.iterdir()))))
    assert seen == [1, 0] and not list(tmp_path.iterdir())


def test_progress_counts_up_to_one(fresh_file, monkeypatch):
    monkeypatch.setattr(raytrace, "PATHS_PER_RENDER", 300)
    shares = []
    trace(RAYS, progress=lambda share, text: shares.append(share))
    assert shares == pytest.approx([0, 1 / 3, 2 / 3, 1])


def test_collection_instances_are_named_after_their_original(busy_file):
    hits = trace(Rays(np.float32([[0.2, 0.2, 5]]), np.float32([[0, 0, -1]])), hide=("Soup 0", "Soup 1", "Soup 2"))
    assert hits.object_names[hits.object[0]] == "Piece"


def test_hiding_what_does_not_exist_is_an_error(fresh_file):
    with pytest.raises(ValueError, match="Nobody"):
        trace(RAYS, hide=("Nobody",))


def test_objects_of_a_linked_library_are_traced_and_restored(fresh_file, tmp_path):
    floor = add_mesh("Floor", [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2, 3)])
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {floor})
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.objects = ["Floor"]
    bpy.context.scene.collection.objects.link(bpy.data.objects["Floor"])
    before = dump()
    hits = trace(RAYS)
    assert {hits.object_names[i] for i in hits.object} == {"Floor"}
    assert not trace(RAYS, hide=("Floor",)).hit.any()
    assert dump() == before


def test_a_blender_without_osl_says_what_to_do(fresh_file, monkeypatch):
    class Options:
        cycles_osl = False

    monkeypatch.setattr(ray_scene, "build_options", lambda: Options)
    with pytest.raises(ReflectError, match="OSL") as caught:
        trace(RAYS)
    assert "official build" in caught.value.remedy


def test_a_blender_without_its_modules_says_what_to_do(fresh_file, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "oslquery", None)
    with pytest.raises(ReflectError, match="oslquery"):
        trace(RAYS)


def test_attributes_come_back_in_reverse_also_when_the_body_raises(busy_file):
    soup = bpy.data.objects["Soup 0"]
    with pytest.raises(KeyError):
        with attributes([(soup, "pass_index", 1), (soup, "pass_index", 2), (soup, "location", (1, 2, 3))]):
            assert (soup.pass_index, tuple(soup.location)) == (2, (1, 2, 3))
            raise KeyError
    assert (soup.pass_index, tuple(soup.location)) == (40, (0, 0, 0))


def test_the_importance_map_is_as_fine_as_the_picture_and_comes_back(fresh_file, tmp_path):
    """A world of one small picture; another texture beside it, or the user's own choice, is left alone."""
    world = set_world((0, 0, 0))
    tree, scene = world.node_tree, bpy.context.scene
    picture = tree.nodes.new("ShaderNodeTexEnvironment")
    picture.image = bpy.data.images.new("Sky", 1600, 800, float_buffer=True)
    tree.links.new(picture.outputs["Color"], tree.nodes["Background"].inputs["Color"])

    def inside():
        with ray_scene.ray_scene(scene, tmp_path, frozenset(), 1, True):
            return world.cycles.sampling_method, world.cycles.sample_map_resolution

    before = world.cycles.sampling_method, world.cycles.sample_map_resolution
    assert before == ("AUTOMATIC", 1024)
    assert inside() == ("MANUAL", 3200)
    assert (world.cycles.sampling_method, world.cycles.sample_map_resolution) == before
    world.cycles.sampling_method, world.cycles.sample_map_resolution = "MANUAL", 77
    assert inside() == ("MANUAL", 77)
    world.cycles.sampling_method = "AUTOMATIC"
    tree.nodes.new("ShaderNodeTexSky")
    assert inside()[0] == "AUTOMATIC"


def used_mib(scene) -> float:
    """What Blender says it has allocated, MiB."""
    number, unit = re.search(r"Memory: ([\d.]+) (\w+)", scene.statistics(scene.view_layers[0])).groups()
    return float(number) * {"MiB": 1, "GiB": 1024}[unit]


def test_no_engine_outlives_its_scene(fresh_file):
    """Blender finds engines by the address of their scene: one that stays behind goes on with freed data."""
    scene = bpy.context.scene
    dense = add_mesh("Dense", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)])
    dense.modifiers.new("Subdivision", "SUBSURF").render_levels = 9
    before = used_mib(scene)
    trace(RAYS)
    assert used_mib(scene) < before + 5  # an engine that stays keeps 65 MiB of this mesh
