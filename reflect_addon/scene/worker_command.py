"""Which executable bakes, and how it is called. The window's own Blender may lack OSL; the worker may not."""

import os
import subprocess
import sys
from pathlib import Path

import bpy

from ..core.errors import ReflectError
from .places import EXTENSION

SOURCE = Path(__file__).resolve().parents[2]  # the folder that holds the package `reflect_addon`

NAME_A_WORKER = (
    "In the preferences, Add-ons, Reflect, name as worker a Blender 5.2 from blender.org or a Python 3.13 with bpy 5.2 "
    "(the project's is .venv/bin/python)."
)


def bake_command(
    blend: Path, methods: list[str], out: Path, objects: list[str], settings: list[str], preference: str
) -> tuple[list[str], dict[str, str]]:
    """(command, environment) of a bake of `blend` with assets below `out`.

    objects: names, [] for all reflectors; settings: more arguments of the verb; preference: the executable that the user
    named, "" for none. ReflectError when no usable worker is known.
    """
    verb = ["--methods", ",".join(methods), "--out", str(out), "--json-progress", *settings]
    verb += [f"--object={name}" for name in objects]
    return reflect_command(blend, "bake", verb, preference)


def reflect_command(blend: Path, verb: str, arguments: list[str], preference: str = "") -> tuple[list[str], dict[str, str]]:
    """(command, environment) of one verb of the command line on `blend`, in a process of its own; as bake_command."""
    executable, is_blender = _executable(preference)
    environment = {k: v for k, v in os.environ.items() if k not in _OF_THIS_BLENDER}
    if is_blender:
        # The add-on may be enabled in this session only: --addons enables it in the worker too.
        addon = ["--addons", EXTENSION] if EXTENSION.startswith("bl_ext.") else []
        return [executable, *addon, "-b", str(blend), "--command", "reflect", verb, *arguments], environment
    environment["PYTHONPATH"] = str(SOURCE)
    environment["PYTHONDONTWRITEBYTECODE"] = "1"  # an installed extension's folder is not ours to write into
    return [executable, "-m", "reflect_addon.cli", verb, str(blend), *arguments], environment


# What a Blender sets or was started with for itself; another Blender or Python must not take it over.
_OF_THIS_BLENDER = {
    "PYTHONHOME",
    "PYTHONPATH",
    "BLENDER_SYSTEM_RESOURCES",
    "BLENDER_SYSTEM_SCRIPTS",
    "BLENDER_SYSTEM_DATAFILES",
    "BLENDER_SYSTEM_PYTHON",
    "BLENDER_SYSTEM_EXTENSIONS",
}


def _executable(preference: str) -> tuple[str, bool]:
    """(path, is it a Blender)."""
    preference = preference.strip()
    if preference:
        path = Path(bpy.path.abspath(preference)).expanduser()
        if not path.is_file():
            raise ReflectError(f"The bake worker {path} named in the preferences does not exist.", NAME_A_WORKER)
        if not os.access(path, os.X_OK):
            raise ReflectError(f"The bake worker {path} named in the preferences cannot be executed.", NAME_A_WORKER)
        return str(path), _is_blender(path)
    if bpy.app.module:
        return sys.executable, False
    if not bpy.app.build_options.cycles_osl:
        raise ReflectError("This Blender was built without OSL, which baking needs.", NAME_A_WORKER)
    return bpy.app.binary_path, True


def _is_blender(path: Path) -> bool:
    """By its name, or else by what it says of itself."""
    name = path.name.lower()
    if "python" in name or "blender" in name:
        return "blender" in name
    try:
        said = subprocess.run([path, "--version"], capture_output=True, timeout=20, check=False).stdout
    except (OSError, subprocess.TimeoutExpired) as error:
        raise ReflectError(f"The bake worker {path} does not say what it is: {error}.", NAME_A_WORKER) from error
    if said.startswith((b"Blender", b"Python")):
        return said.startswith(b"Blender")
    raise ReflectError(f"The bake worker {path} is neither a Blender nor a Python.", NAME_A_WORKER)
