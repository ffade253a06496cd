"""Runs inside a real Blender window: a ball in the room of native_room.py with its lantern, judged by mouse: the map of errors, and what it does when the view,
the scene and the method change; a wipe against another method and against the truth; outlines of stand-ins; see artist.py."""

import subprocess
import sys
import time
from pathlib import Path

import bpy
import numpy as np
from desktop import view3d
from mathutils import Euler

sys.path.insert(0, str(Path(__file__).parent))
from artist import bake, changed, key, part, picture, press, results, run, scene, state, watched  # noqa: E402
from native_room import NEAR, add_lantern, entered  # noqa: E402

REST = 20.0  # s for a map; a shared processor that draws by software too
TRACED = 120.0  # s for a truth
UNLIKE = 0.2  # share of pixels in which the box and the truth differ clearly: borders of squares, and the lantern
FEW = 0.004  # share of pixels: the mouse


def aside(seconds=2.0):
    """The mouse away from buttons, whose tooltips would be in the picture, and time to draw."""
    for x in ("620", "400", "120", "110"):  # leaves the button step by step: a tooltip is closed by a move that it sees
        subprocess.run(["xdotool", "mousemove", x, "420"], check=True)
        yield 0.2
    yield seconds


def view_heat():
    """The window's map of errors."""
    *_, region, _space = view3d()
    return part("gpu.session").session(scene().name).heats.get(region.as_pointer())


def measured(name):
    """Waits until all is measured; the picture."""
    for _ in range(int(REST / 0.25)):
        yield 0.25
        if (heat := view_heat()) is not None and heat.settled:
            break
    assert heat.settled and heat.heat is not None, "nothing was measured"
    yield from aside()
    seen = heat.heat.seen
    results.setdefault("errors", {})[name] = {"mean": round(heat.heat.mean, 3), "p95": round(seen.p95, 3), "wrong": round(seen.wrong, 4)}
    return picture(name)


def in_colours(seen, ball):
    """Share of the ball's pixels that have a colour of the scale."""
    colors = part("core.planning.heat_colors")
    scale = 255 * colors.color_at(np.linspace(0, 1, 91))
    return round(float((np.abs(seen[ball][:, None] - scale).max(-1).min(-1) <= NEAR).mean()), 3)


def story():
    ball = yield from entered(add_lantern)
    *_, area, _region, space = view3d()
    space.overlay.show_overlays = True
    for method in ("box_proxy", "environment"):
        scene().reflect.method = method
        yield from bake()
    yield 1.0
    plain = picture("02-plain")
    yield from press("reflect.shows_error")
    assert scene().reflect.shows_error
    yield from watched("measuring", seconds=3.0)
    seen = yield from measured("03-environment")
    results["in colours"] = {"plain": in_colours(plain, ball), "error": in_colours(seen, ball)}
    assert in_colours(seen, ball) > 0.85 > 0.3 > in_colours(plain, ball), results["in colours"]
    space.region_3d.view_camera_zoom += 4
    area.tag_redraw()
    yield 0.2
    assert view_heat().heat is None, "dropped with the view"
    yield from measured("04-nearer")
    space.region_3d.view_camera_zoom -= 4
    bpy.data.objects["Lantern"].location.x += 0.3
    yield 1.0
    yield from measured("05-moved")
    scene().reflect.method = "box_proxy"
    yield 1.0
    yield from measured("06-box")
    errors = results["errors"]
    assert errors["06-box"]["mean"] < errors["03-environment"]["mean"]
    yield from press("reflect.shows_error")
    yield from aside()
    assert not view_heat() and in_colours(picture("07-off"), ball) < 0.3
    yield from wiped(area, ball)
    yield from outlined(space)


def at(area, share):
    """A place in the viewport, as a share of its width, in the window's pixels from above."""
    window, *_ = view3d()
    region = next(r for r in area.regions if r.type == "WINDOW")
    return str(region.x + round(share * region.width)), str(window.height - region.y - region.height // 2)


def wiped(area, ball):
    """The environment map beside the box: the line is dragged, and Esc ends it."""
    box = picture("08-box")
    scene().reflect.method = "environment"
    yield from aside(4.0)
    environment = picture("09-environment")
    scene().reflect.method, scene().reflect.against = "box_proxy", "environment"
    yield from aside(4.0)
    yield from press("reflect.wipe")
    yield from aside(4.0)
    for name, share in (("10-wiped-right", 0.55), ("11-wiped-left", 0.4)):
        subprocess.run(["xdotool", "mousemove", *at(area, 0.5), "mousedown", "1"], check=True)
        yield 0.5
        subprocess.run(["xdotool", "mousemove", *at(area, share)], check=True)
        yield 0.5
        subprocess.run(["xdotool", "mouseup", "1"], check=True)
        yield 1.0
        assert abs(state().wipe.place - share) < 0.01
        seen = picture(name)
        column = int(at(area, share)[0]) - area.x - 60
        sides = {side: [round(changed(seen[:-60, part], one[:-60, part]), 4) for one in (box, environment)]
                 for side, part in (("left", np.s_[: column - 4]), ("right", np.s_[column + 4 :]))}  # fmt: skip
        results.setdefault("wiped", {})[name] = sides
        assert sides["left"][0] < FEW < sides["left"][1] and sides["right"][1] < FEW < sides["right"][0], sides
    yield from key("Escape")
    assert state().wipe is None and changed(picture("12-ended"), box) < FEW
    yield from against_the_truth(area, box)


def against_the_truth(area, box):
    """The box is nearly right here: what another process traces looks like it. From elsewhere there is no truth."""
    scene().reflect.against = "TRUTH"
    yield from aside()
    clicked = yield from press("reflect.wipe")
    yield from aside(0.1)
    picture("12-tracing")
    while state().wipe is None:
        yield 0.2
        assert time.monotonic() - clicked < TRACED, "no truth came"
    results["seconds"]["truth"] = round(time.monotonic() - clicked, 1)
    yield from aside(3.0)
    seen = picture("12-truth")
    column = int(at(area, 0.5)[0]) - area.x - 60
    right, same = np.s_[:-60, column + 4 :], lambda one: round(float((np.abs(one - box)[right].max(-1) > 40).mean()), 4)
    results["truth"] = {"differs": same(seen)}
    assert 0 < same(seen) < UNLIKE, results["truth"]
    *_, space = view3d()
    space.region_3d.view_camera_zoom += 4
    yield from aside()
    picture("12-truth-elsewhere")
    space.region_3d.view_camera_zoom -= 4
    yield from key("Escape")
    assert state().wipe is None and changed(picture("12-truth-ended"), box) < FEW


def outlined(space):
    """What stands for the room in the ball, of three methods, seen from outside; off it is gone."""
    view = space.region_3d
    view.view_perspective, view.view_distance = "PERSP", 9.0
    view.view_location = (1.0, 0, 0)
    view.view_rotation = (Euler((1.25, 0.0, 0.35))).to_quaternion()
    space.shading.show_backface_culling = True  # of the room, to look into it
    bpy.context.view_layer.objects.active = bpy.data.objects["Ball"]
    for number, method in ((13, "box_proxy"), (15, "depth_maps"), (17, "light_field")):
        scene().reflect.method = method
        if method not in state().baked or state().compared.missing:
            yield from bake()
        if method == "box_proxy":
            yield from aside(4.0)
            plain = picture("13-outside")
            yield from press("reflect.shows_outlines")
        yield from aside(4.0)
        seen = picture(f"{number + 1}-outlined-{method}")
        results.setdefault("outlined", {})[method] = round(changed(seen, plain), 4)
        assert changed(seen, plain) > FEW and not state().draw_error(), state().draw_error()
    bpy.context.view_layer.objects.active = bpy.data.objects["Lantern"]
    yield 2.0
    scene().reflect.method = "box_proxy"
    yield from aside(4.0)
    assert changed(picture("19-none"), plain) < FEW




run(story)
