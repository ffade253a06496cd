"""Where an object is over the scene's frames: the box around its whole way."""

from collections.abc import Callable

import bpy
import numpy as np

from ..core.snapshot import Instance, SceneSnapshot

# Frames that are looked at; a longer scene is looked at evenly.
MOST_FRAMES = 250


def ways(snapshot: SceneSnapshot) -> Callable[[Instance], tuple[np.ndarray, np.ndarray]]:
    """bounds(instance) -> (low, high), each (3,) float64 world, from the scene's first to its last frame. The frames are gone
    through once, when the first instance that may move is asked for; the scene is at its frame again after. What cannot move,
    and copies that an instancer makes, stay where the snapshot has them. Deformation counts by the object's box."""
    found: dict[str, np.ndarray] = {}

    def bounds(instance: Instance) -> tuple[np.ndarray, np.ndarray]:
        own = snapshot.bounds([instance])
        scene = bpy.data.scenes.get(snapshot.scene_name)
        obj = scene.objects.get(instance.object_name) if scene and instance.name == instance.object_name else None
        if obj is None or not may_move(obj):
            return own
        if not found:
            found.update(_boxes(scene))
        corners = np.concatenate([np.stack(own), found.get(obj.name, np.stack(own))])
        return corners.min(0), corners.max(0)

    return bounds


def may_move(obj: bpy.types.Object) -> bool:
    """Whether anything that Blender could move it by is there: animation, drivers, constraints, physics, on it or above it."""
    while obj is not None:
        data = [obj, obj.data, getattr(obj.data, "shape_keys", None)]
        if any(getattr(d, "animation_data", None) for d in data) or len(obj.constraints) or obj.rigid_body:
            return True
        if any(m.type in {"ARMATURE", "CLOTH", "SOFT_BODY", "NODES", "MESH_CACHE", "MESH_SEQUENCE_CACHE", "HOOK"} for m in obj.modifiers):
            return True
        obj = obj.parent
    return False


def _boxes(scene: bpy.types.Scene) -> dict[str, np.ndarray]:
    """(2, 3) low and high corner over the frames of each object that may move."""
    before, part = scene.frame_current, scene.frame_subframe
    frames = np.unique(np.linspace(scene.frame_start, scene.frame_end, MOST_FRAMES).astype(int))
    boxes: dict[str, np.ndarray] = {}
    names = [o.name for o in scene.objects if o.type in {"MESH", "CURVE", "SURFACE", "FONT", "META"} and may_move(o)]
    layer = next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    try:
        for frame in frames.tolist():
            scene.frame_set(frame)
            depsgraph = layer.depsgraph
            for name in names:
                shown = scene.objects[name].evaluated_get(depsgraph)
                matrix = np.array(shown.matrix_world, np.float64)
                corners = np.array(shown.bound_box, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
                if not np.isfinite(corners).all():
                    continue
                box = np.stack([corners.min(0), corners.max(0)])
                old = boxes.get(name, box)
                boxes[name] = np.stack([np.minimum(old[0], box[0]), np.maximum(old[1], box[1])])
    finally:
        scene.frame_set(before, subframe=part)
    return boxes
