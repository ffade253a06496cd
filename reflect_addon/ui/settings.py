"""Scene.reflect: what the user chose, saved in the .blend."""

import json
import math

import bpy

from ..core import methods
from ..scene import live

OFF = ("OFF", "Off", "Show no reflections of Reflect's", 0)
_items = []  # Blender keeps no reference to the strings of a dynamic enum


def method_items(_self, _context):
    """Off and every registered method, numbered by name so that a new method changes no saved file."""
    global _items
    _items = [OFF] + [
        (m.NAME, m.LABEL, _first_sentence(m.__doc__), _number(m.NAME)) for m in methods.all_methods()
    ]
    return _items


def _first_sentence(doc: str | None) -> str:
    """'`name`: what it is [citation].' as a tooltip: the words after the name, without markup."""
    first = (doc or "").strip().partition("\n\n")[0].replace("\n", " ").replace("`", "")
    text = first.partition(": ")[2] or first
    return (text[:1].upper() + text[1:]).rstrip(". ")


def _number(name: str) -> int:
    """A stable positive number for a name (FNV-1a, 31 bits): what Blender stores for an enum."""
    value = 0x811C9DC5
    for byte in name.encode():
        value = ((value ^ byte) * 0x01000193) & 0xFFFFFFFF
    return (value & 0x7FFFFFFF) or 1


def _method_changed(self, _context):
    live.of(self.id_data).reload(self.id_data)


def _look_changed(self, _context):
    live.of(self.id_data).show(self.id_data)


def _to_power_of_two(self, _context):
    nearest = 1 << round(math.log2(self.resolution))
    if self.resolution != nearest:
        self.resolution = nearest


class ReflectSceneSettings(bpy.types.PropertyGroup):
    method: bpy.props.EnumProperty(
        name="Method", description="How reflections are computed in the viewport", items=method_items, update=_method_changed
    )
    resolution: bpy.props.IntProperty(
        name="Resolution",
        description="Texels along an edge of the captured images, a power of two. Twice as many need four times the memory "
        "and bake time",
        default=256,
        min=16,
        max=4096,
        subtype="PIXEL",
        update=_to_power_of_two,
    )
    samples: bpy.props.IntProperty(
        name="Samples",
        description="Cycles samples per texel of a bake. More samples give less noise and take longer",
        default=16,
        min=1,
        max=4096,
    )
    live: bpy.props.BoolProperty(
        name="Follow Movement",
        description="Reflections of objects follow while the objects move. Bakes what their surfaces send out too, which takes "
        "from a few to some ten seconds more",
        default=True,
    )
    half_distance: bpy.props.FloatProperty(
        name="Fade Distance",
        description="Distance at which a reflection has faded to half. 0: reflections do not fade, as in reality",
        default=0.0,
        min=0.0,
        soft_max=100.0,
        subtype="DISTANCE",
        update=_look_changed,
    )

    def bake_settings(self) -> dict[str, object]:
        """What the chosen method and those it requires understand of these settings."""
        known = {"resolution": self.resolution, "samples": self.samples, "live": self.live}
        wanted = set()
        for name in methods.with_required([self.method]):
            wanted |= methods.get(name).DEFAULTS.keys()
        return {key: value for key, value in known.items() if key in wanted}

    def bake_arguments(self) -> list[str]:
        """The same for the command line's bake."""
        return [word for name, value in self.bake_settings().items() for word in ("--set", f"{name}={json.dumps(value)}")]
