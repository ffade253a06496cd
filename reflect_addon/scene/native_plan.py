"""Which slots of which objects get native reflections, decided before anything is changed.

Problem. Files hold linked objects, instances, materials from modifiers, assets that are missing or old. Half of an object must never be
changed.
Idea. Object by object: either every mirror-like slot of it is planned, or a sentence says why none is and what to do.
Limits. One object shows one asset: duplicates with assets of their own share the object's materials and are refused.
"""

from collections.abc import Collection
from dataclasses import dataclass

import bpy

from ..core import lobe_rays, methods
from ..core.asset import Asset, asset_of
from ..core.shading import ROUGHNESS_SPREAD
from ..core.snapshot import Instance, SceneSnapshot
from .materials import MAX_ROUGHNESS
from .native_marks import original_of
from .node_report import groups_of

# Roughness up to which one ray stands for the lobe (lobe_rays.count): most mirrors, whose groups then draw no ray of it.
ONE_RAY = (lobe_rays.FINE / ROUGHNESS_SPREAD) ** 0.5
ANY_ROUGHNESS = 1.0  # of what is marked by hand: it mirrors whatever its materials say


@dataclass(frozen=True)
class Change:
    """A slot that is to show a material with the asset's reflections."""

    obj: bpy.types.Object
    index: int
    material: bpy.types.Material  # the artist's
    asset: Asset
    roughest: float  # lobes up to this roughness are replaced


@dataclass(frozen=True)
class Plan:
    changes: tuple[Change, ...]
    sentences: tuple[str, ...]  # one for each object that stays as it is, or shows something else than the overlay


def plan(scene: bpy.types.Scene, snapshot: SceneSnapshot, assets: dict[str, Asset], method: str, stale: Collection[str]) -> Plan:
    """assets: by reflector, joined with what they require. stale: reflectors whose assets were baked from another state."""
    changes, sentences = [], []
    for name, instances in _by_object(snapshot).items():
        found = [asset_of(assets, instance) for instance in instances]
        obj = _object(scene, name)
        reason = _reason(obj, instances, found, method, stale, snapshot)
        if reason:
            sentences.append(f"{name} {reason}")
            continue
        slots = _slots(obj, instances[0], snapshot)
        changes += [Change(obj, index, material, found[0], roughest) for index, material, roughest in slots]
        if not slots:
            sentences.append(f"{name} has no material that mirrors: give it one.")
        elif said := instead_of_views(name, found[0]):
            sentences.append(said)
    return Plan(tuple(changes), tuple(sentences))


def instead_of_views(name: str, asset: Asset) -> str:
    """What a material shows of a reflector that a plan lets a mirrored view draw; "" of others."""
    if asset.kind in methods.gathering():
        return ""
    return f"{name} has a mirrored view, which no material can draw: its distance map answers there. Bake with Mirrored Views switched off for a nearer stand-in."


def _by_object(snapshot: SceneSnapshot) -> dict[str, list[Instance]]:
    found: dict[str, list[Instance]] = {}
    for instance in snapshot.reflectors():
        found.setdefault(instance.object_name, []).append(instance)
    return found


def _object(scene: bpy.types.Scene, name: str) -> bpy.types.Object | None:
    """The object of a snapshot's name: the scene's, else (an instance's) the file's, linked or not."""
    candidates = [o for o in (*scene.objects, *bpy.data.objects) if o.name == name]
    return candidates[0] if candidates else None


def _reason(obj, instances, found, method: str, stale, snapshot: SceneSnapshot) -> str:
    """Why an object stays as it is, as the rest of a sentence that begins with its name; "" when nothing is in the way."""
    if obj is None:
        return "is not in the file any more: look again, then bake."
    if None in found:
        return f"has no asset of {method}: bake first."
    if any(instance.name in stale for instance in instances):
        return "was baked from another state of the scene: bake again first."
    if len({id(asset) for asset in found}) > 1:
        return "stands in the scene several times with an asset each, and its materials can show one: make the instances real."
    if obj.library is not None:
        return f"is linked from {obj.library.name}, which cannot be changed from here: make a library override of it, or make it local."
    if obj.override_library is not None and obj.override_library.is_system_override:
        return "belongs to a library override that is not editable: make that override editable, or the object local."
    if obj.mode != "OBJECT":
        return "is being edited: leave its Edit Mode first."
    if not obj.material_slots:
        return "has no material slot: give it a material."
    shown = [snapshot.materials[m].name for m in instances[0].materials]
    if [_name(slot.material) for slot in obj.material_slots] != shown:
        return "gets its materials from a modifier or from what it instances: assign them to the object's own slots."
    return ""


def _name(material) -> str:
    return "" if material is None else original_of(material).name


def _slots(obj, instance: Instance, snapshot: SceneSnapshot) -> list[tuple[int, bpy.types.Material, float]]:
    """(index, the artist's material, roughest lobe) of the slots that are to change."""
    by_hand = instance.mark == "YES"
    found = []
    for index, (slot, number) in enumerate(zip(obj.material_slots, instance.materials)):
        material = original_of(slot.material)
        if material is not None and material.node_tree is not None and (by_hand or snapshot.materials[number].is_reflector):
            found.append((index, material, ANY_ROUGHNESS if by_hand else MAX_ROUGHNESS))
    return found


def may_be_rough(material: bpy.types.Material) -> bool:
    """Whether some surface of it may need more than one ray: a roughness is large, or comes from elsewhere."""
    trees = groups_of(material.node_tree)
    if any(block.animation_data for block in (material, *trees)):
        return True
    sockets = [socket for tree in trees for node in tree.nodes for socket in node.inputs if socket.name in ("Roughness", "Coat Roughness")]
    return any(socket.is_linked or socket.default_value > ONE_RAY for socket in sockets)
