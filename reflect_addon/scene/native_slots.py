"""Which material a slot showed before it got one of ours, kept with the object in the file.

Problem. A slot takes its material from the mesh or from the object, and each of the two remembers its own. Ours must come and go without a trace.
Idea. Ours always sits on the object: the mesh, which others may share, is not touched. A record on the object (properties.ReflectNativeSlot) holds what
the slot was linked to and what the object had there; its pointers count as users, so that nothing is purged meanwhile.
Limits. Where a slot was given another material by hand since, that one stays.
"""

from collections.abc import Callable

import bpy


def put(obj: bpy.types.Object, index: int, own: bpy.types.Material) -> Callable[[], None]:
    """Shows one of our materials in a slot. Returns what undoes it."""
    slot = obj.material_slots[index]
    record = next((r for r in obj.reflect_native if r.own is not None and r.own == slot.material), None)
    if record is not None:  # ours is there already, from an earlier bake
        before = record.own
        slot.material = record.own = own
        return lambda: _set(slot, record, before)
    record = obj.reflect_native.add()
    record.index, record.link, record.own = index, slot.link, own
    slot.link = "OBJECT"
    record.material, slot.material = slot.material, own
    return lambda: take_back(obj, len(obj.reflect_native) - 1)


def _set(slot, record, own) -> None:
    slot.material = record.own = own


def take_back(obj: bpy.types.Object, position: int) -> bool:
    """Puts a slot back to what its record says, and forgets the record. False where ours is no longer in the slot."""
    record = obj.reflect_native[position]
    slots = list(obj.material_slots)
    # Slots move when others are added or removed: the record's own place first, then any other that still shows ours.
    slots = slots[record.index : record.index + 1] + slots
    slot = next((s for s in slots if s.link == "OBJECT" and record.own is not None and s.material == record.own), None)
    if slot is not None:
        slot.material = record.material
        slot.link = record.link
    obj.reflect_native.remove(position)
    return slot is not None
