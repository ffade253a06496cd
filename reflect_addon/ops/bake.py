"""Bake the scene's method in a worker process: the window stays responsive, Esc cancels."""

import bpy

from ..core import methods
from ..core.errors import Cancelled, ReflectError
from ..scene import live
from ..scene.bake_job import start_bake, unsaved_images
from ..scene.camera import viewport_cameras
from ..scene.worker import BakeState, Worker
from ..ui.preferences import worker_preference
from .window_work import WindowWork

_running: Worker | None = None


def running() -> Worker | None:
    """The worker of the bake that runs in this window, if any."""
    return _running


class REFLECT_OT_bake(WindowWork, bpy.types.Operator):
    bl_idname = "reflect.bake"
    bl_label = "Bake"
    bl_description = "Bake what the chosen method needs, in another process; Esc cancels. The scene itself is not changed"

    selected: bpy.props.BoolProperty(
        name="Selected Only", description="Bake only for the selected reflectors and keep the assets of the others"
    )
    only: bpy.props.StringProperty(
        name="Only", description="Name of the one reflector to bake for; empty: all, or the selected", options={"HIDDEN", "SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context):
        reason = None
        if _running is not None:
            reason = "A bake is running"
        elif context.scene.reflect.method == "OFF":
            reason = "Choose a method first"
        elif not context.scene.objects:
            reason = "The scene is empty: add an object with a shiny material"
        elif live.of(context.scene).has_nothing_to_bake():
            reason = "No reflector was found: give an object a shiny material, or mark it"
        if reason:
            cls.poll_message_set(reason)
        return reason is None

    def execute(self, context):
        """Without events (a script, a background process): starts, waits, reports."""
        try:
            state = self._start(context).wait()
        except ReflectError as error:
            return self._fail(context, error)
        return self._finish(context, state)

    def invoke(self, context, _event):
        return self.execute(context) if bpy.app.background else self.begin(context)

    def begin(self, context):
        """Starts and leaves the rest to modal()."""
        try:
            self._start(context)
        except ReflectError as error:
            return self._fail(context, error)
        return self._enter_window(context)

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS":
            _running.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        state = _running.poll()
        if state.running:
            self._show(context, state)
            live.redraw_panels()
            return {"PASS_THROUGH"}
        self._leave_window(context)
        return self._finish(context, state)

    def cancel(self, context):
        """Blender ends the operator itself: another file is opened, or the window closes."""
        self._leave_window(context)
        stop()

    def _start(self, context) -> Worker:
        global _running
        scene = context.scene
        live.of(scene).bake_error = ""
        for name in unsaved_images():
            self.report({"WARNING"}, f"The image {name} has unsaved changes, which the bake does not see; save it first")
        objects = [self.only] if self.only else [o.name for o in context.selected_objects] if self.selected else []
        self._scene, self._seen = scene.name, live.of(scene).bake_starts(scene)
        views = viewport_cameras(scene) if scene.reflect.method == methods.AUTO else []
        _running = start_bake(scene, [scene.reflect.method], objects, scene.reflect.bake_arguments(), worker_preference(), views)
        return _running

    def _finish(self, context, state: BakeState):
        global _running
        _running = None
        if isinstance(state.error, Cancelled):
            self.report({"WARNING"}, str(state.error))
            live.redraw_panels()
            return {"CANCELLED"}
        if state.error:
            return self._fail(context, state.error)
        scene = bpy.data.scenes.get(self._scene)
        if scene:
            live.of(scene).bake_ended(scene, state.folders, self._seen)
        self.report({"INFO"}, f"Baked {len(state.folders)} assets")
        return {"FINISHED"}

    def _fail(self, context, error: ReflectError):
        live.of(context.scene).bake_error = str(error)
        live.redraw_panels()
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}


def stop() -> None:
    """Ends the bake of this window, when there is one: the add-on is switched off, or the file goes."""
    global _running
    if _running is not None:
        _running.stop()
        _running = None
