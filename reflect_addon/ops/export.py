"""File > Export > Reflections: the scene as glTF with its baked stand-ins beside it, written in a worker process; Esc cancels."""

from pathlib import Path

import bpy

from ..core.errors import Cancelled, ReflectError
from ..scene.export_job import folder_in, start_export
from ..scene.places import assets_of
from ..scene.worker import BakeState, Worker
from ..ui.preferences import worker_preference
from .window_work import WindowWork

LABEL = "Reflections (glTF + stand-ins)"

_running: Worker | None = None


class REFLECT_OT_export(WindowWork, bpy.types.Operator):
    bl_idname = "reflect.export"
    bl_label = "Export Reflections"
    bl_description = (
        "Write the scene as glTF and beside it all reflections that are baked, with their shaders, so that a web page or another program can show them. "
        "Another process writes the folder; Esc cancels. The scene itself is not changed"
    )

    directory: bpy.props.StringProperty(
        name="Folder", description="Where the export goes: into an earlier export, which it replaces, or into a new folder below", subtype="DIR_PATH"
    )
    ktx2: bpy.props.BoolProperty(
        name="KTX2",
        description="Tables and atlases as KTX2 in place of EXR: quicker to open in a browser. Needs KTX-Software's program ktx on PATH",
        default=False,
    )
    filter_folder: bpy.props.BoolProperty(name="Folders", description="The file browser shows folders alone", default=True, options={"HIDDEN"})

    @classmethod
    def poll(cls, context):
        reason = None
        if _running is not None:
            reason = "An export is running"
        elif not any(assets_of(context.scene).glob("*/asset.json")) and not any(assets_of(context.scene).glob("*/*/asset.json")):
            reason = "Nothing is baked for this scene yet: press Bake in the sidebar's tab Reflect"
        if reason:
            cls.poll_message_set(reason)
        return reason is None

    def invoke(self, context, _event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        """With a folder chosen: in a window it goes on in modal(); without one (a script) it waits."""
        global _running
        if not self.directory:
            self.report({"ERROR"}, "No folder was chosen.")
            return {"CANCELLED"}
        try:
            self._out = folder_in(Path(bpy.path.abspath(self.directory)), context.scene)
            _running = start_export(context.scene, self._out, worker_preference(), self.ktx2)
        except (ReflectError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if bpy.app.background:
            return self._finish(_running.wait())
        return self._enter_window(context)

    def modal(self, context, event):
        if _running is None:  # the add-on was switched off meanwhile
            self._leave_window(context)
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS":
            _running.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        state = _running.poll()
        if state.running:
            self._show(context, state)
            return {"PASS_THROUGH"}
        self._leave_window(context)
        return self._finish(state)

    def cancel(self, context):
        """Blender ends the operator itself: the file browser is closed, another file is opened, or the window closes."""
        if hasattr(self, "_timer"):
            self._leave_window(context)
            stop()

    def _finish(self, state: BakeState):
        global _running
        _running = None
        if state.error:
            self.report({"WARNING" if isinstance(state.error, Cancelled) else "ERROR"}, str(state.error))
            return {"CANCELLED"}
        for sentence in state.said:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"Exported to {self._out}")
        return {"FINISHED"}


def stop() -> None:
    """Ends the export of this window, when there is one: the add-on is switched off, or the file goes."""
    global _running
    if _running is not None:
        _running.stop()
        _running = None


def _entry(menu, _context) -> None:
    menu.layout.operator(REFLECT_OT_export.bl_idname, text=LABEL)


def register() -> None:
    bpy.types.TOPBAR_MT_file_export.append(_entry)


def unregister() -> None:
    stop()
    bpy.types.TOPBAR_MT_file_export.remove(_entry)
