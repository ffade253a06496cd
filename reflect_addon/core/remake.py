"""Which stand-ins are made again, and which only move, when the scene has changed [popescu-2006 section 3].

Problem. Objects move while somebody looks; making every stand-in again at each step costs more than drawing.
Idea, in the paper's words: a flat billboard "does not need to be re-rendered when the reflectors or the replaced object
move"; another one "is re-rendered when the object or the reflector move or deform, or when the lighting changes"; "view
changes alone do not require re-rendering". A depth map (section 6) is a camera beside its object: when either moves
rigidly the map goes along and nothing is rebuilt. So a kind of stand-in is a row of RULES, and the rest follows from
comparing what an asset remembers (core/asset.py, Part) with the scene as it is.
Where we depart. Light and deformation make flat stand-ins again too: the paper's sentence about them is on motion only.
A motion counts as rigid when it is one with a uniform scale; sheared or squeezed is deformed.
Limits. What moves casts other shadows and lights other things: that is the light's business and needs a bake.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from .asset import Asset, Part
from .snapshot import Instance, SceneSnapshot

REFLECTOR = "reflector"  # the kind of the part that is the asset's own reflector
# Two matrices are one place when they differ by less than this, relative to their largest number: float32 matrices
# come back from a worker and from a window with other roundings.
SAME_PLACE = 1e-6
# A motion is rigid (but for a uniform scale) when its axes are equally long and orthogonal within this.
RIGID = 1e-4


@dataclass(frozen=True)
class Rule:
    """What a kind of stand-in needs: 'stay', 'move' (placed anew) or 'remake' (captured anew)."""

    object_moves: str  # rigidly
    reflector_moves: str
    reflector_deforms: str


# An object that deforms, and light or a material that changes, make every kind again.
RULES = {
    "flat": Rule(object_moves="move", reflector_moves="stay", reflector_deforms="stay"),
    "volume": Rule(object_moves="remake", reflector_moves="remake", reflector_deforms="remake"),
    # Stand-ins with normals, which are the world's: they do not turn with the object.
    "mirror": Rule(object_moves="remake", reflector_moves="remake", reflector_deforms="remake"),
    "flat_mirror": Rule(object_moves="remake", reflector_moves="stay", reflector_deforms="stay"),
    "mirror_map": Rule(object_moves="remake", reflector_moves="stay", reflector_deforms="stay"),
    # What is shaded at the hit has normals as well, and lamps' shares that no capture makes.
    "glossy": Rule(object_moves="remake", reflector_moves="remake", reflector_deforms="remake"),
    "flat_glossy": Rule(object_moves="remake", reflector_moves="stay", reflector_deforms="stay"),
    "glossy_map": Rule(object_moves="remake", reflector_moves="stay", reflector_deforms="stay"),
    # Depth maps stand beside their object; a reflector's map of itself is a map whose object is the reflector.
    "map": Rule(object_moves="move", reflector_moves="stay", reflector_deforms="stay"),
    # Surface radiance lies on the object itself.
    "surface": Rule(object_moves="move", reflector_moves="stay", reflector_deforms="stay"),
}


@dataclass(frozen=True)
class Remake:
    """The parts of an asset (without the reflector's) that a change of the scene concerns; no part is in two of them."""

    remade: tuple[Part, ...] = ()  # to be captured again
    moved: tuple[Part, ...] = ()  # to be placed anew
    gone: tuple[Part, ...] = ()  # their objects are hidden or deleted: nothing is to be seen there


def part_of(scene: SceneSnapshot, instance: Instance, kind: str, row: int) -> Part:
    """What `row` stands for, as the scene is now."""
    place = tuple(float(n) for n in np.asarray(instance.world_from_object, np.float64).ravel())
    return Part(instance.name, kind, row, place, scene.meshes[instance.mesh].key)


def parts_of(scene: SceneSnapshot, reflector: Instance, stand_ins: Iterable[tuple[str, str]]) -> tuple[Part, ...]:
    """Parts of an asset: its reflector, then one for each (instance's name, kind of stand-in), rows in their order."""
    named = scene.named()
    rows = [part_of(scene, named[name], kind, row) for row, (name, kind) in enumerate(stand_ins)]
    return (part_of(scene, reflector, REFLECTOR, -1), *rows)


def remake_set(asset: Asset, scene: SceneSnapshot) -> Remake:
    """What of an asset has to be made again for the scene as it is now. Assets without parts know nothing: empty."""
    named = scene.named()
    found: dict[str, list[Part]] = {"remake": [], "move": [], "gone": [], "stay": []}
    own = next((part for part in asset.parts if part.kind == REFLECTOR), None)
    viewer = named.get(own.instance) if own else None
    # A reflector that is not there is seen by nobody: its stand-ins may stay as they are.
    viewer_moves = viewer is not None and not same_place(own, viewer)
    viewer_deforms = viewer is not None and _deformed(own, viewer, scene)
    relit = asset.light_hash != scene.light_hash
    for part in asset.parts:
        if part.kind not in RULES:
            continue  # the reflector; a kind of another version
        rule, instance = RULES[part.kind], named.get(part.instance)
        if instance is None:
            found["gone"].append(part)
            continue
        needs = {"remake"} if relit or _deformed(part, instance, scene) else set()
        needs |= {rule.object_moves} if not same_place(part, instance) else set()
        needs |= {rule.reflector_moves} if viewer_moves else set()
        needs |= {rule.reflector_deforms} if viewer_deforms else set()
        found[next((need for need in ("remake", "move") if need in needs), "stay")].append(part)
    return Remake(tuple(found["remake"]), tuple(found["move"]), tuple(found["gone"]))


def same_triangles(one: str, other: str) -> bool:
    """Whether two Mesh.keys are of as many triangles and vertices: one may be the other deformed."""
    return one.partition("-")[0] == other.partition("-")[0]


def same_place(part: Part, instance: Instance) -> bool:
    """Whether the instance is where it was when the part was made."""
    before, now = part.matrix(), np.asarray(instance.world_from_object, np.float64)
    return bool(np.abs(now - before).max() <= SAME_PLACE * max(np.abs(before).max(), 1e-30))


def motion(part: Part, instance: Instance) -> np.ndarray:
    """(4, 4) float64, world_from_world: from where the part was made to where its instance is."""
    return np.asarray(instance.world_from_object, np.float64) @ np.linalg.inv(part.matrix())


def is_rigid(world_from_world: np.ndarray) -> bool:
    """Whether a motion keeps shapes, mirrored ones not included; one size for all directions may change."""
    linear = world_from_world[:3, :3]
    determinant = np.linalg.det(linear)
    if not determinant > 0:
        return False
    unit = linear / np.cbrt(determinant)
    return bool(np.abs(unit @ unit.T - np.eye(3)).max() < RIGID)


def _deformed(part: Part, instance: Instance, scene: SceneSnapshot) -> bool:
    if scene.meshes[instance.mesh].key != part.mesh or np.linalg.det(part.matrix()) == 0:
        return True
    return not same_place(part, instance) and not is_rigid(motion(part, instance))
