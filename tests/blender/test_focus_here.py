"""'Focus Here': what a click meets, itself or in a mirror, becomes the distance that the light field is sharp at."""

import bpy
import numpy as np
import pytest
from mathutils import Vector

import reflect_addon
from reflect_addon.core.asset import Asset
from reflect_addon.core.asset_files import save_asset
from reflect_addon.core.asset_places import asset_name
from reflect_addon.core.light_field import Cell

EYE = Vector((0.0, -8.0, 3.0))
WALL = 6.0  # m: x of the wall


@pytest.fixture
def room(fresh_file, tmp_path):
    """A smooth ball at the origin that is marked as a reflector, a wall at x = 6, and a light field of the ball."""
    reflect_addon.register()
    bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48)
    ball = bpy.context.object
    ball.name, ball.reflect_mark = "Ball", "YES"
    bpy.ops.object.shade_smooth()
    bpy.ops.mesh.primitive_plane_add(size=30, location=(WALL, 0, 0), rotation=(0, np.pi / 2, 0))
    bpy.context.object.name = "Wall"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    yield bpy.context.scene
    reflect_addon.unregister()


def bake(scene):
    from reflect_addon.scene.places import assets_of

    cell = Cell(np.array([0.5, 0.0, 0.0]), np.array([1.5, 1.0, 1.0]), 2, 4)
    uniforms = {**cell.uniforms(), "light_scale": 1.0, "focus": (0.0,) * 3, "focus_back": (0.0,) * 3}
    uniforms |= {"rays": 1.0, "views_used": 24.0, "contact": 1.0}
    options = {"views": 2, "texels": 4, "columns": cell.columns(), "depth": False, "coded": False}
    images = {"light_field_tx": np.ones((*cell.shape(), 4), np.float16)}
    save_asset(Asset("light_field", "Ball", images, uniforms, options), assets_of(scene) / asset_name("light_field", "Ball"))
    scene.reflect.method = "light_field"


def mirrored(normal):
    """(origin, direction) of a ray from EYE to the ball's point of this normal, and the direction that it is mirrored to."""
    normal = Vector(normal).normalized()
    direction = (normal - EYE).normalized()
    return direction, direction.reflect(normal)


def test_what_a_mirror_shows(room):
    from reflect_addon.scene.pick import pick

    depsgraph = bpy.context.evaluated_depsgraph_get()
    direction, onward = mirrored((0.62, -0.75, 0.2))
    assert onward.x > 0.3
    place, name = pick(depsgraph, EYE, direction, {"Ball"})
    start = Vector((0.62, -0.75, 0.2)).normalized()
    wanted = start + onward * ((WALL - start.x) / onward.x)
    # The mesh has 96 sides, its normals are interpolated.
    assert name == "Ball" and np.linalg.norm(place - np.array(wanted)) < 0.05
    place, name = pick(depsgraph, EYE, direction, ())
    assert name == "" and np.linalg.norm(place) == pytest.approx(1.0, abs=2e-3)
    direction, onward = mirrored((-0.6, -0.75, 0.3))
    assert pick(depsgraph, EYE, direction, {"Ball"}) == (None, "Ball")
    assert pick(depsgraph, EYE, (0, -1, 0), {"Ball"}) == (None, "")


def test_polls(room):
    operator = bpy.ops.reflect.focus_here
    for reason in ("Choose a method", "Bake first"):
        assert not operator.poll()
        with pytest.raises(RuntimeError, match=reason):
            operator()
        room.reflect.method = "light_field"
    bake(room)
    bpy.ops.reflect.refresh()
    assert operator.poll()


def test_a_click_becomes_the_focus(room):
    bake(room)
    bpy.ops.reflect.refresh()
    bpy.ops.ed.undo_push(message="before")
    direction, _ = mirrored((0.62, -0.75, 0.2))
    assert bpy.ops.reflect.focus_here("EXEC_DEFAULT", True, origin=EYE, direction=direction) == {"FINISHED"}
    assert room.reflect.focus_distance == pytest.approx(WALL - 0.5, abs=1e-3), "from the cell's middle to the wall"
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert scene.reflect.focus_distance == 0.0
    # A place that is seen directly.
    assert bpy.ops.reflect.focus_here(origin=(0, 0, 5), direction=(1, 0, -0.5)) == {"FINISHED"}
    assert scene.reflect.focus_distance == pytest.approx(WALL - 0.5, abs=1e-3)


def test_a_miss_says_so_and_changes_nothing(room, capfd):
    bake(room)
    bpy.ops.reflect.refresh()
    room.reflect.focus_distance = 2.0
    for origin, direction, said in ((EYE, (0, -1, 0), "Nothing is there"), (EYE, mirrored((-0.6, -0.75, 0.3))[0], "In Ball the sky")):
        assert bpy.ops.reflect.focus_here(origin=origin, direction=direction) == {"CANCELLED"}
        assert said in capfd.readouterr().out
    assert room.reflect.focus_distance == 2.0


def test_the_shown_assets_follow_the_slider(room):
    from reflect_addon.scene import live

    bake(room)
    bpy.ops.reflect.refresh()
    state = live.of(room)
    automatic, near = state.shown(0.0), state.shown(2.0)
    assert automatic["Ball"] is state.joined()["Ball"] and near["Ball"].uniforms["focus"] == pytest.approx((1 / 3.5, 1 / 3, 1 / 3))
    assert state.shown(2.0)["Ball"] is near["Ball"], "the same for the same distance: nothing is drawn anew"
