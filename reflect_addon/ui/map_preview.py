"""Icons of reflector maps for the sidebar: pictures that belong to the window and never to the user's file."""

import bpy.utils.previews

from ..core.asset import Asset
from ..core.map_picture import map_picture

_icons = None  # bpy.utils.previews' collection, while the add-on is on
KEPT = 64  # icons; all are made again when there are more


def icon_of(asset: Asset) -> int:
    """The icon of an asset's reflector maps; 0 where it has none."""
    name = f"{asset.kind} {asset.reflector} {id(asset.images)}"
    if name not in _icons:
        picture = map_picture(asset)
        if picture is None:
            return 0
        if len(_icons) >= KEPT:
            _icons.clear()
        preview = _icons.new(name)
        preview.image_size = picture.shape[1], picture.shape[0]
        preview.image_pixels_float = picture.ravel().tolist()
    return _icons[name].icon_id


def register():
    global _icons
    _icons = bpy.utils.previews.new()


def unregister():
    global _icons
    bpy.utils.previews.remove(_icons)
    _icons = None
