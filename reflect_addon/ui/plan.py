"""The sidebar's panel "Plan": which stand-in each reflector has, what was promised and measured, and what is chosen by hand instead."""

import bpy

from ..core import methods
from ..core.methods import auto
from ..scene import live
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
        snapshot = live.of(scene).snapshot
        named = snapshot.named() if snapshot else {}
        column = layout.column(align=True)
        for row in sorted(plan.rows, key=lambda row: -row.share)[:LISTED]:
            kept = not plan.goal.tolerance or row.measured <= plan.goal.tolerance
            line = column.split(factor=0.4, align=True)
            line.operator("reflect.plan_row", text=row.reflector, icon="CHECKMARK" if kept else "ERROR", emboss=False).reflector = row.reflector
            line = line.split(factor=0.55, align=True)
            instance = named.get(row.reflector)
            obj = scene.objects.get(instance.object_name) if instance else None
            if obj is not None and hasattr(obj, "reflect_stand_in"):
                chosen = obj.reflect_stand_in
                line.prop(obj, "reflect_stand_in", text="", **({} if chosen != "AUTO" else {"icon": "LIGHT"}))
            else:
                line.label(text="gone")
            line.label(text=f"{_label(row.method)} {_error(row, plan.goal.unit)}")
        if len(plan.rows) > LISTED:
            column.label(text=f"and {len(plan.rows) - LISTED} more")
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
