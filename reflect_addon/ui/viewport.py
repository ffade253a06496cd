"""Hands what the window knows (scene/live.py) to what draws it (gpu/session.py, gpu/handler.py).

Registered only where there is a window, and before scene/handlers.py: after a file was opened the drawing side forgets
its scenes first, then the new ones are handed over.
"""

import bpy

from ..gpu import handler, session
from ..scene import live
from ..scene.look import read_look


def register() -> None:
    handler.register()
    live.display = _display


def unregister() -> None:
    live.display = None
    handler.unregister()


def _display(scene: bpy.types.Scene, state: live.Live) -> None:
    joined = state.joined()
    if not joined:
        session.set_session(scene.name, None)
        return
    found = session.session(scene.name)
    if found is None:
        found = _new_session(scene)
        session.set_session(scene.name, found)
    found.attenuation = scene.reflect.half_distance or None
    found.set_assets(state.method, joined, state.surfaces)
    found.refresh()
    state.draw_error = lambda: found.message


def _new_session(scene: bpy.types.Scene) -> session.ViewportSession:
    """It outlives undo, which replaces the scene's data: so it keeps names and numbers, no scene."""
    uid, name = scene.session_uid, scene.name
    return session.ViewportSession(
        snapshot_of=lambda: live.of_uid(uid).snapshot, look_of=lambda last: read_look(bpy.data.scenes[name], last)
    )
