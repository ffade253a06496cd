"""What changed between the items that an asset was made from and those of the scene as it is, in an artist's words."""

from collections.abc import Mapping
from dataclasses import dataclass

from . import scene_items as aspects
from .scene_items import Items, kept
from .snapshot import SceneSnapshot

# By aspect: what to say where both states have the item and it differs. {} is its name.
CHANGED = {
    aspects.SHAPE: "{} has another shape",
    aspects.PAINT: "{} has other UVs or colors",
    aspects.PLACE: "{} was moved",
    aspects.MATERIALS: "{} has other materials",
    aspects.RAYS: "{} is seen by other rays",
    aspects.COVER: "{} lets other rays through",
    aspects.LAMP: "{} was changed",
    aspects.LAMP_SHAPE: "{} was moved or resized",
    aspects.STRANDS: "hair, points or volume of {} were changed",
    aspects.WORLD: "the world was changed",
    aspects.LIGHT: "light bounces or color management were changed",
    aspects.MATERIAL: "material {} was changed",
    aspects.OWN: "{} mirrors elsewhere",
    aspects.REQUIRED: "its {} was baked with other settings",
}
COMES_AND_GOES = {*aspects.INSTANCE, aspects.LAMP, aspects.LAMP_SHAPE, aspects.DRAWN}
GONE, NEW, RENAMED = "{} is gone", "{} is new", "{} is now called {}"
MIRRORS, MIRRORS_NOT = "{} mirrors now", "{} mirrors no longer"
UNKNOWN = "the scene was changed"


@dataclass(frozen=True)
class Change:
    """One thing that differs."""

    aspect: str  # of scene_items.py; INSTANCE for an instance or lamp that is new, gone or renamed; "" for what nobody knows
    name: str  # whose
    sentence: str  # without a capital or a full stop

    def is_everywhere(self) -> bool:
        """Whether it changes all that is seen, wherever it is."""
        return self.aspect in ("", aspects.LAMP, aspects.WORLD, aspects.LIGHT, aspects.REQUIRED)


INSTANCE = "instance"


def changes(before: Items, now: Items, scene: SceneSnapshot) -> tuple[Change, ...]:
    """before: as an asset keeps them, {} where it does not know; now: of `scene`, whole or as kept. What one sentence explains is told once."""
    now, found = kept(now), []
    if before:
        renamed = _renamed(before, now)
        found += [Change(INSTANCE, new, RENAMED.format(old, new)) for old, new in renamed.items()]
        moved_names = {*renamed, *renamed.values()}
        for aspect in (*CHANGED, aspects.MIRRORS, aspects.DRAWN):  # an asset of another version may have others
            found += _of_aspect(aspect, before.get(aspect, {}), now.get(aspect, {}), moved_names)
    found = _without_the_explained(found, scene)
    return tuple({c.sentence: c for c in found}.values()) or (Change("", "", UNKNOWN),)


def _of_aspect(aspect: str, before: Mapping[str, str], now: Mapping[str, str], renamed: set[str]) -> list[Change]:
    both = before.keys() & now.keys()
    gone, new = sorted(before.keys() - both - renamed), sorted(now.keys() - both - renamed)
    found = [Change(aspect, n, CHANGED[aspect].format(n)) for n in sorted(both) if before[n] != now[n]]
    if aspect == aspects.MATERIAL:
        return found  # one that is new or gone is told by whoever has it
    if aspect == aspects.MIRRORS:
        return [*(Change(aspect, n, MIRRORS_NOT.format(n)) for n in gone), *(Change(aspect, n, MIRRORS.format(n)) for n in new)]
    if aspect in COMES_AND_GOES:
        whole = aspects.LAMP if aspect == aspects.LAMP else INSTANCE
        return [*found, *(Change(whole, n, GONE.format(n)) for n in gone), *(Change(whole, n, NEW.format(n)) for n in new)]
    return [*found, *(Change(aspect, n, CHANGED[aspect].format(n)) for n in (*gone, *new))]


def _renamed(before: Items, now: Items) -> dict[str, str]:
    """Old name -> new one, of instances that are the same in all but that."""
    shapes = before.get(aspects.SHAPE, {}), now.get(aspects.SHAPE, {})
    gone, new = shapes[0].keys() - shapes[1].keys(), shapes[1].keys() - shapes[0].keys()
    look = lambda items, name: tuple(items.get(a, {}).get(name) for a in aspects.INSTANCE)
    by_look = {look(now, name): name for name in new}
    return {name: by_look[look(before, name)] for name in sorted(gone) if look(before, name) in by_look}


def _without_the_explained(found: list[Change], scene: SceneSnapshot) -> list[Change]:
    """Slots are told by what they hold: where a material changed that an instance has, that says it. A mirror that came or went says no more."""
    changed = {c.name for c in found if c.aspect == aspects.MATERIAL}
    placed = {c.name for c in found if c.aspect == INSTANCE}
    has = {i.name: {scene.materials[m].name for m in i.materials} for i in scene.instances}

    def is_explained(c: Change) -> bool:
        if c.aspect in (aspects.MATERIALS, aspects.COVER, aspects.OWN):
            return bool(has.get(c.name, set()) & changed)
        return c.aspect == aspects.MIRRORS and c.name in placed

    return [c for c in found if not is_explained(c)]
