"""The scene's view transform read from Blender without OpenColorIO's Python, which some builds lack: an image of all
the table's colours is saved with the scene's view settings and read back (view, look, gamma, curves, white balance)."""

import bpy
import numpy as np

from ..core.look import TABLE_SIDE, Look, table_inputs
from ..core.processes import temporary_folder


def look_signature(scene: bpy.types.Scene) -> tuple:
    """Everything the table depends on; exposure is apart, since changing it needs no new table."""
    view = scene.view_settings
    curves = ()
    if view.use_curve_mapping:
        mapping = view.curve_mapping
        curves = tuple(
            (p.location[0], p.location[1], p.handle_type) for curve in mapping.curves for p in curve.points
        ) + (tuple(mapping.black_level), tuple(mapping.white_level), mapping.tone, mapping.extend)
    white = (view.white_balance_temperature, view.white_balance_tint) if view.use_white_balance else ()
    return (scene.display_settings.display_device, view.view_transform, view.look, view.gamma, curves, white)


def read_look(scene: bpy.types.Scene, previous: Look | None = None) -> Look:
    """The scene's look; `previous` is given back with the new exposure when nothing else changed.

    Makes and removes a copy of the scene and two images, so not from a draw callback. Takes about 0.3 s.
    """
    signature = look_signature(scene)
    exposure = float(scene.view_settings.exposure)
    if previous is not None and previous.signature == signature:
        return Look(exposure, previous.table, signature)
    device, view, look, gamma, curves, white = signature
    if (device, view, look, gamma, curves, white) == ("sRGB", "Standard", "None", 1.0, (), ()):
        return Look(exposure, None, signature)
    return Look(exposure, _developed_table(scene), signature)


def _developed_table(scene: bpy.types.Scene) -> np.ndarray:
    side = TABLE_SIDE
    pixels = np.ones((side, side * side, 4), np.float32)
    # Blue slices side by side: row = green, column = blue * side + red.
    pixels[..., :3] = table_inputs().transpose(1, 0, 2, 3).reshape(side, side * side, 3)
    made: list = []
    with temporary_folder("reflect-look-") as folder:
        path = str(folder / "table.png")
        try:
            twin = scene.copy()
            made.append((bpy.data.scenes, twin))
            twin.view_settings.exposure = 0.0
            settings = twin.render.image_settings
            settings.color_management = "FOLLOW_SCENE"
            settings.media_type = "IMAGE"
            settings.file_format = "PNG"
            settings.color_mode, settings.color_depth, settings.compression = "RGB", "16", 0
            unrolled = bpy.data.images.new("reflect-look", side * side, side, float_buffer=True)
            made.append((bpy.data.images, unrolled))
            unrolled.pixels.foreach_set(pixels.ravel())
            unrolled.save_render(path, scene=twin)
            developed = bpy.data.images.load(path)
            made.append((bpy.data.images, developed))
            developed.colorspace_settings.name = "Non-Color"
            out = np.empty(pixels.size, np.float32)
            developed.pixels.foreach_get(out)
        finally:
            for collection, item in reversed(made):
                collection.remove(item)
    out = out.reshape(side, side, side, 4)[..., :3]  # [green, blue, red]
    return np.ascontiguousarray(out.transpose(1, 0, 2, 3))
