"""What a scene is made of, item by item, each with a hash: what an asset depends on is a choice among them.

Problem. One hash of a scene says that something changed, not what, and calls everything old.
Idea. A scene is a table of items: aspect (what kind of thing) -> name (whose) -> sha256. scene/fingerprint.py fills it. A method's `inputs` picks those
that its bake reads, and an asset keeps what it was made from, so that old and new items tell which changed (staleness.py).
Light is everybody's: Cycles lets every surface light every other one, seen or not. So what holds radiance depends on all items but those that say the
same again; where rays end depends on shapes and places alone, and on materials that let rays through.
"""

import hashlib
from functools import cached_property

from .snapshot import Instance, SceneSnapshot

Items = dict[str, dict[str, str]]  # aspect -> name -> sha256


class Named(dict):
    """Name -> sha256, not changed any more once a snapshot has it: of thousands of things the hash of all is worked out once for all assets."""

    @cached_property
    def digest(self) -> str:
        return _sha256("\n".join(sorted(f"{name}\0{value}" for name, value in self.items())))


# Of each instance, by its name.
SHAPE = "shape"  # its triangles, normals and which slots they show
PAINT = "paint"  # UVs, colours and other values on its mesh, and what of the object its materials ask for
PLACE = "place"
MATERIALS = "materials"  # what is in its slots, by content: a name is none
RAYS = "rays"  # which rays meet it, and what else Cycles keeps on an object
COVER = "cover"  # whether mirrors show it, and where its materials let rays through or move its surface; the same for all that do neither
INSTANCE = (SHAPE, PAINT, PLACE, MATERIALS, RAYS, COVER)
# Of the scene.
LAMP = "lamp"  # all of a lamp, by its name
LAMP_SHAPE = "lamp_shape"  # of those that mirrors show: their place and size
STRANDS = "strands"  # hair, points and volumes, which are no meshes, by their object's name
WORLD = "world"  # and the next: under the name ""
LIGHT = "light"  # bounces, colours' space, a material for all
# By a material's name, for sentences alone: slots hold what it is.
MATERIAL = "material"
# What methods add.
MIRRORS = "mirrors"  # instances that are mirrors to other mirrors
DRAWN = "drawn"  # instances and lamps whose surfaces are drawn, by presence
OWN = "own"  # of a reflector by its name: what else of it alone a method reads
REQUIRED = "required"  # settings of a required asset that the bake reads, by its kind

RADIANCE = (SHAPE, PAINT, PLACE, MATERIALS, RAYS, LAMP, STRANDS, WORLD, LIGHT, MATERIAL)
GEOMETRY = (SHAPE, PLACE, COVER, LAMP_SHAPE, STRANDS)
# Without an instance's shape and place: what surfaces are made of and lit by.
LIT = (MATERIALS, LAMP, STRANDS, WORLD, LIGHT, MATERIAL)

PRESENT = "1"  # in place of a hash, where only whether the item is there matters
KEPT = 12  # hex digits of a hash that an asset keeps to tell what changed; whether anything did, the whole hash tells


def items_of(scene: SceneSnapshot) -> Items:
    """The scene's items. Of a snapshot that was made without (of arrays alone) as much as its arrays and hashes tell; {} without hashes."""
    if scene.items:
        return scene.items
    known = scene.light_hash or scene.geometry_hash
    if not known:
        return {}
    return {SHAPE: {i.name: shape_hash(scene, i) for i in scene.instances}, PLACE: {i.name: place_hash(i) for i in scene.instances}, WORLD: {"": _sha256(known)}}


def shape_hash(scene: SceneSnapshot, instance: Instance) -> str:
    return _sha256(scene.meshes[instance.mesh].key)


def place_hash(instance: Instance) -> str:
    return hashlib.sha256(instance.world_from_object.tobytes()).hexdigest()


def chosen(scene: SceneSnapshot, aspects: tuple[str, ...]) -> Items:
    """The scene's items of these aspects."""
    return {aspect: named for aspect, named in items_of(scene).items() if aspect in aspects}


def radiance(scene: SceneSnapshot, _reflectors: tuple[Instance, ...] = ()) -> Items:
    """What light depends on that is seen anywhere, whoever looks: a method's `inputs`."""
    return chosen(scene, RADIANCE)


def geometry(scene: SceneSnapshot, _reflectors: tuple[Instance, ...] = ()) -> Items:
    """What decides where rays end, whoever sends them: a method's `inputs`."""
    return chosen(scene, GEOMETRY)


def light_alone(scene: SceneSnapshot) -> Items:
    """What surfaces are made of and lit by, whatever their shapes and wherever they are. Of a snapshot that was made without items its light_hash."""
    if scene.items:
        return chosen(scene, LIT)
    return {WORLD: {"": _sha256(scene.light_hash)}} if scene.light_hash else {}


def without(items: Items, aspects: tuple[str, ...], names: set[str]) -> Items:
    """Items but these aspects of these instances."""
    return {a: {n: h for n, h in named.items() if n not in names} if a in aspects else named for a, named in items.items()}


def mirrors(scene: SceneSnapshot) -> dict[str, str]:
    """MIRRORS: a mark may make a mirror of a thing, or no mirror, and changes nothing else of it."""
    shiny = [m.is_reflector for m in scene.materials]
    return {i.name: PRESENT for i in scene.instances if i.is_reflector and any(shiny[m] for m in i.materials)}


def digest(items: Items) -> str:
    """sha256 of items, in any order; "" for none at all. Materials' names are not in it."""
    known = {aspect: named for aspect, named in items.items() if named and aspect != MATERIAL}
    lines = [f"{aspect}\0{named.digest if isinstance(named, Named) else Named(named).digest}" for aspect, named in sorted(known.items())]
    return _sha256("\n".join(lines)) if lines else ""


def kept(items: Items) -> Items:
    """As an asset keeps them."""
    return {aspect: {name: value[:KEPT] for name, value in named.items()} for aspect, named in items.items() if named}


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
