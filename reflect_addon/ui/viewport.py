"""Hands what the window knows (scene/live.py) to what draws it (gpu/session.py, gpu/handler.py).

Registered only where there is a window, and before scene/handlers.py: after a file was opened the drawing side forgets
its scenes first, then the new ones are handed over.
"""

import bpy

from ..gpu import handler, session
from ..scene import live
from ..scene.look import read_look
from . import mirror_source


def register() -> None:
    handler.register()
    live.display = _display


def unregister() -> None:
    live.display = None
    handler.unregister()


PREPARING = "Reflect: preparing the reflections"
SHOWN = 0.3  # s: longer than from a text to the walk that the drawing follows


def _display(scene: bpy.types.Scene, state: live.Live) -> None:
    joined = state.shown(scene.reflect.focus_distance)
    if not joined:
        session.set_session(scene.name, None)
        return
    found = session.session(scene.name)
    if found is None:
        found = _new_session(scene)
        session.set_session(scene.name, found)
    found.attenuation = scene.reflect.half_distance or None
    found.background = scene.reflect.background
    found.shows_error = scene.reflect.shows_error
    found.shows_outlines = scene.reflect.shows_outlines
    found.mirrors_viewport = mirror_source.is_viewport(scene.reflect)
    others = found.shows_others(state.method, joined) or (state.wipe is not None and state.wipe is not found.wipe)
    found.set_wipe(state.wipe)
    found.set_assets(state.method, joined, state.surfaces)
    state.draw_error, state.heat_of = lambda: found.message or (found.other.message if found.other else ""), lambda region: found.heats.get(region)
    if others:
        # The driver may compile for seconds, in the first draw: the window says so before it stands still.
        _say(PREPARING)
        handler.refresh_soon()
        bpy.app.timers.register(lambda: _say(None), first_interval=SHOWN)
    else:
        found.refresh()


def _say(text: str | None) -> None:
    """In the status bar; None: as usual."""
    for window in bpy.context.window_manager.windows:
        window.workspace.status_text_set(text)


def _new_session(scene: bpy.types.Scene) -> session.ViewportSession:
    """It outlives undo, which replaces the scene's data: so it keeps names and numbers, no scene."""
    uid, name = scene.session_uid, scene.name
    return session.ViewportSession(
        snapshot_of=lambda: live.of_uid(uid).snapshot, look_of=lambda last: read_look(bpy.data.scenes[name], last)
    )
