"""What this window knows of each scene: its reflectors, its loaded assets, what is stale, what went wrong.

Panels read it and compute nothing. Whatever changes in the scene only sets a flag (scene/handlers.py); the flag is
answered later, by a timer, once for many changes, and only for scenes that show reflections. Reading the scene takes
milliseconds to seconds, so the waiting time grows with what the last reading took.
"""

import time
from collections.abc import Callable
from pathlib import Path

import bpy

from ..core import methods
from ..core.asset import Asset
from ..core.asset_places import asset_name, scene_folder
from ..core.errors import ReflectError
from ..core.refresh import balls_of
from ..core.snapshot import SceneSnapshot
from .compared import Compared, compare
from .freshness import items_now, remembering
from .joined import Joined
from .loaded import Loaded, load
from .places import adopt_unsaved, assets_of, user_folder
from .snapshot import take_snapshot
from .wipe import Wipe, baked_methods

SOONEST = 0.02  # s from a change to the next reading of the scene
SHARE = 2.0  # times the last reading's duration: at most a third of the window's time goes into reading

# Shows a scene in the viewports: set by register() where there is a window (gpu/handler.py), None elsewhere.
# display(scene, live) is called when anything but the camera changed.
display: Callable[[bpy.types.Scene, "Live"], None] | None = None


class Live:
    """The state of one scene in this window."""

    def __init__(self):
        self.snapshot: SceneSnapshot | None = None
        self.changed = True  # the scene differs from the snapshot, as far as is known
        self.read_seconds = 0.0
        self.folder: Path | None = None  # of the scene's assets
        self.baked: tuple[str, ...] = ()  # methods that have assets there
        self.wipe: Wipe | None = None  # another method beside the scene's own
        self._seen: dict[str, Asset] = {}  # asset's inputs hash -> the asset as if it were made of what the window saw when its bake started
        self.settled = 0.0  # time.monotonic() of the last reading that found other content than the one before
        self.compared = Compared()
        self._take(Loaded())
        self.bake_error = ""
        self.read_error = ""
        self.draw_error: Callable[[], str] = str  # why the viewport stopped drawing, "" while all is well
        self.heat_of: Callable[[int], object | None] = lambda region: None  # the map of errors (gpu/heat.py) of a 3D view, by its region's address

    def _take(self, loaded: Loaded) -> None:
        self.loaded = loaded
        self.problems: tuple[str, ...] = loaded.problems  # assets that could not be loaded, or joined
        self._joined = Joined(loaded, self._problem)

    def _problem(self, sentence: str) -> None:
        self.problems += (sentence,)

    @property
    def stale(self) -> tuple[str, ...]:
        """Reflectors whose assets were baked from another state of the scene."""
        return tuple(self.compared.refreshes)

    def has_nothing_to_bake(self) -> bool:
        """Known to have no reflector; False while nothing is known."""
        return self.snapshot is not None and not self.changed and not self.snapshot.reflectors()

    def bytes(self) -> int:
        """Memory of the loaded assets on the GPU."""
        return sum(asset.bytes() for asset in self.assets.values())

    def look(self, scene: bpy.types.Scene) -> None:
        """Reads the scene again."""
        start, before = time.perf_counter(), self.content()
        try:
            self.snapshot = take_snapshot(depsgraph_of(scene))
            self.read_error = ""
        except ReflectError as error:
            self.snapshot, self.read_error = None, str(error)
        self.changed = False
        self.read_seconds = time.perf_counter() - start
        if self.content() != before:
            self.settled = time.monotonic()
        self._compare(scene)
        self.show(scene)

    def content(self) -> str:
        """A hash of all that assets depend on, as it was last read: no camera, nothing that renders do not show."""
        return self.snapshot.geometry_hash if self.snapshot else ""

    def reload(self, scene: bpy.types.Scene) -> None:
        """Loads the assets of the scene's method again; reads the scene when that was never done."""
        self.folder = assets_of(scene)
        self._take(load(scene.reflect.method, self.folder) if is_on(scene) else Loaded(scene.reflect.method))
        self.baked = tuple(baked_methods(self.folder))
        if not is_on(scene):
            self.wipe = None
        if self.changed and is_on(scene):
            self.look(scene)
        else:
            self._compare(scene)
            self.show(scene)

    def follow(self, scene: bpy.types.Scene) -> None:
        """The file was saved, perhaps elsewhere: its assets are looked for there. After the first save of a new file
        what was baked before comes along."""
        if self.folder == assets_of(scene):
            return
        baked_before_the_first_save = self.folder == scene_folder(None, scene.name, user_folder()) and bool(self.assets)
        try:
            if baked_before_the_first_save:
                adopt_unsaved(scene)
        except ReflectError as error:
            self.bake_error = str(error)
        self.reload(scene)

    def show(self, scene: bpy.types.Scene) -> None:
        """Hands the state to the viewports."""
        if display is not None:
            display(scene, self)
        redraw_panels()

    def settings_changed(self, scene: bpy.types.Scene) -> None:
        """A setting of a method was changed: what was baked stays to be seen, marked where it was baked with another, and is drawn as is
        asked for now."""
        before = self.joined()
        self._compare(scene)
        after = self.joined()
        if before.keys() != after.keys() or any(before[name] is not after[name] for name in after):
            self.show(scene)
        redraw_panels()

    def _compare(self, scene: bpy.types.Scene) -> None:
        """Which reflectors have no assets, or old ones."""
        on = is_on(scene)
        self._joined.ask(scene.reflect.bake_settings() if on else {})
        known = on and self.snapshot is not None
        self.compared = compare(scene, self.snapshot, self.loaded, self._joined.asked, self._as_seen) if known else Compared()

    def _as_seen(self, asset: Asset) -> Asset:
        """A bake reads the scene as renders see it, the window as viewports do (other subdivision levels, say): what
        this window baked itself is compared with what the window saw when it started that bake."""
        return self._seen.get(asset.inputs_hash, asset)

    def bake_starts(self, scene: bpy.types.Scene) -> SceneSnapshot | None:
        """What is baked now, as the window sees it; None when the scene cannot be read."""
        if self.changed:
            self.look(scene)
        return self.snapshot

    def bake_ended(self, scene: bpy.types.Scene, folders: tuple[str, ...], seen: SceneSnapshot | None) -> None:
        """Loads what a bake wrote that started when the window saw `seen`."""
        self.reload(scene)
        balls = balls_of(seen) if seen else {}
        for (kind, reflector), asset in self.assets.items():
            if seen is not None and str(self.loaded.folder / asset_name(kind, reflector)) in folders:
                required = [self.asset(name, reflector) for name in methods.get(kind).REQUIRES]
                self._seen[asset.inputs_hash] = remembering(asset, seen, items_now(seen, asset, filter(None, required)), balls)
        self._compare(scene)

    def joined(self) -> dict[str, Asset]:
        """Per reflector the method's asset with what it requires; without those that are not baked. The same objects while nothing changes."""
        return {} if self.snapshot is None else self._joined.of(self.snapshot.reflectors())

    def shown(self, focus_distance: float) -> dict[str, Asset]:
        """`joined`, focused on a distance (core/focus.py)."""
        return {} if self.snapshot is None else self._joined.focused(self.snapshot.reflectors(), focus_distance)

    def asset(self, kind: str, reflector: str) -> Asset | None:
        """The asset for a reflector: its own, or the one of all reflectors."""
        return self.loaded.asset(kind, reflector)

    @property
    def method(self) -> str:
        """Whose assets are loaded."""
        return self.loaded.method

    @property
    def assets(self) -> dict[tuple[str, str], Asset]:
        """By (kind, reflector)."""
        return self.loaded.assets

    @property
    def surfaces(self) -> Asset | None:
        """The scene's surface radiance, from which stand-ins follow what moves."""
        return self.loaded.surfaces


_scenes: dict[int, Live] = {}  # by session_uid, which undo keeps and a rename too


def is_on(scene: bpy.types.Scene) -> bool:
    """Does the scene show a method's reflections? ("" is a method that this version does not know.)"""
    return scene.reflect.method not in ("", "OFF")


def of(scene: bpy.types.Scene) -> Live:
    """The state of a scene; a new one, knowing nothing, when it was never asked for."""
    return of_uid(scene.session_uid)


def of_uid(uid: int) -> Live:
    """The same by the scene's session_uid, for those who must not hold a scene."""
    return _scenes.setdefault(uid, Live())


def forget() -> None:
    """Another file was opened, or the add-on is switched off."""
    _scenes.clear()
    if bpy.app.timers.is_registered(_answer_changes):
        bpy.app.timers.unregister(_answer_changes)


def note_change(scene: bpy.types.Scene) -> None:
    """Something that reflections depend on changed; cheap enough for every depsgraph update."""
    live = of(scene)
    live.changed = True
    if is_on(scene) and not bpy.app.background and not bpy.app.timers.is_registered(_answer_changes):
        bpy.app.timers.register(_answer_changes, first_interval=max(SOONEST, SHARE * live.read_seconds))


def depsgraph_of(scene: bpy.types.Scene) -> bpy.types.Depsgraph:
    """The evaluated scene: as its window shows it, or its first view layer's."""
    if bpy.context.scene == scene:
        return bpy.context.evaluated_depsgraph_get()
    depsgraph = scene.view_layers[0].depsgraph
    depsgraph.update()
    return depsgraph


def redraw_panels() -> None:
    """Draws all 3D viewports and their sidebars again."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def _answer_changes() -> None:
    for scene in {window.scene for window in bpy.context.window_manager.windows}:
        live = of(scene)
        if live.changed and is_on(scene):
            live.look(scene)
