"""What the sidebar says of the picture that is shown now, as sentences."""

from ..core.background import background_of, can_show, why_none
from ..scene.camera import viewport_camera
from ..scene.native_materials import has_native
from . import mirror_source

EXPLAINED = 3  # of the reflectors that are old, why and what a bake takes; the ones that are wrong most


def of_picture(context, state):
    """What the user should know about the picture that is shown now."""
    if state.compared.missing:
        yield f"Not baked yet: {_names(state.compared.missing)}. Press Bake."
    yield from dict.fromkeys(state.compared.remarks.values())
    changed = [one for one in state.compared.refreshes.values() if one.reflector not in state.compared.remarks]
    if changed:
        yield f"The scene changed since the bake of {_names([one.reflector for one in changed])}. Bake again to bring it up to date."
    yield from (one.sentence() for one in sorted(changed, key=lambda one: -one.error)[:EXPLAINED])
    if state.compared.other_settings:
        yield f"{_names(state.compared.other_settings)} was baked with other settings than these. Bake again to use these."
    yield from _without_background(context, state)
    yield from mirror_source.warnings(context)
    yield from _drawn_by_eevee(context.space_data, has_native(context.scene.objects))


def _drawn_by_eevee(space, in_materials):
    """What to know of overlays where EEVEE draws the view. in_materials: whether materials show the reflections by themselves."""
    if space.shading.type not in {"MATERIAL", "RENDERED"}:
        return
    if in_materials and space.overlay.show_overlays:
        yield "Drawn over what the materials show. Method Off or overlays off shows the materials alone."
    elif not in_materials and not space.overlay.show_overlays:
        yield "Overlays are off: EEVEE then keeps no depth and reflections cannot be drawn. Switch overlays on."


def _without_background(context, state):
    """Why the background that was asked for is not drawn in this view."""
    settings, shown = context.scene.reflect, state.joined()
    if settings.background and can_show(settings.method) and shown:
        region = next(r for r in context.area.regions if r.type == "WINDOW")
        camera = viewport_camera(region, context.space_data.region_3d)
        if background_of(shown, state.snapshot, camera) is None:
            yield " ".join(why_none(settings.method, camera))


def _names(names):
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
