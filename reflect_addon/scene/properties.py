"""What a user sets on objects; everything else is read from the scene."""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

MARKS = (
    ("AUTO", "By Material", "Shows reflections when one of its materials is shiny enough"),
    ("YES", "Reflector", "Shows reflections whatever its materials say"),
    ("NO", "No Reflector", "Never shows reflections"),
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


def register() -> None:
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
    del bpy.types.Object.reflect_mark


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
