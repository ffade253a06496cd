"""The methods, one module each. A method is its name, a bake and a kernel; registering it is one line below.

A method module has
    NAME: str                    the word on the command line
    LABEL: str                   the words in the panel
    REQUIRES: tuple[str, ...]    kinds of assets it reads beside its own, baked first
    DEFAULTS: dict               its settings and their defaults
    bake(job: BakeJob) -> Asset  see core/job.py
    trace(k, asset, ray) -> Hit  the kernel (docs/decisions.md, "Kernel language")
"""

from types import ModuleType

from .. import surface_radiance
from ..errors import ReflectError
from ..spaces import FAR
from . import billboards, box_proxy, depth_maps, distance_map, environment, layered_distance, sphere_proxy

# In the order in which people meet them: each repairs what the one before leaves out.
_ALL = (environment, sphere_proxy, box_proxy, distance_map, layered_distance, billboards, depth_maps)
_METHODS = {m.NAME: m for m in _ALL}


def register(method: ModuleType) -> None:
    """Add a method (an object with the attributes above); a second one of the same name is an error."""
    if method.NAME in _METHODS:
        raise ValueError(f"a method named {method.NAME} exists already")
    _METHODS[method.NAME] = method


def unregister(name: str) -> None:
    del _METHODS[name]


def names() -> tuple[str, ...]:
    return tuple(_METHODS)


def all_methods() -> tuple[ModuleType, ...]:
    return tuple(_METHODS.values())


def get(name: str) -> ModuleType:
    if name not in _METHODS:
        raise ReflectError(f"There is no method named '{name}'.", f"Choose among: {', '.join(_METHODS)}.")
    return _METHODS[name]


def with_required(wanted: tuple[str, ...] | list[str]) -> tuple[str, ...]:
    """The given methods and all that they require, each once, required ones first."""
    ordered: list[str] = []

    def visit(name: str) -> None:
        for required in get(name).REQUIRES:
            visit(required)
        if name not in ordered:
            ordered.append(name)

    for name in wanted:
        visit(name)
    return tuple(ordered)


SIDES = {"resolution", "texels"}  # settings that are sides of images


def check_settings(wanted: tuple[str, ...] | list[str], given: dict[str, object]) -> None:
    """ReflectError when a setting is known to none of the methods (nor to what they require) or has no possible value."""
    known: dict[str, object] = {}
    for name in with_required(wanted):
        known |= get(name).DEFAULTS
    if "live" in known:
        known |= surface_radiance.DEFAULTS
    for name, value in given.items():
        if name not in known:
            raise ReflectError(
                f"{', '.join(wanted)} has no setting '{name}'.", f"There are: {', '.join(sorted(known)) or 'none'}."
            )
        if isinstance(known[name], bool):
            if type(value) is not bool:
                raise ReflectError(f"The setting {name} cannot be {value!r}.", "Give true or false.")
        elif isinstance(known[name], int) and (type(value) is not int or not 1 <= value <= 999999):
            raise ReflectError(f"The setting {name} cannot be {value!r}.", "Give a whole number from 1 to 999999.")
        # NaN fails the comparison. FAR and more is no length.
        if isinstance(known[name], float) and (type(value) not in (int, float) or not 0 <= value < FAR):
            raise ReflectError(f"The setting {name} cannot be {value!r}.", "Give a number from 0 on.")
        if name in SIDES and (value & (value - 1) or not 4 <= value <= 8192):
            raise ReflectError(f"The setting {name} cannot be {value!r}.", "Give a power of two from 4 to 8192.")
