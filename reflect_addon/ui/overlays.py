"""The sidebar's panel "Overlays": what is drawn over the picture to judge it by, and what it says."""

import bpy

from ..core import methods
from ..scene import live
from ..scene.load import draws_surfaces
from .panel import MethodTab, sentence


class REFLECT_PT_overlays(MethodTab, bpy.types.Panel):
    bl_idname = "REFLECT_PT_overlays"
    bl_label = "Overlays"

    def draw(self, context):
        layout, settings = self.layout, context.scene.reflect
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(settings, "shows_error")
        if settings.shows_error:
            sentence(layout, context, _error(context, live.of(context.scene)), "INFO")
        layout.prop(settings, "shows_outlines")
        if settings.shows_outlines and (reason := _without_outlines(context, live.of(context.scene))):
            sentence(layout, context, reason, "INFO")
        row = layout.row(align=True)
        row.prop(settings, "against")
        row.operator("reflect.wipe", icon="ARROW_LEFTRIGHT")


def _without_outlines(context, state) -> str:
    """Why nothing is outlined; "" where something is."""
    name = context.object.name if context.object is not None else ""
    assets = {instance: asset for instance, asset in state.joined().items() if instance.partition("/")[0] == name}
    if not assets:
        return "Select a reflector that is baked, to see what stands for the scene in it."
    kind = next(iter(assets.values())).kind
    return "" if hasattr(methods.get(kind), "outlines") else f"{methods.get(kind).LABEL} has nothing that stands in space."


def _error(context, state) -> str:
    """What is known of the error in this view."""
    if draws_surfaces(state.method):
        return f"{methods.get(state.method).LABEL} draws what is reflected and looks nothing up: there is nothing to measure."
    region = next(r for r in context.area.regions if r.type == "WINDOW")
    view = state.heat_of(region.as_pointer())
    if view is None or (view.heat is None and not view.settled):
        return "Measured when the view rests."
    if view.heat is None:
        return "No reflector is seen here whose error could be measured."
    seen, share = view.heat.seen, "" if view.heat.share == 1.0 else f", {view.heat.share:.0%} measured"
    wrong = f"; {seen.wrong:.1%} show the sky for a surface or the reverse" if seen.wrong else ""
    return f"Mean {view.heat.mean:.2f}\N{DEGREE SIGN}, 95 % within {seen.p95:.2f}\N{DEGREE SIGN}{wrong}{share}."
