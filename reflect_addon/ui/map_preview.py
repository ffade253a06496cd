"""Icons of reflector maps for the sidebar: pictures that belong to the window and never to the user's file."""

import weakref

import bpy.utils.previews

from ..core.asset import Asset
from ..core.map_picture import map_picture

_icons = None  # bpy.utils.previews' collection, while the add-on is on
_made_of: dict[str, weakref.ref] = {}  # the map that each icon shows: an asset that was baked again has another
KEPT = 64  # icons; all are made again when there are more


def icon_of(asset: Asset) -> int:
    """The icon of an asset's reflector maps; 0 where it has none."""
    shown = asset.images.get("reflector_normal_buf")
    if shown is None:
        return 0
    name = f"{asset.kind} {asset.reflector}"
    if name in _icons and _made_of[name]() is not shown:
        del _icons[name]
    if name not in _icons:
        picture = map_picture(asset)
        if len(_icons) >= KEPT:
            _icons.clear()
        preview = _icons.new(name)
        preview.image_size = picture.shape[1], picture.shape[0]
        preview.image_pixels_float = picture.ravel().tolist()
        _made_of[name] = weakref.ref(shown)
    return _icons[name].icon_id


def register():
    global _icons
    _icons = bpy.utils.previews.new()


def unregister():
    global _icons
    bpy.utils.previews.remove(_icons)
    _icons = None
