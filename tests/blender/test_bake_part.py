"""A bake in parts is the whole, bit for bit, under a tracer whose noise depends on where a ray stands in its bundle, as Cycles' does."""

from functools import partial

import bpy
import numpy as np
import pytest
from blender_scenes import two_mirrors
from whole_and_parts import assert_same_assets, files_of

from reflect_addon import cli
from reflect_addon.core import methods
from reflect_addon.core.errors import Cancelled, ReflectError
from reflect_addon.core.part_record import read_part
from reflect_addon.core.parts import Part
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.evaluation.merge import merge
from reflect_addon.scene import bake_part as in_parts
from reflect_addon.scene.bake import bake_assets
from reflect_addon.scene.bake_part import bake_part, parts_of, units_of
from reflect_addon.scene.geometric_trace import geometric_tracer
from reflect_addon.scene.intersect import first_hits

SMALL = {"resolution": 16, "samples": 1, "texels": 16, "views": 2, "view_texels": 4, "turns": 12, "maps": 1, "surface_tolerance": 1.0, "surface_levels": 1}
WANTED = tuple(name for name in methods.names() if name != "virtual_objects")  # seconds of a search that traces nothing


@pytest.fixture
def room(tmp_path):
    """(scene, snapshot, tracer) of a room with two mirrors."""
    two_mirrors(tmp_path / "hall.blend")
    scene = bpy.context.scene
    with open_frame(scene, None) as snapshot:
        meet = geometric_tracer(snapshot, first_hits(snapshot))

        def tracer(rays, hide=(), samples=1, **more):
            hits = meet(rays, hide, samples, **more)
            noise = np.random.default_rng(samples).random((len(rays), 3), np.float32)
            hits.radiance[:] = np.where(hits.hit[:, None], noise, 0.5)
            return hits

        yield scene, snapshot, tracer


def test_parts_in_any_order_are_the_whole(room, tmp_path):
    scene, snapshot, tracer = room
    bake_assets(snapshot, WANTED, tmp_path / "whole", settings=SMALL, tracer=tracer)
    for number in (3, 1, 2):
        bake_part(scene, snapshot, WANTED, tmp_path / str(number), Part(number, 3), settings=SMALL, tracer=tracer)
    merge([tmp_path / str(number) for number in (2, 3, 1)], tmp_path / "merged")
    assert_same_assets(tmp_path / "merged", tmp_path / "whole")


def test_what_takes_from_each_other_stays_together(room):
    _, snapshot, _ = room
    for of in (2, 5, 40):
        units = units_of(snapshot, WANTED, (), SMALL)
        numbers = parts_of(units, of)
        for word in ("flat", "surfaces"):
            assert len({n for n, unit in zip(numbers, units, strict=True) if word in unit.words}) == 1
        assert len(set(numbers)) == min(of, len({n for n in parts_of(units, 40)}))
    shared = units_of(snapshot, ("light_field",), (), {"shared": True})
    assert [unit.folder() for unit in shared] == ["light_field-all"] * 2 and len(set(parts_of(shared, 2))) == 1


def test_more_parts_than_work_and_parts_made_again(room, tmp_path):
    """Eight parts of four assets, one killed on its way and begun again, another made twice; nothing is traced for those without work."""
    scene, snapshot, tracer = room
    wanted, settings = ("environment", "sphere_proxy"), {"resolution": 8, "samples": 1}
    bake_assets(snapshot, wanted, tmp_path / "whole", settings=settings, tracer=tracer)
    make = lambda number, progress=None: bake_part(
        scene, snapshot, wanted, tmp_path / str(number), Part(number, 8), settings=settings, tracer=tracer, progress=progress
    )
    with pytest.raises(Cancelled):
        make(1, lambda share, text: share == 0)
    with pytest.raises(ReflectError, match="is not finished"):
        read_part(tmp_path / "1")
    made = [make(number) for number in range(1, 9)]
    assert [len(some) for some in made] == [1, 1, 1, 1, 0, 0, 0, 0]
    before = files_of(tmp_path / "2")
    make(2)
    assert files_of(tmp_path / "2") == before
    merge([tmp_path / str(number) for number in range(1, 9)], tmp_path / "merged")
    assert_same_assets(tmp_path / "merged", tmp_path / "whole")


def test_a_folder_of_another_bake_is_refused(room, tmp_path):
    scene, snapshot, tracer = room
    make = partial(bake_part, scene, snapshot, ("environment",), tmp_path / "1", settings={"resolution": 8, "samples": 1}, tracer=tracer)
    make(Part(1, 2))
    before = files_of(tmp_path / "1")
    for changes in ({"part": Part(2, 2)}, {"settings": {"resolution": 16, "samples": 1}}, {"reflectors": ["Near"]}):
        with pytest.raises(ReflectError, match="holds part 1/2 of another bake"):
            make(**{"part": Part(1, 2), **changes})
    assert files_of(tmp_path / "1") == before


def test_parts_of_a_changed_file_are_refused(room, tmp_path):
    scene, snapshot, tracer = room
    more = {"settings": {"resolution": 8, "samples": 1}, "tracer": tracer}
    bake_part(scene, snapshot, ("environment",), tmp_path / "1", Part(1, 2), **more)
    scene.objects["Pillar"].location.x += 0.1
    with open_frame(scene, None) as changed:
        bake_part(scene, changed, ("environment",), tmp_path / "2", Part(2, 2), **more)
    with pytest.raises(ReflectError, match="their scene's content differ"):
        merge([tmp_path / "1", tmp_path / "2"], tmp_path / "merged")


def test_auto_is_one_unit(room):
    _, snapshot, _ = room
    units = units_of(snapshot, ("environment", methods.AUTO), (), {})
    assert [unit.name() for unit in units] == ["environment of Near", "environment of Far", "auto"]
    assert units[-1].effort > in_parts.AUTO_EFFORT, "as many reflectors as it plans"


def test_a_part_needs_a_folder(room, tmp_path, capfd):
    assert cli.main(["bake", str(tmp_path / "hall.blend"), "--methods", "environment", "--part", "1/2"]) == 1
    assert "--out" in capfd.readouterr().err
    with pytest.raises(SystemExit):
        cli.main(["bake", "--methods", "environment", "--part", "3/2", "--out", str(tmp_path / "x")])
    assert "is not a part; write I/N" in capfd.readouterr().err
