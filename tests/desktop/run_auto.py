"""Runs inside a real Blender window: Auto by mouse, in the room of native_room.py: a preset, the bake, the plan's table, a lock, a row, a choice
by hand, the materials, a sheet that gets a mirrored view; see artist.py."""

import sys
from pathlib import Path

import bpy
from desktop import view3d

sys.path.insert(0, str(Path(__file__).parent))
from artist import bake, picture, press, results, run, scene, state  # noqa: E402
from native_room import behind_in, entered, settled  # noqa: E402


def story():
    ball = yield from entered()
    *_, space = view3d()
    scene().reflect.method = "auto"
    scene().reflect.auto.tolerance = 3.0
    yield 1.0
    picture("02-chosen")
    yield from press("reflect.plan_preset")
    assert scene().reflect.auto.tolerance == 1.0, "Balanced, the preset in the middle"
    yield from bake()
    picture("03-plan")
    (row,) = state().loaded.plan.rows
    results["plan"] = {"method": row.method, "promised": row.promised, "measured": row.measured, "reason": row.reason, "seconds": state().loaded.plan.seconds}
    assert row.reflector == "Ball" and 0 <= row.measured <= 1.0 and not state().compared.other_settings and not state().compared.missing

    space.shading.type, space.overlay.show_overlays = "MATERIAL", True
    yield from settled("04-shown", ball, behind_in(ball, True))
    yield from press("reflect.plan_lock")
    scene().reflect.auto.tolerance = 90.0
    yield from bake()
    assert [one.method for one in state().loaded.plan.rows] == [row.method] and not state().compared.other_settings
    picture("05-locked")
    yield from press("reflect.plan_lock")
    assert scene().objects["Ball"].reflect_stand_in == "AUTO" and state().compared.other_settings == ("Ball",)
    scene().reflect.auto.tolerance = 1.0
    yield from bake()
    yield from press("reflect.plan_row")
    assert bpy.context.view_layer.objects.active.name == "Ball"
    scene().objects["Ball"].reflect_stand_in = "environment"
    yield 1.0
    assert state().compared.other_settings == ("Ball",)
    picture("05-by-hand")
    yield from bake()
    assert [row.method for row in state().loaded.plan.rows] == ["environment"] and not state().compared.other_settings
    scene().objects["Ball"].reflect_stand_in = "AUTO"
    yield from bake()
    assert [one.method for one in state().loaded.plan.rows] == [row.method]

    yield from press("reflect.use_in_materials")
    space.overlay.show_overlays = False
    yield from settled("06-used", ball, behind_in(ball, True))
    yield from press("reflect.remove_from_materials")
    yield from settled("07-removed", ball, behind_in(ball, False))
    assert not state().draw_error() and not state().stale

    space.shading.type, space.overlay.show_overlays = "SOLID", True
    bpy.ops.mesh.primitive_plane_add(size=1.2, location=(-0.75, 0.9, -0.5), rotation=(1.3, 0, 0.5))
    bpy.context.object.name = "Sheet"
    bpy.context.object.data.materials.append(bpy.data.materials["Metal"])
    scene().reflect.auto.tolerance = 0.01
    yield 1.0
    yield from bake()
    rows = {row.reflector: row.method for row in state().loaded.plan.rows}
    assert rows["Sheet"] == "recursive" and rows["Ball"] != "recursive" and state().surfaces is not None, rows
    yield 2.0
    picture("08-view")
    assert not state().draw_error() and not state().stale and not state().compared.missing


run(story)
