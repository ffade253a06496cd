"""Scene.reflect: what the user chose, saved in the .blend."""

import json

import bpy

from ..core import methods
from ..scene import live
from ..scene.properties import number_of
from ..scene.wipe import TRUTH, TRUTH_LABEL
from . import mirror_source
from .method_settings import GROUPS, values_of

OFF = ("OFF", "Off", "Show no reflections of Reflect's", 0)
TRUTH_ITEM = (
    TRUTH, TRUTH_LABEL, "What Cycles finds along the mirror rays of this view. Traced when the wipe starts, in another process; another view has none",
    number_of(TRUTH),
)  # fmt: skip
NONE = ("NONE", "None", "No other method", 0)
_items = []  # Blender keeps no reference to the strings of a dynamic enum


def method_items(_self, _context):
    """Off and every registered method, numbered by name so that a new method changes no saved file."""
    global _items
    _items = [OFF] + [
        (m.NAME, m.LABEL, _first_sentence(m.__doc__), number_of(m.NAME)) for m in (methods.get(methods.AUTO), *methods.all_methods())
    ]
    return _items


def _first_sentence(doc: str | None) -> str:
    """'`name`: what it is [citation].' as a tooltip: the words after the name, without markup."""
    first = (doc or "").strip().partition("\n\n")[0].replace("\n", " ").replace("`", "")
    text = first.partition(": ")[2] or first
    return (text[:1].upper() + text[1:]).rstrip(". ")


def _method_changed(self, _context):
    live.of(self.id_data).reload(self.id_data)


def _look_changed(self, _context):
    live.of(self.id_data).show(self.id_data)


_baked = []  # as _items


def baked_items(self, context):
    """Of method_items those that have assets."""
    global _baked
    baked = live.of(self.id_data).baked
    _baked = [NONE, TRUTH_ITEM, *(item for item in method_items(self, context) if item[0] in baked)]
    return _baked


class ReflectSceneSettings(bpy.types.PropertyGroup):
    method: bpy.props.EnumProperty(
        name="Method", description="How reflections are computed in the viewport", items=method_items, update=_method_changed
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

    background: bpy.props.BoolProperty(
        name="Background",
        description="Show all that is behind the reflectors from the light field, too, in place of the viewport's own shading. "
        "For views from inside its cell",
        update=_look_changed,
    )
    shows_error: bpy.props.BoolProperty(
        name="Error",
        description="Colour the reflectors by how far off their reflections are: the way from the point that should be seen to the one that is "
        "shown, as an angle seen from the reflector. Measured while view and scene rest, coarse first",
        update=_look_changed,
    )
    shows_outlines: bpy.props.BoolProperty(
        name="Stand-Ins",
        description="Outline what stands for the scene where the active reflector looks it up: the quads of billboards, what depth maps see and "
        "whence, the box or the sphere that an environment lies on, the cell of a light field and its slabs",
        update=_look_changed,
    )
    against: bpy.props.EnumProperty(
        name="Against", description="What is shown beside the scene's own method: another one of those that are baked, or the truth", items=baked_items
    )
    source: bpy.props.EnumProperty(
        name="Mirrors Show",
        description="What planar mirrors show of surfaces. Needs no other bake",
        items=mirror_source.ITEMS,
        default="SURFACES",
        update=_look_changed,
    )
    focus_distance: bpy.props.FloatProperty(
        name="Focus",
        description="Distance from the cell's middle at which the light field is sharpest. 0: found automatically, for each side "
        "of the cell. With Depth per View everything is near to sharp and this changes little. Needs no other bake",
        default=0.0,
        min=0.0,
        soft_max=100.0,
        subtype="DISTANCE",
        update=_look_changed,
    )

    refresh: bpy.props.EnumProperty(
        name="Refresh",
        description="What happens with reflections that are old because the scene changed. Moving a camera makes none old",
        items=(
            ("NEVER", "By Hand", "They stay as they are until Bake is pressed"),
            ("IDLE", "When Idle", "When nothing was changed for some seconds they are baked again in the background, one reflector after the other, those "
             "that are wrong most first. A change stops it"),
            ("LIVE", "At Once", "As soon as something was changed they are baked again, as many as the time budget allows"),
        ),
        default="NEVER",
    )  # fmt: skip
    refresh_seconds: bpy.props.FloatProperty(
        name="Time Budget",
        description="Seconds of baking after a change, as the last bakes took. What takes longer stays old until Bake is pressed",
        default=10.0,
        min=0.0,
        soft_max=300.0,
        subtype="TIME_ABSOLUTE",
    )

    native_pack: bpy.props.BoolProperty(
        name="Pack",
        description="Keep the images of Use in Materials in the .blend. Off: they are written beside the assets, and the .blend needs them",
        default=True,
    )
    native_said: bpy.props.StringProperty(description="What Use in Materials made, for the sidebar")

    def settings_of(self, kind: str) -> dict[str, object]:
        """What a bake of this method alone is asked for: name -> value; {} for a method that was added while Blender ran."""
        group = getattr(self, kind, None)
        return values_of(group, methods.get(kind)) if group else {}

    def bake_settings(self) -> dict[str, object]:
        """What a bake of the chosen method and those it requires is asked for."""
        found = {}
        for kind in methods.with_required([self.method]):
            found |= self.settings_of(kind)
        return found

    def bake_arguments(self) -> list[str]:
        """The same for the command line's bake."""
        return [word for name, value in self.bake_settings().items() for word in ("--set", f"{name}={json.dumps(value)}")]


for _name, _group in GROUPS.items():
    ReflectSceneSettings.__annotations__[_name] = bpy.props.PointerProperty(
        type=_group, name=methods.get(_name).LABEL, description=f"Settings of the method {methods.get(_name).LABEL}"
    )
