"""The sidebar's panel "Plan": which stand-in each reflector has, what was promised and measured, and what is chosen by hand instead."""

import bpy

from ..core import methods
from ..core.methods import auto
from ..scene import live
from ..scene.properties import KEPT, stand_in_of
from .panel import LISTED, Tab, sentence

UNITS = {"degrees": "\N{DEGREE SIGN}", "pixels": " px"}


class REFLECT_PT_plan(Tab, bpy.types.Panel):
    bl_idname = "REFLECT_PT_plan"
    bl_parent_id = "REFLECT_PT_main"
    bl_label = "Plan"

    @classmethod
    def poll(cls, context):
        return context.scene.reflect.method == methods.AUTO

    def draw(self, context):
        layout, scene = self.layout, context.scene
        presets = layout.row(align=True)
        for name in auto.PRESETS:
            presets.operator("reflect.plan_preset", text=name.title()).preset = name
        plan = live.of(scene).loaded.plan
        if plan is None:
            sentence(layout, context, "Bake makes a plan: the cheapest stand-in for each reflector that keeps the tolerance.", "INFO")
            return
        column = layout.column(align=True)
        for row in sorted(plan.rows, key=lambda row: -row.share)[:LISTED]:
            kept = not plan.goal.tolerance or row.measured <= plan.goal.tolerance
            text = f"{row.reflector}: {_label(row.method)}, {_error(row, plan.goal.unit)}"
            line = column.row(align=True)
            line.operator("reflect.plan_row", text=text, icon="CHECKMARK" if kept else "ERROR").reflector = row.reflector
            obj = scene.objects.get(row.reflector.partition("/")[0])
            locked = obj is not None and stand_in_of(obj) == KEPT
            line.operator("reflect.plan_lock", text="", icon="LOCKED" if locked else "UNLOCKED", depress=locked).reflector = row.reflector
        if len(plan.rows) > LISTED:
            column.label(text=f"and {len(plan.rows) - LISTED} more")
        chosen = context.object
        if chosen is not None and any(row.reflector.partition("/")[0] == chosen.name for row in plan.rows):
            layout.prop(chosen, "reflect_stand_in", text=chosen.name)
        for warning in plan.warnings:
            sentence(layout, context, warning, "ERROR")
        seen = "the camera sees" if plan.by_cameras else "is seen from anywhere"
        sentence(layout, context, f"For what {seen}; planned in {plan.seconds:.1f} s.", "INFO")


def _label(method: str) -> str:
    return methods.get(method).LABEL if method in methods.names() else method


def _error(row, unit: str) -> str:
    """What 95 % of the rays keep within, measured where it was."""
    error = row.measured if row.measured >= 0 else row.promised
    return f"{error:.1f}{UNITS[unit]}" if error >= 0.05 else "exact"
