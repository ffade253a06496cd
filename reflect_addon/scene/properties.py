"""What a user sets on objects; everything else is read from the scene."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import bpy

from ..core import methods
from ..core.snapshot import Instance

MARKS = (
    ("AUTO", "By Material", "Shows reflections when one of its materials is shiny enough"),
    ("YES", "Reflector", "Shows reflections whatever its materials say"),
    ("NO", "No Reflector", "Never shows reflections"),
)




def number_of(name: str) -> int:
    """A stable positive number for a name (FNV-1a, 31 bits): what Blender stores for an enum, so that a new item changes no saved file."""
    value = 0x811C9DC5
    for byte in name.encode():
        value = ((value ^ byte) * 0x01000193) & 0xFFFFFFFF
    return (value & 0x7FFFFFFF) or 1


# What a plan may be overruled by.
KEPT = "KEPT"
STAND_INS = (
    ("AUTO", "As Planned", "The cheapest that is good enough", 0),
    (KEPT, "As It Is", "What it has now, with the same settings, whenever a plan is made", number_of(KEPT)),
    *((m.NAME, m.LABEL, f"{m.LABEL}, whatever the plan would take", number_of(m.NAME)) for m in map(methods.get, methods.gathering())),
)


class ReflectNativeSlot(bpy.types.PropertyGroup):
    """What a slot showed before it got a material of ours (native_slots.py)."""

    index: bpy.props.IntProperty(description="The slot's place", override={"LIBRARY_OVERRIDABLE"})
    link: bpy.props.StringProperty(description="Where the slot's material came from: DATA or OBJECT", override={"LIBRARY_OVERRIDABLE"})
    material: bpy.props.PointerProperty(type=bpy.types.Material, description="What the object had in the slot", override={"LIBRARY_OVERRIDABLE"})
    own: bpy.props.PointerProperty(type=bpy.types.Material, description="What Reflect put there", override={"LIBRARY_OVERRIDABLE"})


def mark_of(obj: bpy.types.Object) -> str:
    """The mark of an object; 'AUTO' while the add-on is not registered."""
    return getattr(obj, "reflect_mark", "AUTO")


def stand_in_of(obj: bpy.types.Object) -> str:
    """The method that was chosen for an object by hand, or KEPT: that of the last plan; AUTO leaves it to the plan."""
    return getattr(obj, "reflect_stand_in", "AUTO")


def by_hand(scene: bpy.types.Scene, reflectors: Sequence[Instance]) -> dict[str, str]:
    """Object -> method that a user chose for it, or KEPT; without those that are left to the plan."""
    objects = (scene.objects.get(name) for name in dict.fromkeys(r.object_name for r in reflectors))
    return {obj.name: stand_in_of(obj) for obj in objects if obj is not None and stand_in_of(obj) in (KEPT, *methods.gathering())}


def _chosen_by_hand(obj: bpy.types.Object, _context) -> None:
    from . import live  # which reads what is set here

    for scene in obj.users_scene:
        if hasattr(scene, "reflect") and live.is_on(scene):
            live.of(scene).settings_changed(scene)


def register() -> None:
    bpy.types.Object.reflect_stand_in = bpy.props.EnumProperty(
        name="Stand-In", description="What this reflector gets where the method is Auto. Asks for another bake", items=STAND_INS, default="AUTO",
        update=_chosen_by_hand,
    )  # fmt: skip
    bpy.types.Object.reflect_mark = bpy.props.EnumProperty(
        name="Reflector",
        description="Whether this object shows reflections",
        items=MARKS,
        default="AUTO",
    )
    bpy.utils.register_class(ReflectNativeSlot)
    bpy.types.Object.reflect_native = bpy.props.CollectionProperty(
        type=ReflectNativeSlot, name="Reflect", description="Slots that show materials of Reflect's",
        override={"LIBRARY_OVERRIDABLE", "USE_INSERTION"},
    )


def unregister() -> None:
    del bpy.types.Object.reflect_native
    bpy.utils.unregister_class(ReflectNativeSlot)
    del bpy.types.Object.reflect_mark, bpy.types.Object.reflect_stand_in


@contextmanager
def object_properties() -> Iterator[None]:
    """The records on objects can be read and written, whether the add-on is on or not."""
    if hasattr(bpy.types.Object, "reflect_native"):
        yield
        return
    register()
    try:
        yield
    finally:
        unregister()
