"""What an earlier light field still holds when something in the scene has changed: all but the views that saw it.

An asset remembers, as parts of the kind SEEN, every other instance with the box around it and a hash of all that it is. What
differs now has changed; a view is traced again when one of its texels looks at the box that the thing had, or has now.
Limits. The shadow and the light that it casts elsewhere stay as they were in the other views: they need a whole bake, as
lights, materials and the world do.
"""

from collections.abc import Callable

import numpy as np

from .asset import Asset, Part
from .job import BakeJob
from .light_field import Cell, closest, inside, room
from .snapshot import Instance, SceneSnapshot

SEEN = "seen"
# Boxes are this share of the cell's size larger: a flat thing has one, too.
SKIN = 1e-4


def seen_parts(scene: SceneSnapshot, reflectors: tuple[Instance, ...]) -> tuple[Part, ...]:
    """A part for each instance that is no reflector of the asset: its matrix takes the cube of side 2 to the box around it."""
    own = {r.name for r in reflectors}
    parts = []
    for instance in scene.instances:
        if instance.name in own:
            continue
        low, high = scene.bounds([instance])
        box = np.diag([*((high - low) / 2), 1.0])
        box[:3, 3] = (low + high) / 2
        parts.append(Part(instance.name, SEEN, 0, tuple(map(float, box.ravel())), scene.instance_hash(instance)))
    return tuple(parts)


def changed_boxes(job: BakeJob, cell: Cell, earlier: Asset | None) -> np.ndarray | None:
    """(N, 2, 3) centres and half sides of what has changed since `earlier`; None where all must be traced again: another cell,
    other light, or a change that no instance tells of."""
    if earlier is None or "light_field_tx" not in earlier.images or not earlier.light_hash:
        return None
    if earlier.light_hash != job.scene.light_hash or not cell.is_of(earlier.uniforms):
        return None
    before, now = ({p.instance: p for p in parts if p.kind == SEEN} for parts in (earlier.parts, seen_parts(job.scene, job.reflectors())))
    changed = [n for n in before.keys() | now.keys() if n not in before or n not in now or before[n].mesh != now[n].mesh]
    boxes = [part.matrix() for n in changed for part in (before.get(n), now.get(n)) if part is not None]
    return np.array([[box[:3, 3], np.diag(box)[:3]] for box in boxes]) if boxes else None


def views_that_saw(cell: Cell, face: int, boxes: np.ndarray, traced: np.ndarray, wanted: Callable | None) -> Callable:
    """wanted() for light_field.bundle: whole views of which a texel sees a box, and texels that were not traced so far.

    traced: (side, side) bool, of the earlier slab of this face."""
    n, m = cell.views, cell.texels

    def saw(rows, point, direction):
        enter, leave = inside(point, direction, cell.half + room(cell, face))
        start, sees = closest(cell, point, direction), np.zeros(point.shape[:2], bool)
        for center, half in boxes:
            first, last = inside(point, direction, half + SKIN * cell.size(), center - cell.center)
            sees |= (first <= last) & (last >= start)
        sees &= enter <= leave
        whole = sees.reshape(-1, m, n, m).any((1, 3))
        again = whole.repeat(m, 0).repeat(m, 1) | ~traced[rows]
        return again if wanted is None else again & wanted(rows, point, direction)

    return saw
