"""A property group for each method, made from what the method declares (core/settings.py): a new method's settings have
fields without a line here.

Groups are per method, since the same setting has other defaults in other methods; what a method requires keeps its own, so
that choosing another method that requires the same makes nothing old. A side of an image is a menu of powers of two: a
dragged number would stop at none.
"""

import bpy
import numpy as np

from ..core import methods, settings
from ..scene import live

BETWEEN = ";"  # names in a field for several


def group_of(method) -> type[bpy.types.PropertyGroup]:
    """An unregistered class with one property for each of the method's DEFAULTS."""
    properties = {name: _property(settings.of(method, name), default) for name, default in method.DEFAULTS.items()}
    return type(f"Reflect_{method.NAME}", (bpy.types.PropertyGroup,), {"__annotations__": properties})


def values_of(group: bpy.types.PropertyGroup, method) -> dict[str, object]:
    """The settings as the command line would have been given them: name -> value."""
    return {name: _plain(getattr(group, name), default) for name, default in method.DEFAULTS.items()}


def _property(words: settings.Setting, default):
    common = {"name": words.label, "description": words.tooltip, "update": _changed}
    if words.in_window is not None:
        default = words.in_window
    if isinstance(default, bool):
        return bpy.props.BoolProperty(default=default, **common)
    if isinstance(default, tuple):
        common["description"] += f", separated by {BETWEEN!r}"
        return bpy.props.StringProperty(default=BETWEEN.join(default), **common)
    if words.power_of_two:
        # Numbered by their value, so that a longer menu changes no saved file.
        low, high = min(int(words.low), default), max(int(words.high), default)
        sides = [1 << k for k in range(low.bit_length() - 1, high.bit_length())]
        items = [(str(n), str(n), f"{n} texels", n) for n in sides]
        return bpy.props.EnumProperty(items=items, default=str(default), **common)
    if isinstance(default, int):
        low, high = words.whole()
        return bpy.props.IntProperty(default=default, min=low, max=high, soft_max=int(words.soft_high or high), **common)
    limits = {"min": words.low or 0.0} | ({} if words.high is None else {"max": words.high})
    limits |= {} if words.soft_high is None else {"soft_max": words.soft_high}
    subtype = {"subtype": "DISTANCE"} if words.unit == settings.METRES else {"precision": 4}
    return bpy.props.FloatProperty(default=default, **limits, **subtype, **common)


def _plain(value, default):
    """Blender's value as the setting's own type: a side of a menu as a number, a float32 as the decimal that was typed."""
    if isinstance(default, tuple):
        return tuple(filter(None, map(str.strip, value.split(BETWEEN))))
    if isinstance(value, float):
        return float(str(np.float32(value)))
    return value if isinstance(default, bool) else int(value)


def _changed(self, _context):
    live.of(self.id_data).settings_changed(self.id_data)


GROUPS = {m.NAME: group_of(m) for m in (methods.get(methods.AUTO), *methods.all_methods()) if m.DEFAULTS}
