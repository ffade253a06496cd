"""The temporary scene in which rays are traced: the user's objects and world, our camera, our render settings.

A copy of the scene keeps view layers, collections, world and frame. Objects and world are shared with the user's scene,
so what has to differ on them (who sees them, their index) is set for the length of a block and restored.
"""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import bpy

from ..core.errors import ReflectError
from .exr import bundled
from .restore import Change, attributes

OSL_SOURCE = Path(__file__).with_name("ray_camera.osl")
# Object.pass_index is a 16-bit property; 0 is what a miss reads.
MAX_INDEX = 32767
# The smallest clip_start that Blender stores, m: rays may start this close to a surface and still see it.
CLIP_START = 1e-6
# Widths of the map by which Cycles finds a world's lights: Blender's default for a chosen one, and its automatic one.
COARSEST_IMPORTANCE, FINEST_IMPORTANCE = 1024, 4096
# A surface counts as hit where it is at least this opaque: the holes of a leaf's alpha mask are not, a veil is.
OPAQUE_ABOVE = 1e-3


@contextmanager
def ray_scene(
    scene: bpy.types.Scene, folder: Path, hide: frozenset[str], samples: int, as_reflection: bool
) -> Iterator[tuple[bpy.types.Scene, tuple[str, ...]]]:
    """Yields (temporary scene with an OSL ray camera, object names by index - 1 of the Object Index pass).

    Everything is as before afterwards, also when the body raises. Raises ReflectError where Cycles or OSL is missing.
    """
    if not hasattr(scene, "cycles"):
        raise ReflectError("The Cycles add-on is switched off.", "Switch on 'Cycles Render Engine' in the preferences.")
    shader = compile_camera(folder)
    objects = sorted(bpy.data.objects, key=lambda o: o.name_full)
    if unknown := hide - {o.name for o in objects}:
        raise ValueError(f"objects to hide that do not exist: {sorted(unknown)}")
    with ExitStack() as stack:
        stack.callback(_remove_new_images, {image.session_uid for image in bpy.data.images})
        temporary = scene.copy()
        stack.callback(_remove, temporary)
        temporary.name = "Reflect rays"
        layer = _only_layer(scene, temporary)
        camera_data = bpy.data.cameras.new("Reflect rays")
        stack.callback(bpy.data.cameras.remove, camera_data)
        camera = bpy.data.objects.new("Reflect rays", camera_data)
        stack.callback(bpy.data.objects.remove, camera)
        temporary.collection.objects.link(camera)

        _settings(temporary, layer, samples)
        # Adaptive subdivision is diced for the user's camera, so that surfaces are those of the user's picture.
        temporary.cycles.dicing_camera = temporary.cycles.dicing_camera or scene.camera
        temporary.camera = camera
        camera_data.clip_start, camera_data.clip_end = CLIP_START, 3e38
        camera_data.type, camera_data.custom_mode = "CUSTOM", "EXTERNAL"
        camera_data.custom_filepath = str(shader)

        changes: list[Change] = [(o, "pass_index", min(i + 1, MAX_INDEX)) for i, o in enumerate(objects)]
        changes += _visibility(objects, hide, as_reflection)
        if as_reflection:
            _as_seen_by_rays(layer.layer_collection)
            for world in {temporary.world, layer.world_override} - {None}:
                changes.append((world.cycles_visibility, "camera", world.cycles_visibility.glossy))
        for world in {temporary.world, layer.world_override} - {None}:
            changes += _importance_map(world)
        stack.enter_context(attributes(changes))
        yield temporary, tuple(o.name for o in objects)


def compile_camera(folder: Path) -> Path:
    """Compiles the ray camera to folder/ray_camera.oso. Raises ReflectError in a Blender without Cycles or OSL."""
    bundled("oslquery")
    bundled("OpenImageIO")
    remedy = (
        "Use the official build from blender.org, or set 'Bake Worker' in the add-on's preferences to the "
        "project's own Python (.venv/bin/python)."
    )
    if not build_options().cycles_osl:
        raise ReflectError(f"This Blender ({bpy.app.version_string}) was built without Cycles' OSL.", remedy)
    import _cycles

    compiled = folder / "ray_camera.oso"
    if not _cycles.osl_compile(str(OSL_SOURCE), str(compiled)) or not compiled.is_file():
        raise ReflectError(f"The ray camera {OSL_SOURCE} did not compile.", "Install the add-on again.")
    return compiled


def build_options():
    return bpy.app.build_options


def _only_layer(scene: bpy.types.Scene, temporary: bpy.types.Scene) -> bpy.types.ViewLayer:
    """The copy of the layer that would be rendered first, made the only one that is."""
    name = next((layer.name for layer in scene.view_layers if layer.use), scene.view_layers[0].name)
    for layer in temporary.view_layers:
        layer.use = layer.name == name
    return temporary.view_layers[name]


def _remove(temporary: bpy.types.Scene) -> None:
    """Frees the scene's render engine before the scene.

    Blender (5.2.3) keeps engines by the address of their scene. One that outlives its scene goes on with freed data as
    soon as another copy lies at the same address, and crashes now and then.
    """
    temporary.render.use_persistent_data = False
    bpy.data.scenes.remove(temporary)


def _remove_new_images(known: set[int]) -> None:
    """The first render of a session adds the image 'Render Result' to the file."""
    for image in [i for i in bpy.data.images if i.session_uid not in known]:
        bpy.data.images.remove(image)


def plain_output(scene: bpy.types.Scene) -> None:
    """Nothing between the render engine and an uncompressed float EXR of the whole picture."""
    render, image = scene.render, scene.render.image_settings
    for name, value in {
        "resolution_percentage": 100, "pixel_aspect_x": 1.0, "pixel_aspect_y": 1.0, "use_border": False,
        "use_crop_to_border": False, "film_transparent": False, "use_motion_blur": False, "use_freestyle": False,
        "use_multiview": False, "use_compositing": False, "use_sequencer": False, "use_stamp": False,
        "use_file_extension": False, "use_overwrite": True, "use_placeholder": False, "save_output": True,
        "use_persistent_data": True, "dither_intensity": 0.0,
    }.items():  # fmt: skip
        setattr(render, name, value)
    image.media_type = "MULTI_LAYER_IMAGE"  # before file_format, which it restricts
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"
    image.exr_codec, image.use_exr_interleave = "NONE", True


def _settings(scene: bpy.types.Scene, layer: bpy.types.ViewLayer, samples: int) -> None:
    """One exact ray per pixel, nothing between the integrator and the file; light bounces stay the user's."""
    scene.animation_data_clear()
    scene.timeline_markers.clear()  # a marker would bind another camera
    plain_output(scene)
    scene.render.engine, cycles = "CYCLES", scene.cycles
    for name, value in {
        "device": "CPU", "samples": samples, "use_layer_samples": "IGNORE", "use_sample_subset": False,
        "sample_offset": 0, "time_limit": 0.0, "use_denoising": False, "use_adaptive_sampling": False,
        "use_animated_seed": False, "film_exposure": 1.0,
        # Through the pixel's centre. (BOX ignores its width and reaches the pixel's edges.)
        "pixel_filter_type": "BLACKMAN_HARRIS", "filter_width": 0.01, "use_pixel_jitter": False,
        "use_auto_tile": False, "use_guiding": False, "use_camera_cull": False,
        "use_distance_cull": False,
    }.items():  # fmt: skip
        setattr(cycles, name, value)
    layer.pass_alpha_threshold = OPAQUE_ABOVE
    for name in [p.identifier for p in layer.bl_rna.properties if p.identifier.startswith("use_pass_")]:
        setattr(layer, name, False)
    layer.use_pass_combined = layer.use_pass_position = layer.use_pass_normal = layer.use_pass_object_index = True


def _visibility(objects: list[bpy.types.Object], hide: frozenset[str], as_reflection: bool) -> list[Change]:
    changes: list[Change] = []
    for o in objects:
        seen = o.visible_camera
        if as_reflection:
            seen = o.visible_glossy
            if o.type != "LIGHT":
                changes += [(o, "is_holdout", False), (o, "is_shadow_catcher", False)]
        changes.append((o, "visible_camera", seen and o.name not in hide))
    return changes


def _importance_map(world: bpy.types.World) -> list[Change]:
    """Twice as fine as the world's pictures, so that a sun of one pixel is found for what it is.

    Cycles' automatic choice was 4096 wide for a picture of 512 (5.2.3): over a second for every bundle of rays. Sky
    textures, groups and what else may hold small suns keep the automatic choice.
    """
    if world.cycles.sampling_method != "AUTOMATIC" or world.node_tree is None:
        return []
    textures = [node for node in world.node_tree.nodes if node.type.startswith("TEX_") and node.type != "TEX_COORD"]
    pictures = [node.image for node in textures if node.type == "TEX_ENVIRONMENT"]
    if not textures or len(pictures) < len(textures) or any(n.type == "GROUP" for n in world.node_tree.nodes):
        return []
    widths = [image.size[0] for image in pictures if image is not None]
    resolution = int(min(max([COARSEST_IMPORTANCE, *(2 * w for w in widths)]), FINEST_IMPORTANCE))
    return [(world.cycles, "sampling_method", "MANUAL"), (world.cycles, "sample_map_resolution", resolution)]


def _as_seen_by_rays(collection: bpy.types.LayerCollection) -> None:
    """Holdout and 'indirect only' are about the camera; a reflected ray knows neither. (This layer is our copy.)"""
    collection.holdout = collection.indirect_only = False
    for child in collection.children:
        _as_seen_by_rays(child)
