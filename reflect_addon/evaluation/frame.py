"""A scene at a frame, as a render would show it, for the length of a block; the scene is put back after."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import bpy

from ..core.snapshot import SceneSnapshot
from ..scene.snapshot import render_visibility, take_snapshot


@contextmanager
def open_frame(
    scene: bpy.types.Scene, frame: int | None, say: Callable[[float, str], object] | None = None
) -> Iterator[SceneSnapshot]:
    """The snapshot of a frame (None: the current one). say hears of what is left out of it."""
    before = scene.frame_current
    if frame is not None and frame != before:
        scene.frame_set(frame)
    layer = next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    try:
        with render_visibility(layer):
            snapshot = take_snapshot(layer.depsgraph, visibility="RENDER")
            for warning in snapshot.warnings if say else ():
                say(0.0, f"Warning: {warning}")
            yield snapshot
    finally:
        if scene.frame_current != before:
            scene.frame_set(before)
