"""The panel's part of what planar mirrors show (gpu/viewport_views.py): a menu where the method draws mirrors, and why it may do nothing."""

from ..core.methods import recursive
from ..scene.viewport_source import why_not

VIEWPORT = "VIEWPORT"
ITEMS = (
    ("SURFACES", "Surface Radiance", "The light that surfaces send out as the bake found it, with all its bounces and shadows", 0),
    (VIEWPORT, "Viewport", "The shading of this 3D view, so that changed materials and lights are seen at once. Blender draws the scene "
     "once more for each mirror", 1),
)  # fmt: skip


def is_viewport(settings) -> bool:
    """Whether mirrors are to show the viewport. settings: Scene.reflect."""
    return settings.method == recursive.NAME and settings.source == VIEWPORT


def field(layout, settings) -> None:
    """The menu."""
    if settings.method == recursive.NAME:
        layout.prop(settings, "source")


def warnings(context):
    """Why mirrors show no viewport though they are asked to."""
    if is_viewport(context.scene.reflect):
        reason = why_not(context.space_data, context.space_data.region_3d, context.scene.render.engine)
        yield from [reason] if reason else []
