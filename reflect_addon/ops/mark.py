"""Mark objects as reflectors by hand, or leave it to their materials."""

import bpy

MARKS = (
    ("YES", "Reflector", "The selected objects get reflections, whatever their materials say"),
    ("NO", "Not a Reflector", "The selected objects get no reflections, whatever their materials say"),
    ("AUTO", "By Material", "Shiny materials decide whether the selected objects get reflections"),
)


class REFLECT_OT_mark(bpy.types.Operator):
    bl_idname = "reflect.mark"
    bl_label = "Mark Reflector"
    bl_description = "Say by hand whether the selected objects get reflections"
    bl_options = {"REGISTER", "UNDO"}

    mark: bpy.props.EnumProperty(name="Mark", description="What the selected objects become", items=MARKS, default="YES")

    @classmethod
    def description(cls, _context, properties):
        return next(text for name, _label, text in MARKS if name == properties.mark)

    @classmethod
    def poll(cls, context):
        if context.mode != "OBJECT" or not context.selected_objects:
            cls.poll_message_set("Select an object in Object Mode first")
            return False
        return True

    def execute(self, context):
        for selected in context.selected_objects:
            selected.reflect_mark = self.mark
        return {"FINISHED"}
