"""Bakes old reflections again by itself, as the scene's `refresh` says: one reflector after the other, those that are wrong most first.

It is the Bake operator that bakes, so that progress and Esc are as ever. A change of the scene stops a bake that it began; what failed, was stopped by
hand or is old still after it was tried again is left alone until the scene changes.
"""

import time
from dataclasses import dataclass, field

import bpy

from ..core import methods
from ..core.errors import Cancelled
from ..core.refresh import Refresh, next_one
from ..scene import live
from ..scene.fingerprint import quiet_state
from ..scene.worker import Worker
from . import bake

INTERVAL = 0.5  # s between looks
# s without a change of what assets depend on before a bake is begun; at once means: not while something is being dragged.
QUIET = {"IDLE": 5.0, "LIVE": 0.5}


@dataclass
class Keeper:
    """What is kept in mind of one scene between looks."""

    content: str = ""  # what assets depend on, as it was when the next two began
    tried: set[str] = field(default_factory=set)  # reflectors
    spent: float = 0.0  # s of baking
    worker: Worker | None = None  # of a bake that was begun here
    began: float = 0.0  # time.monotonic() of that
    quiet: str = ""  # what no handler tells of

    def next(self, scene: bpy.types.Scene, now: float) -> str | None:
        """The reflector to bake for, "" for all of them, or None: nothing is to be begun now. May stop the bake that it began before."""
        if not live.is_on(scene):
            return None
        state, policy = live.of(scene), scene.reflect.refresh
        if (quiet := quiet_state(scene)) != self.quiet:
            self.quiet = quiet
            live.note_change(scene)
        if state.changed:
            return None  # what changed is read first
        content = state.content() + quiet
        if self.worker is not None:
            if self.worker.state.running:
                if content != self.content or policy == "NEVER":
                    self.worker.cancel()
                return None
            self.spent += now - self.began
            if isinstance(self.worker.state.error, Cancelled):  # by hand, unless the scene changed as well
                self.tried |= set(state.compared.refreshes)
            self.worker = None
        if content != self.content:
            self.content, self.tried, self.spent = content, set(), 0.0
        if policy == "NEVER" or bake.running() is not None or now - state.settled < QUIET[policy]:
            return None
        left = [one for name, one in state.compared.refreshes.items() if name not in self.tried]
        if left and (scene.reflect.method == methods.AUTO or any(reflector == "" for _, reflector in state.assets)):  # one plan or asset is for all
            left = [Refresh("", (), sum(one.seconds for one in left), max(one.error for one in left))]
        one = next_one(left, policy, scene.reflect.refresh_seconds, self.spent)
        if one is None:
            return None
        self.tried |= {one.reflector} if one.reflector else set(state.compared.refreshes)
        return one.reflector

    def bake(self, scene: bpy.types.Scene, name: str, now: float) -> None:
        """Starts the Bake operator for next()'s answer. What keeps it from starting the sidebar shows."""
        try:
            bpy.ops.reflect.bake("INVOKE_DEFAULT", only=name)
        except RuntimeError as error:
            live.of(scene).bake_error = live.of(scene).bake_error or str(error)
        self.worker, self.began = bake.running(), now


_keepers: dict[int, Keeper] = {}  # by the scene's session_uid


def look() -> float:
    """Looks at the scenes of all windows; a timer's function."""
    for window in bpy.context.window_manager.windows:
        scene = window.scene
        keeper = _keepers.setdefault(scene.session_uid, Keeper())
        if window.screen.is_animation_playing:
            continue
        now = time.monotonic()
        name = keeper.next(scene, now)
        if name is not None:
            with bpy.context.temp_override(window=window):
                keeper.bake(scene, name, now)
    return INTERVAL


def register() -> None:
    if not bpy.app.background:
        bpy.app.timers.register(look, first_interval=INTERVAL, persistent=True)


def unregister() -> None:
    _keepers.clear()
    if bpy.app.timers.is_registered(look):
        bpy.app.timers.unregister(look)
