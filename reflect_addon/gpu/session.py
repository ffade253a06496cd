"""What the viewport shows: per scene a method, its loaded assets, and where snapshots and the look come from.

Operators fill it; app handlers mark it dirty; `refresh` (a timer, never a draw callback) walks the scene; the draw
callback alone touches the GPU.
"""

import traceback
from collections.abc import Callable
from dataclasses import dataclass, field

from ..core.asset import Asset
from ..core.errors import ReflectError
from ..core.look import Look
from ..core.snapshot import SceneSnapshot
from ..scene.wipe import Wipe
from .heat import ViewHeat
from .outlines import OutlineBatch
from .renderer import Renderer, registered_kernel
from .viewport_views import ViewportViews
from .wipe import TruthPicture


@dataclass
class ViewportSession:
    """One scene in the viewport. Times and paths are the operators' business; this holds what is drawn."""

    snapshot_of: Callable[[], SceneSnapshot]  # walks the depsgraph
    look_of: Callable[[Look | None], Look]  # reads the view settings; is given the last look
    assets: dict[str, Asset] = field(default_factory=dict)  # reflector object name -> joined asset; "" = all others
    surfaces: Asset | None = None  # the scene's surface radiance, where it was baked
    method: str = ""  # "" = off
    attenuation: float | None = None  # half distance, m
    mirrors_viewport: bool = False  # planar mirrors show the viewport's own shading, where they can
    views: dict[int, ViewportViews] = field(default_factory=dict)  # by the address of a 3D view's region: what its mirrors show of it
    shows_error: bool = False  # a map of errors lies over the picture, once it is measured
    shows_outlines: bool = False  # what stands for the scene in the active reflector is outlined
    outlines: dict[str, OutlineBatch] = field(default_factory=dict)  # by that reflector
    heats: dict[int, ViewHeat] = field(default_factory=dict)  # by the address of a 3D view's region: its map
    wipe: Wipe | None = None  # another method, right of a line
    other: "ViewportSession | None" = None  # what draws that
    truth: TruthPicture | None = None  # or this, where it is no method
    background: bool = False  # draw the background from the assets, too, where one holds the view's eye
    kernel: Callable[[str], Callable] = registered_kernel
    dirty: bool = True  # the scene changed since the last refresh
    message: str = ""  # why drawing stopped, for the panel; "" while all is well
    walks: int = 0  # snapshots taken: a camera move must not add one
    _pending: tuple[SceneSnapshot, Look] | None = None
    _look: Look | None = None
    _renderer: Renderer | None = None
    _settings: tuple | None = None

    def set_assets(self, method: str, assets: dict[str, Asset], surfaces: Asset | None = None):
        """Show another method (or "" for none). Clears an earlier failure."""
        self.method, self.assets, self.surfaces, self.message, self.dirty = method, dict(assets), surfaces, "", True

    def give_up(self, error: Exception):
        """Drawing failed: no more until the next set_assets."""
        self.message = f"Reflections are off: {error} Choose a method again to retry; details are on the console."
        traceback.print_exc()

    def set_wipe(self, wipe: Wipe | None):
        """Show another method right of a line, or (None) no more."""
        if wipe is not self.wipe:
            if self.other is not None:
                _retired.append(self.other)
            self.wipe, self.other = wipe, None
            self.truth = TruthPicture(wipe.truth) if wipe is not None and wipe.truth else None
            if wipe is not None and wipe.truth is None:
                self.other = ViewportSession(self.snapshot_of, self.look_of, kernel=self.kernel)
                self.other.set_assets(wipe.method, wipe.assets, wipe.surfaces)
        if self.other is not None:
            self.other.attenuation, self.other.dirty = self.attenuation, True

    def shows_others(self, method: str, assets: dict[str, Asset]) -> bool:
        """Whether this would be another method, or assets with other images: something to be uploaded and compiled."""
        same = method == self.method and assets.keys() == self.assets.keys()
        return not same or any(assets[name].images is not self.assets[name].images for name in assets)

    def refresh(self) -> bool:
        """Walk the scene if it changed. True when there is something new to draw. Not from a draw callback.

        A ReflectError becomes the message and turns drawing off until the next set_assets."""
        if self.other is not None:
            self.other.dirty |= self.dirty
            self.other.refresh()
        if not self.method or self.message or not self.dirty:
            return False
        self.dirty = False
        try:
            self._pending = (self.snapshot_of(), self.look_of(self._look))
        except ReflectError as error:
            self.message = str(error)
            return False
        self.walks += 1
        return True

    def current_renderer(self) -> Renderer | None:
        """The renderer with everything uploaded that refresh brought; None before the first refresh or when off."""
        if not self.method or self.message:
            return None
        if self._pending is not None:
            snapshot, look = self._pending
            settings = (self.kernel, self.attenuation)
            if self._renderer is None or settings != self._settings:
                if self._renderer is not None:
                    self._renderer.free()
                self._renderer = Renderer(
                    snapshot, self.assets, look, self.attenuation, self.kernel, self.surfaces
                )
                self._settings = settings
            else:
                self._renderer.scene.update(snapshot, self.assets, self.surfaces)
                if look is not self._look:
                    self._renderer.scene.set_look(look)
            self._look, self._pending = look, None
            self._renderer.prepare(overlay=True)
        return self._renderer

    @property
    def unsettled(self) -> bool:
        """Whether the next picture would show more than the last one, though nothing moves: cube maps and viewports' pictures that are
        due."""
        if not self.method or self.message or self._renderer is None:
            return False
        beside = self.other is not None and self.other.unsettled
        return beside or not self._renderer.settled or any(not views.settled for views in self.views.values())

    def keep_views(self, regions):
        """Let go of the pictures of all 3D views but those at these addresses. Only where drawing is allowed."""
        for gone in self.views.keys() - set(regions):
            self.views.pop(gone).free()

    def free(self):
        """Let go of the GPU's memory; the next refresh starts anew."""
        self.keep_views(())
        self.heats, self.outlines = {}, {}
        if self.other is not None:
            self.other.free()
        if self._renderer is not None:
            self._renderer.free()
        self._renderer, self._pending, self.dirty = None, None, True


_sessions: dict[str, ViewportSession] = {}  # scene name -> session
_retired: list[ViewportSession] = []


def session(scene_name: str) -> ViewportSession | None:
    return _sessions.get(scene_name)


def set_session(scene_name: str, wanted: ViewportSession | None):
    """Start, replace or (None) end a scene's session. The old one's memory goes with the next draw."""
    old = _sessions.pop(scene_name, None)
    if old is not None and old is not wanted:
        _retired.append(old)
    if wanted is not None:
        _sessions[scene_name] = wanted


def sessions() -> tuple[ViewportSession, ...]:
    return tuple(_sessions.values())


def retire_all():
    """End every session without touching the GPU (from an app handler); free_retired does that later."""
    _retired.extend(_sessions.values())
    _sessions.clear()


def free_retired():
    """Free what was retired. Only where drawing is allowed."""
    while _retired:
        _retired.pop().free()


def end_all():
    """End and free every session."""
    retire_all()
    free_retired()
