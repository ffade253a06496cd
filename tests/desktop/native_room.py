"""The room of sessions with native reflections, and how they wait until a view of it is drawn; see run_native.py, run_native_methods.py.

The scene is made here: a metal ball in a room of glowing checkers, the wall behind the eye in colours that nothing else has. Where
they are seen, the ball mirrors the room; EEVEE by itself would show its world, and the studio in Material Preview. Nothing in it is
black, and nothing has the pink of a shader that failed.
"""

import sys
import time
from pathlib import Path

import bpy
import numpy as np
from desktop import view3d

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[2])]
from artist import OUT, arrange, changed, encoded, install, picture, press, results, scene, set_small  # noqa: E402

from sample_blends.scene_parts import box, camera, checker, material, mirror, prepare, set_world, sphere  # noqa: E402

NEAR = 8  # of 255: half floats and a filtered cube map of few texels
ROOM = ((0.8, 0.1, 0.1), (0.5, 0.5, 0.5))  # colours of five walls
BEHIND = ((0.9, 0.8, 0.05), (0.05, 0.7, 0.6))  # and of the wall behind the eye
WORLD = (0.05, 0.05, 0.8)  # outside the room: what EEVEE mirrors by itself
FAILED, EMPTY = (1.0, 0.0, 1.0), (0.0, 0.0, 0.0)  # a shader that did not compile, anywhere, and one that answers nothing, on the ball: elsewhere Blender's own lines are black
FEW = 1e-3  # share of pixels with such a colour: none were seen
MIRRORED = 0.27  # share of the ball's pixels in the colours of the wall behind or between them: it covers 0.30 (by geometry); 0.0 without
BETWEEN = 33  # blends of two colours that stand for all: a light field's squares have soft borders
METHODS = ("depth_maps", "billboards", "light_field")
LIGHT = (0.1, 0.9, 0.1)  # the lantern's, which nothing else has
PLACES = {1: (-1.1, -0.7, 0.9), 11: (-1.1, -0.7, -0.9)}  # m, at the first and the last frame: above and below, on the side without the sidebar
SEEN = 0.01  # share of the ball's pixels that mirror the lantern: 0.0 without
PATIENCE = 180.0  # s for shaders, which compile on the processor that draws
STILL = 0.002  # share of pixels that change while a view is drawn no more


def glowing(name, colors):
    """A checker that glows and reflects nothing."""
    made = checker(name, *colors, 0.5)
    tree = made.node_tree
    shader = tree.nodes["Principled BSDF"]
    tree.links.new(shader.inputs["Base Color"].links[0].from_socket, shader.inputs["Emission Color"])
    tree.links.remove(shader.inputs["Base Color"].links[0])
    shader.inputs["Base Color"].default_value, shader.inputs["Emission Strength"].default_value = (0, 0, 0, 1), 1.0
    return made


def build():
    bpy.data.batch_remove([*bpy.data.objects, *bpy.data.materials, *bpy.data.meshes])
    prepare(scene(), "Room")
    set_world(scene(), WORLD)
    room = box("Room", (3, 3, 3), (0, 0, 0), glowing("Walls", ROOM), inside=True)
    room.data.materials.append(glowing("Wall behind", BEHIND))
    next(p for p in room.data.polygons if p.center.y < -1).material_index = 1
    sphere("Ball", 0.6, mirror("Metal", (1, 1, 1)), 48, location=(0.1, 0.2, -0.1))
    camera((0, -1.4, 0), (0, 0, 0), 28.0).data.show_passepartout = False
    scene().view_settings.view_transform = "Standard"
    scene().eevee.taa_samples = 8


def add_lantern():
    """A glowing ball, a volume to the methods, that passes the mirror from frame to frame, outside the view."""
    lantern = sphere("Lantern", 0.3, material("Lantern", LIGHT, emission=1.0, Base_Color=(0, 0, 0, 1)), 24)
    for frame, place in PLACES.items():
        lantern.location = place
        lantern.keyframe_insert("location", frame=frame)
    scene().frame_end = max(PLACES)
    scene().frame_set(1)


def entered(more=lambda: None):
    """Installs, builds the room and what `more` puts into it, saves, and looks through the camera. Returns the ball's pixels."""
    install()
    yield 2.0
    build()
    more()
    bpy.ops.wm.save_mainfile()
    yield from arrange()
    set_small()
    *_, space = view3d()
    scene().render.engine = "BLENDER_EEVEE"
    space.overlay.show_overlays = False
    space.shading.light, space.shading.color_type, space.shading.show_object_outline = "FLAT", "MATERIAL", False
    yield 1.0
    ball = near(picture("01-solid"), [(1, 1, 1)])
    results["ball"] = round(float(ball.mean()), 3)
    return ball


def near(pixels, colors):
    """Which pixels have one of the colours."""
    return np.any([np.abs(pixels - encoded(c)).max(-1) <= NEAR for c in colors], axis=0)


def behind_in(ball, mirrors):
    """For `settled`: whether the ball mirrors the wall behind the eye, or does not."""
    colors = np.linspace(*BEHIND, BETWEEN)

    def looks(seen):
        share = float(near(seen, colors)[ball].mean())
        return mirrors == (share > MIRRORED), {"behind": round(share, 3)}

    return looks


def lantern_in(ball, side):
    """For `settled`: whether the ball mirrors the lantern above (-1) or below (1) its middle."""
    middle = np.nonzero(ball)[0].mean()

    def looks(seen):
        found = near(seen, [LIGHT]) & ball
        share = float(found.mean() / ball.mean())
        where = float(np.nonzero(found)[0].mean() - middle) if found.any() else 0.0
        return share > SEEN and where * side > 0, {"lantern": round(share, 3), "from the middle": round(where)}

    return looks


def settled(name, ball, looks, since=None):
    """Waits until the walls are drawn, two pictures a second apart agree, and the last is right: looks(picture) -> (whether, figures);
    notes how long that took, from `since` on, and the window's longest silence. ball: its pixels. Returns the last picture."""
    last = time.monotonic()
    start = since or last
    gap, before = last - start, None
    while True:
        for _ in range(20):
            yield 0.05
            now = time.monotonic()
            gap, last = max(gap, now - last), now
        seen = picture(name)
        walls = round(float(near(seen, ROOM)[~ball].mean()), 3)
        right, figures = looks(seen)
        if before is None:
            (OUT / f"{name}.png").rename(OUT / f"{name}-first.png")
        still = before is not None and changed(before, seen) < STILL
        if still and walls > 0.5 and right:
            break
        assert now - start < PATIENCE, f"{name} does not settle: {walls}, {figures}"
        before, last = seen, time.monotonic()
    failed = round(float(max(near(seen, [FAILED]).mean(), near(seen[ball], [EMPTY]).mean())), 4)
    view = {"seconds": round(time.monotonic() - start, 1), "silence": round(gap, 2), "walls": walls, "failed": failed, **figures}
    results.setdefault("views", {})[name] = view
    assert failed < FEW, (name, view)
    return seen


def use(method):
    """The method chosen and used; returns when the button was clicked."""
    scene().reflect.method = method
    yield 1.0
    return (yield from press("reflect.use_in_materials"))


def shown():
    """The method whose group the ball's material shows, "" without one."""
    tree = bpy.data.objects["Ball"].material_slots[0].material.node_tree
    names = [node.node_tree.name.split() for node in tree.nodes if node.type == "GROUP" and node.node_tree]
    return next((words[1] for words in names if words[0] == "Reflect" and words[1] in METHODS), "")
