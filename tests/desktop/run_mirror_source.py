"""Runs inside a real Blender window: a planar mirror shows the viewport's own shading (gpu/viewport_views.py); see artist.py. The sample is
contact.blend: a pane is added beside its things, and a box behind the pane, which it must not show.
"""

import os
import sys

import bpy
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from artist import (  # noqa: E402
    arrange, bake, changed, encoded, inside, install, part, picture, results, run, scene, set_small, state, watched,
)  # fmt: skip

NEAR = 6  # of 255: the mirror's picture is filtered once and passes half floats
FIRST, SECOND, BEHIND = (0.75, 0.26, 0.12), (0.1, 0.2, 0.85), (0.05, 0.9, 0.9)  # colours of the thing, then, and of the box


def add_mirror():
    """A pane with a perfect mirror's material that the camera sees the things in, in place of the mirror that is there, and a box close
    behind it."""
    bpy.data.objects.remove(bpy.data.objects["Suzanne mirror"])
    material = bpy.data.materials.new("Pane")
    principled = material.node_tree.nodes["Principled BSDF"].inputs
    principled["Base Color"].default_value, principled["Metallic"].default_value, principled["Roughness"].default_value = (1, 1, 1, 1), 1.0, 0.0
    inside(bpy.ops.mesh.primitive_plane_add, size=2.0, location=(-1.0, 1.0, 1.05), rotation=(np.pi / 2, 0, np.radians(30)))
    bpy.context.object.name = "Pane"
    bpy.context.object.data.materials.append(material)
    inside(bpy.ops.mesh.primitive_cube_add, size=0.6, location=(-1.3, 1.52, 1.0))
    bpy.context.object.name = "Box behind"
    behind = bpy.data.materials.new("Behind")
    behind.diffuse_color = (*BEHIND, 1)
    bpy.context.object.data.materials.append(behind)
    inside(bpy.ops.object.select_all, action="DESELECT")


def share(pixels, color, where):
    """Of the pixels where, those that have a colour."""
    return float((np.abs(pixels - encoded(color)).max(-1) <= NEAR)[where].mean())


def views():
    return part("gpu.session").session(scene().name).views


def drawn():
    return sum(v.drawn for v in views().values())


def shown():
    """Waits until the window shows what was asked for, however busy the machine is."""
    for _ in range(120):
        yield 0.5
        if views() and all(v.settled for v in views().values()):
            break
    yield 1.0


def rest(name):
    """Nothing is drawn any more: neither pictures of mirrors nor the window."""
    before = drawn()
    redraws = []
    handle = bpy.types.SpaceView3D.draw_handler_add(lambda: redraws.append(1), (), "WINDOW", "POST_VIEW")
    yield 2.0
    bpy.types.SpaceView3D.draw_handler_remove(handle, "WINDOW")
    results[f"redraws {name}"] = len(redraws)
    assert drawn() == before and len(redraws) <= 2, (name, drawn() - before, len(redraws))
    assert not state().draw_error(), state().draw_error()


def story():
    install()
    yield 2.0
    add_mirror()
    yield from arrange()
    set_small()
    settings, thing = scene().reflect, bpy.data.objects["Suzanne matt"]
    scene().view_settings.view_transform = "Standard"
    from desktop import view3d

    _window, _area, region, space = view3d()
    space.shading.light, space.shading.color_type, space.shading.show_object_outline = "FLAT", "MATERIAL", False
    material = thing.data.materials[0]
    material.diffuse_color = (*FIRST, 1)
    settings.recursive.depth = 1
    yield 2.0
    off = picture("01-opened")
    settings.method = "recursive"
    yield from bake()
    yield 3.0
    assert not state().draw_error(), state().draw_error()
    surfaces = picture("02-surfaces")
    pane = np.abs(surfaces - off).max(-1) > 2 * NEAR
    assert share(surfaces, FIRST, pane) < 0.01, "surface radiance is not the flat colour of the viewport"
    undo = len(bpy.context.window_manager.operators)
    yield from watched("switch", lambda: setattr(settings, "source", "VIEWPORT"), 4.0)
    yield from shown()
    live = picture("03-viewport")
    results["pictures"], results["seconds a picture"] = drawn(), [round(v.seconds, 3) for v in views().values()]
    results["share"] = {"first": share(live, FIRST, pane), "behind": share(live, BEHIND, pane), "outside": share(live, FIRST, ~pane)}
    assert results["share"]["first"] > 0.02 and results["share"]["behind"] < 1e-3, results["share"]
    yield from rest("at rest")

    # The material's colour changes: in the mirror too.
    yield from watched("colour", lambda: setattr(material, "diffuse_color", (*SECOND, 1)), 4.0)
    yield from shown()
    recoloured = picture("04-recoloured")
    results["share recoloured"] = share(recoloured, SECOND, pane)
    assert abs(results["share recoloured"] - results["share"]["first"]) < 0.005 and share(recoloured, FIRST, pane) < 1e-3
    yield from rest("recoloured")

    # The eye moves, and comes back.
    place = scene().camera.location.copy()
    yield from watched("move", lambda: setattr(scene().camera, "location", place + scene().camera.location * 0.05), 4.0)
    yield from shown()
    moved = picture("05-moved")
    assert changed(recoloured, moved) > 0.02
    yield from watched("back", lambda: setattr(scene().camera, "location", place), 4.0)
    yield from shown()
    results["back differs"] = changed(recoloured, picture("06-back"))
    assert results["back differs"] < 0.002
    yield from rest("back")

    # Nothing of the user's is changed, and surface radiance is what it was.
    assert space.overlay.show_overlays and len(bpy.context.window_manager.operators) == undo
    material.diffuse_color = (*FIRST, 1)
    yield from watched("switch back", lambda: setattr(settings, "source", "SURFACES"), 3.0)
    results["surfaces differ"] = changed(surfaces, picture("07-surfaces-again"))
    assert results["surfaces differ"] < 0.002 and not views()


run(story)
