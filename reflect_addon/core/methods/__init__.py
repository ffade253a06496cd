"""The methods, one module each. A method is its name, a bake and a kernel; registering it is one line below.

A method module has
    NAME: str                    the word on the command line
    LABEL: str                   the words in the panel
    REQUIRES: tuple[str, ...]    kinds of assets it reads beside its own, baked first
    DEFAULTS: dict               its settings and their defaults
    SETTINGS: dict               optional: words and values of those that are its own, see core/settings.py
    bake(job: BakeJob) -> Asset  see core/job.py
    trace(k, asset, ray) -> Hit  the kernel (docs/decisions.md, "Kernel language")
and may have
    COMPANIONS: tuple[str, ...]                  kinds of which the first that is baked answers with it, with the setting `contact`
    inputs(scene, reflectors) -> Items           what its content depends on (core/scene_items.py), where that is not light and all that it falls on
    READS_REQUIRED: bool                         whether its bake reads the assets of REQUIRES; False where it is not given
    GOES_ON: bool                                whether a bake may go on from an earlier one of another state of the scene; False where it is not given
    remark(asset, scene, reflector) -> str       a sentence when the asset no longer serves the reflector where it is now
    predicted_bytes(job: BakeJob) -> int         memory of the asset, before it is baked
    report(asset) -> str                         what was left out, as a sentence
    holds(asset, points) -> (N,) bool            whether any ray from these places is answered, a camera's too (core/background.py)
    trace_background(k, asset, ray) -> Hit       the kernel for a camera's rays, where it is another than `trace`
    SURFACES: dict                               it draws the scene's own surfaces (gpu/virtual.py): theirs are baked that its parts
                                                 name, with these settings, and `trace` answers what it does not draw
    EFFORT: float                                about what an answer costs, in look-ups of an environment map: plans try methods in
                                                 this order (core/planning/); 1 where it is not given, and a method that draws is
                                                 tried only where it is (planning/shown.py)
    SHOWS_ITSELF: str                            the setting that says whether a reflector's rays that meet it again see it; they do not where it is not given
    VARIANTS: tuple[tuple[float, dict], ...]     settings that plans try beside those asked for, and the effort of each
    BAKE_EFFORT: float                           about how long its bake takes, in environment maps' (core/parts.py deals by it); 1 where it is not given
    TOGETHER: str                                bakes of one run with this word take captures from each other, for all their reflectors; "" where it is
                                                 not given: a bake is the same to the bit whatever else was baked with it
    needless(tried, own) -> str                  why it shows nothing better than what a plan has tried (kind -> asset), as a sentence's end, or "";
                                                 own: whether the reflector's rays meet itself
    outlines(asset) -> Outlines                  what it is in space, to be looked at (core/outlines.py)
    focused(asset, distance) -> Asset            the asset with another focal plane, in m from its middle (0: its own), sharing its
                                                 images; and distance_of(asset, point), which plane a point lies on
"""

from types import ModuleType

from .. import settings, surface_radiance
from ..errors import ReflectError
from . import (
    auto,
    billboards,
    box_proxy,
    depth_maps,
    distance_map,
    environment,
    layered_distance,
    light_field,
    recursive,
    sphere_proxy,
    virtual_objects,
)

# In the order in which people meet them: each repairs what the one before leaves out.
_ALL = (environment, sphere_proxy, box_proxy, distance_map, layered_distance, billboards, depth_maps, light_field, virtual_objects, recursive)
_METHODS = {m.NAME: m for m in _ALL}
AUTO = auto.NAME  # no method by itself: `get` knows it, with its settings, and no list of methods has it


def register(method: ModuleType) -> None:
    """Add a method (an object with the attributes above); a second one of the same name is an error."""
    if method.NAME in _METHODS:
        raise ValueError(f"a method named {method.NAME} exists already")
    _METHODS[method.NAME] = method


def unregister(name: str) -> None:
    del _METHODS[name]


def names() -> tuple[str, ...]:
    return tuple(_METHODS)


def gathering() -> tuple[str, ...]:
    """The methods whose kernel answers every ray; the others draw (SURFACES), and theirs is another's for the rest."""
    return tuple(name for name, method in _METHODS.items() if not getattr(method, "SURFACES", None))


def planned() -> tuple[str, ...]:
    """The methods that a plan chooses among."""
    return tuple(name for name, method in _METHODS.items() if name in gathering() or hasattr(method, "EFFORT"))


def all_methods() -> tuple[ModuleType, ...]:
    return tuple(_METHODS.values())


def get(name: str) -> ModuleType:
    if name == AUTO:
        return auto
    if name not in _METHODS:
        raise ReflectError(f"There is no method named '{name}'.", f"Choose among: {', '.join(_METHODS)}, {AUTO}.")
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


def companions(name: str, settings: dict[str, object]) -> tuple[str, ...]:
    """Kinds of assets of which the first that exists is joined to this method's; () where its settings want none."""
    return getattr(get(name), "COMPANIONS", ()) if settings.get("contact") else ()


def check_settings(wanted: tuple[str, ...] | list[str], given: dict[str, object]) -> None:
    """ReflectError when a setting is known to none of the methods (nor to what they require) or has no possible value."""
    owners = [get(name) for name in with_required(wanted if AUTO not in wanted else (*wanted, *_METHODS))]
    if any("live" in owner.DEFAULTS or hasattr(owner, "SURFACES") for owner in owners):
        owners.append(surface_radiance)
    known = {name for owner in owners for name in owner.DEFAULTS}
    for name, value in given.items():
        if name not in known:
            raise ReflectError(
                f"{', '.join(wanted)} has no setting '{name}'.", f"There are: {', '.join(sorted(known)) or 'none'}."
            )
        for owner in owners:
            if name in owner.DEFAULTS:
                settings.of(owner, name).check(name, owner.DEFAULTS[name], value)
