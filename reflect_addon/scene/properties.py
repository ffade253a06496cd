"""What a user sets on objects; everything else is read from the scene."""

import bpy

MARKS = (
    ("AUTO", "By Material", "Shows reflections when one of its materials is shiny enough"),
    ("YES", "Reflector", "Shows reflections whatever its materials say"),
    ("NO", "No Reflector", "Never shows reflections"),
)


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


def unregister() -> None:
    del bpy.types.Object.reflect_mark
