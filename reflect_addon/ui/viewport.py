"""Hands what the window knows (scene/live.py) to what draws it (gpu/viewport.py). The gpu package is imported when the
first scene has something to show, not before."""

import bpy

from ..core.look import Look
from ..scene import live
from ..scene.look import read_look

_looks: dict[int, Look] = {}  # by scene: reading one takes 0.3 s, and most changes leave it as it is
_drawing = None  # gpu/viewport.py once it was needed


def register() -> None:
    live.display = _display


def unregister() -> None:
    global _drawing
    live.display = None
    _looks.clear()
    if _drawing is not None:
        _drawing.stop()
        _drawing = None


def counts(scene: bpy.types.Scene) -> dict[str, int]:
    """Work that the viewports did for a scene: gpu/counts.py."""
    return _drawing.counts(scene.session_uid) if _drawing else {}


def _display(scene: bpy.types.Scene, state: live.Live) -> None:
    uid = scene.session_uid
    joined = state.joined()
    if not live.is_on(scene) or state.snapshot is None or not joined:
        if _drawing is not None:
            _drawing.withdraw(uid)
        return
    drawing = _start()
    _looks[uid] = read_look(scene, _looks.get(uid))
    drawing.offer(uid, drawing.Offer(state.snapshot, joined, _looks[uid], scene.reflect.half_distance or None))


def _start():
    global _drawing
    if _drawing is None:
        from ..gpu import viewport

        viewport.start(_report)
        _drawing = viewport
    return _drawing


def _report(uid: int, message: str) -> None:
    """From the draw callback: remembered for the panel, which is drawn again later."""
    state = live.of_uid(uid)
    if state.draw_error != message:
        state.draw_error = message
        bpy.app.timers.register(live.redraw_panels, first_interval=0.0)
