"""Where an object, or the scene's camera, is over the scene's frames: the box around its whole way."""

from collections.abc import Callable

import bpy
import numpy as np

from ..core.snapshot import Instance, SceneSnapshot
from .camera import camera_place

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


def camera_way(snapshot: SceneSnapshot) -> tuple[np.ndarray, np.ndarray] | None:
    """(low, high), each (3,) float64 world, of the scene's camera from the first frame to the last, whichever is the scene's
    at each (markers change it); None without one. The scene is at its frame again after."""
    places = [] if snapshot.camera is None else [snapshot.camera]
    scene = bpy.data.scenes.get(snapshot.scene_name)
    if scene and scene.camera and (may_move(scene.camera) or any(m.camera for m in scene.timeline_markers)):
        _at_each_frame(scene, lambda depsgraph: places.append(camera_place(depsgraph)))
        places = [place for place in places if place is not None]
    return (np.min(places, 0).astype(float), np.max(places, 0).astype(float)) if places else None


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
    boxes: dict[str, np.ndarray] = {}
    names = [o.name for o in scene.objects if o.type in {"MESH", "CURVE", "SURFACE", "FONT", "META"} and may_move(o)]

    def look(depsgraph):
        for name in names:
            shown = scene.objects[name].evaluated_get(depsgraph)
            matrix = np.array(shown.matrix_world, np.float64)
            corners = np.array(shown.bound_box, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
            if not np.isfinite(corners).all():
                continue
            box = np.stack([corners.min(0), corners.max(0)])
            old = boxes.get(name, box)
            boxes[name] = np.stack([np.minimum(old[0], box[0]), np.maximum(old[1], box[1])])

    _at_each_frame(scene, look)
    return boxes


def _at_each_frame(scene: bpy.types.Scene, look: Callable[[bpy.types.Depsgraph], None]) -> None:
    """Shows `look` the scene at its frames, MOST_FRAMES at most; then the scene is where it was again."""
    before, part = scene.frame_current, scene.frame_subframe
    layer = next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    try:
        for frame in np.unique(np.linspace(scene.frame_start, scene.frame_end, MOST_FRAMES).astype(int)).tolist():
            scene.frame_set(frame)
            look(layer.depsgraph)
    finally:
        scene.frame_set(before, subframe=part)
