"""Show the chosen method's reflections in the reflectors' own materials: in EEVEE, in renders, and without this add-on."""

import bpy

from ..core import methods
from ..core.errors import ReflectError
from ..scene import live
from ..scene.native_materials import IMAGES, use_in_materials
from ..scene.places import assets_of
from .window_work import STEPS


class REFLECT_OT_use_in_materials(bpy.types.Operator):
    bl_idname = "reflect.use_in_materials"
    bl_label = "Use in Materials"
    bl_description = (
        "Give each reflector copies of its materials that show the baked reflections in EEVEE, also in renders and without this "
        "add-on. Your materials are kept for Cycles and come back with Remove"
    )
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        reason = None
        if not live.is_on(context.scene):
            reason = "Choose a method first"
        elif context.mode != "OBJECT":
            reason = "Leave Edit Mode first"
        elif not live.of(context.scene).assets:
            reason = "Nothing is baked for this method yet: press Bake"
        if reason:
            cls.poll_message_set(reason)
        return reason is None

    def execute(self, context):
        scene, state = context.scene, live.of(context.scene)
        settings = scene.reflect
        if state.changed:
            state.look(scene)
        if state.snapshot is None:
            self.report({"ERROR"}, state.read_error)
            return {"CANCELLED"}
        manager = context.window_manager
        manager.progress_begin(0, STEPS)  # a kitchen takes most of a minute
        try:
            done = use_in_materials(
                scene, state.snapshot, state.shown(settings.focus_distance), settings.method, pack=settings.native_pack,
                folder=assets_of(scene) / IMAGES, stale=state.stale, progress=lambda share, _: manager.progress_update(int(share * STEPS)),
            )  # fmt: skip
        except ReflectError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            manager.progress_end()
        settings.native_said = f"{methods.get(settings.method).LABEL} is in {done.counts()}"
        for sentence in done.sentences:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"Reflections are in {done.counts()}")
        return {"FINISHED"}
