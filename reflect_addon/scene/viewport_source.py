"""The 3D view's own shading as what planar mirrors show: where Blender can draw it from elsewhere, and when it has changed."""

# Engines whose rendered view draw_view3d draws; others (Cycles) need a window of their own.
ENGINES = ("BLENDER_EEVEE", "BLENDER_WORKBENCH")


def why_not(space, region_data, engine: str) -> str:
    """Why mirrors cannot show what this 3D view shades, as sentences; "" where they can. space, region_data: None without a window."""
    if space is None or region_data is None:
        return "Mirrors can show the viewport only in a 3D view of a window: elsewhere they show surface radiance."
    if space.shading.type == "RENDERED" and engine not in ENGINES:
        return "The render engine's view cannot be drawn from where a mirror sees: mirrors show surface radiance. Choose Material Preview."
    if not region_data.is_perspective:
        return "In an orthographic view mirrors show surface radiance. Switch to perspective to see the viewport in them."
    return ""


def shading_of(space) -> tuple:
    """All that a 3D view's shading is set to, to be compared."""
    values = {p.identifier: getattr(space.shading, p.identifier) for p in space.shading.bl_rna.properties if p.type not in {"POINTER", "COLLECTION"}}
    return tuple((name, tuple(v) if hasattr(v, "foreach_get") else str(v)) for name, v in values.items())
