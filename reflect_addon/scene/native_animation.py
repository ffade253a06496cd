"""Animated values and drivers of sockets that have a twin.

Problem. A copied material has some of its shader nodes twice, once for Cycles and once for EEVEE; what moves the first must move the
second.
Idea. Every curve and driver whose path is a twin's first socket is made again for the other. Curves live in actions that the copy shares
with the artist's material, so the copy gets actions of its own first; drivers were copied with the material.
Limits. Animated properties of nodes that are no socket (a mute, a distribution) stay with the first.
"""

from collections.abc import Iterator

import bpy

from .native_marks import OURS

Twins = dict[str, list[str]]  # path of a socket's value -> those that follow it


def animated_paths(tree: bpy.types.NodeTree, owner: bpy.types.ID | None = None) -> set[str]:
    """Paths, from the tree, of all that is animated or driven there; owner: the material whose tree it is."""
    found = set()
    for block, prefix in _holders(tree, owner):
        animation = block.animation_data
        if animation is None:
            continue
        curves = [curve for _, _, bag in bags(animation) for curve in bag.fcurves]
        found |= {c.data_path.removeprefix(prefix) for c in (*curves, *animation.drivers) if c.data_path.startswith(prefix)}
    return found


def follow(tree: bpy.types.NodeTree, owner: bpy.types.ID | None, twins: Twins) -> None:
    """Makes the twins follow. tree and owner are ours, their actions perhaps still the artist's."""
    for block, prefix in _holders(tree, owner):
        animation = block.animation_data
        if animation is None:
            continue
        for driver in list(animation.drivers):
            for path in _paths(block, driver, prefix, twins):
                animation.drivers.from_existing(src_driver=driver).data_path = path
        for holder, slot, bag in list(bags(animation)):
            if any(_paths(block, curve, prefix, twins) for curve in bag.fcurves):
                bag = _own_bag(holder, slot)
                for curve in list(bag.fcurves):
                    for path in _paths(block, curve, prefix, twins):
                        bag.fcurves.new_from_fcurve(curve, data_path=path)


def _holders(tree, owner) -> tuple[tuple[bpy.types.ID, str], ...]:
    """(block, what its paths begin with): a tree's values may be animated by the tree or by the material around it."""
    return ((tree, ""), (owner, "node_tree.")) if owner is not None else ((tree, ""),)


def _paths(block, curve, prefix: str, twins: Twins) -> list[str]:
    """Where a curve is to be made again. A colour's alpha has no place in a vector."""
    if not curve.data_path.startswith(prefix):
        return []
    found = (prefix + path for path in twins.get(curve.data_path.removeprefix(prefix), ()))
    return [path for path in found if curve.array_index < _size(block.path_resolve(path))]


def _size(value) -> int:
    return len(value) if hasattr(value, "__len__") else 1


def bags(animation) -> Iterator[tuple[object, bpy.types.ActionSlot, object]]:
    """(who uses an action, with which slot, that slot's curves): the block itself, and its NLA strips."""
    strips = [strip for track in animation.nla_tracks for strip in track.strips]
    for holder in (animation, *strips):
        if holder.action is not None and holder.action_slot is not None:
            if (bag := _bag(holder.action, holder.action_slot.handle)) is not None:
                yield holder, holder.action_slot, bag


def _bag(action, slot_handle: int):
    found = (bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags)
    return next((bag for bag in found if bag.slot_handle == slot_handle), None)


def _own_bag(holder, slot):
    """The curves of the holder's slot in an action that is ours; copied for this holder where it was the artist's."""
    handle = slot.handle
    if OURS not in holder.action:
        copied = holder.action.copy()
        copied[OURS] = True
        holder.action = copied
        holder.action_slot = next(s for s in copied.slots if s.handle == handle)
    return _bag(holder.action, handle)
