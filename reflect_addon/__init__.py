"""Reflect: correct-looking reflections on shiny objects in real time, and how wrong they are.

Importing this package imports no part of it; register() does, in order, and unregister() undoes it in reverse.
"""

MINIMUM_BLENDER = (5, 2, 0)

_undo: list = []  # what unregister() calls, last first


def unsuitable(app) -> str:
    """Why Reflect cannot work in this Blender (bpy.app); "" when it can."""
    if app.version >= MINIMUM_BLENDER:
        return ""
    return f"Reflect needs Blender {'.'.join(map(str, MINIMUM_BLENDER[:2]))} or newer; this is {app.version_string}."


def register() -> None:
    """Adds Reflect to this Blender. Whatever fails is raised, after what was done until then was undone."""
    import bpy

    if reason := unsuitable(bpy.app):
        raise RuntimeError(f"{reason} Update Blender.")
    if _undo:
        unregister()  # a script reload registers again without having unregistered
    from .registration import steps

    try:
        for do, undo in steps():
            do()
            _undo.append(undo)
    except BaseException:
        unregister()
        raise


def unregister() -> None:
    """Removes everything that register() added."""
    while _undo:
        _undo.pop()()
