"""Blender's cameras, and a viewport's own, as a core.camera.Camera."""

import bpy
import numpy as np

from ..core.camera import Camera
from ..core.errors import ReflectError


def camera_of(scene: bpy.types.Scene, obj: bpy.types.Object | None, width: int, height: int) -> Camera:
    """The camera (the scene's when obj is None) for a picture of width x height square pixels.

    Lens, sensor fit, shift, clipping and pose are Blender's, the pose without scale, as renderers take it.
    Raises ReflectError without a camera, for panoramic and custom cameras, and for a pose or lens that is no number.
    """
    obj = obj or scene.camera
    if obj is None:
        raise ReflectError(
            f"The scene {scene.name} has no camera.", "Add a camera and make it the scene's, or name one with --camera."
        )
    if obj.type != "CAMERA":
        raise ReflectError(f"{obj.name} is not a camera.", "Name a camera object.")
    if obj.data.type not in {"PERSP", "ORTHO"}:
        raise ReflectError(
            f"The camera {obj.name} is {obj.data.type.lower()}, which has no single projection.",
            "Choose Perspective or Orthographic in the camera's lens settings.",
        )
    view_layer = next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    view_layer.update()
    depsgraph = view_layer.depsgraph
    evaluated = obj.evaluated_get(depsgraph)
    pose = np.array(evaluated.matrix_world, np.float64)
    axes = pose[:3, :3]
    lengths = np.linalg.norm(axes, axis=0)
    if not np.isfinite(pose).all() or not lengths.all():
        raise ReflectError(f"The camera {obj.name} has scale 0 or an impossible place.", "Reset its transform.")
    axes = axes / lengths
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3], world_from_camera[:3, 3] = axes, pose[:3, 3]
    projection = np.array(evaluated.calc_matrix_camera(depsgraph, x=width, y=height), np.float64)
    return Camera(world_from_camera, projection, width, height)


def camera_place(depsgraph: bpy.types.Depsgraph) -> tuple[float, float, float] | None:
    """World, m: where the scene's camera stands; None without one, or where that is no place."""
    if depsgraph.scene.camera is None:
        return None
    place = tuple(depsgraph.scene.camera.evaluated_get(depsgraph).matrix_world.translation)
    return place if np.isfinite(place).all() else None


def viewport_cameras(scene: bpy.types.Scene) -> list[Camera]:
    """Those of all 3D viewports that show a scene now."""
    found = []
    for area in (area for window in bpy.context.window_manager.windows if window.scene == scene for area in window.screen.areas):
        if area.type == "VIEW_3D":
            space, regions = area.spaces.active, [r for r in area.regions if r.type == "WINDOW"]
            shown = zip(regions, space.region_quadviews or [space.region_3d], strict=False)
            found += [viewport_camera(region, data) for region, data in shown if min(region.width, region.height) > 1]
    return found


def viewport_camera(region: bpy.types.Region, region_data: bpy.types.RegionView3D) -> Camera:
    """The camera of a 3D viewport."""
    view = np.array(region_data.view_matrix, np.float64)
    return Camera(
        np.linalg.inv(view), np.array(region_data.window_matrix, np.float64), int(region.width), int(region.height)
    )
