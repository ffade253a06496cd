"""What the sample scenes are made of: materials, swept and turned shapes, lights, a camera, and saving.

Everything is in metres and deterministic; meshes come from arrays, so a rebuilt scene has the same vertices everywhere.
"""

import math
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

HERE = Path(__file__).resolve().parent


def start(name, frames=(1, 1)):
    """Empty this Blender and set up a scene for Cycles at 640 x 480, 64 samples; returns the scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return prepare(bpy.context.scene, name, frames)


def prepare(scene, name, frames=(1, 1)):
    """The same settings for a scene that is there already."""
    scene.name = name
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = 640, 480
    scene.cycles.samples = 64
    scene.cycles.use_denoising = False
    scene.frame_start, scene.frame_end = frames
    scene.frame_set(frames[0])
    world = bpy.data.worlds.new(name)
    scene.world = world
    set_world(scene, (0.0, 0.0, 0.0))
    return scene


def set_world(scene, colour, strength=1.0):
    """A world of one colour (scene-linear)."""
    background = _node(scene.world.node_tree, "BACKGROUND")
    background.inputs["Color"].default_value = (*colour, 1.0)
    background.inputs["Strength"].default_value = strength


def set_world_image(scene, image, turn=0.0, strength=1.0):
    """An equirectangular world, turned by `turn` radians about the vertical."""
    tree = scene.world.node_tree
    coordinates, mapping = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeMapping")
    environment = tree.nodes.new("ShaderNodeTexEnvironment")
    environment.image = image
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, turn)
    background = _node(tree, "BACKGROUND")
    background.inputs["Strength"].default_value = strength
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], environment.inputs["Vector"])
    tree.links.new(environment.outputs["Color"], background.inputs["Color"])


def _node(tree, kind):
    return next(node for node in tree.nodes if node.type == kind)


def material(name, colour=(0.8, 0.8, 0.8), roughness=0.9, metallic=0.0, specular=0.0, emission=0.0, **inputs):
    """A Principled material, matt unless told otherwise; `inputs` are more sockets by name, blanks as underscores."""
    made = bpy.data.materials.new(name)
    made.diffuse_color = (*colour, 1.0)
    shader = _node(made.node_tree, "BSDF_PRINCIPLED")
    values = {
        "Base Color": (*colour, 1.0),
        "Roughness": roughness,
        "Metallic": metallic,
        "Specular IOR Level": specular,
    }
    if emission:
        values |= {"Emission Color": (*colour, 1.0), "Emission Strength": emission}
    values |= {key.replace("_", " "): value for key, value in inputs.items()}
    for key, value in values.items():
        shader.inputs[key].default_value = value
    return made


def mirror(name="Mirror", colour=(0.95, 0.95, 0.95)):
    """A perfect metal mirror."""
    return material(name, colour, roughness=0.0, metallic=1.0, specular=0.5)


def checker(name, first, second, size):
    """A matt checker of squares `size` metres wide, fixed to the object."""
    made = material(name, first)
    tree = made.node_tree
    coordinates, pattern = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeTexChecker")
    # Off the grid by a third of a square: a surface exactly on a cell border flickers between the two colours.
    shift = tree.nodes.new("ShaderNodeVectorMath")
    shift.inputs[1].default_value = (size / 3.0,) * 3
    pattern.inputs["Color1"].default_value = (*first, 1.0)
    pattern.inputs["Color2"].default_value = (*second, 1.0)
    pattern.inputs["Scale"].default_value = 1.0 / size
    tree.links.new(coordinates.outputs["Object"], shift.inputs[0])
    tree.links.new(shift.outputs[0], pattern.inputs["Vector"])
    tree.links.new(pattern.outputs["Color"], _node(tree, "BSDF_PRINCIPLED").inputs["Base Color"])
    return made


def picture(name, pixels, emission=0.0):
    """A material that shows `pixels` ((H, W, 3) float32, sRGB 0..1, row 0 at the bottom), packed into the file.

    With `emission` it glows with that strength and reflects nothing."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(name, width, height)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = pixels
    image.pixels.foreach_set(rgba.ravel())
    image.pack()
    made = material(name, (0.0, 0.0, 0.0) if emission else (0.8, 0.8, 0.8), emission=0.0)
    tree = made.node_tree
    shader, texture = _node(tree, "BSDF_PRINCIPLED"), tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.extension = image, "EXTEND"
    tree.links.new(texture.outputs["Color"], shader.inputs["Emission Color" if emission else "Base Color"])
    shader.inputs["Emission Strength"].default_value = emission
    return made


def add(name, data, location=(0, 0, 0), rotation=(0, 0, 0), scale=(1, 1, 1)):
    """Link an object for `data`; rotation in radians, XYZ."""
    made = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    made.location, made.rotation_euler, made.scale = location, rotation, scale
    return made


def mesh(name, vertices, faces, surface, smooth=True, uv=None, **place):
    """An object from (N, 3) vertices and faces of any size; `uv` is one (u, v) per face corner."""
    data = bpy.data.meshes.new(name)
    data.from_pydata([tuple(map(float, vertex)) for vertex in vertices], [], [tuple(map(int, face)) for face in faces])
    data.polygons.foreach_set("use_smooth", [smooth] * len(data.polygons))
    if uv is not None:
        data.uv_layers.new().uv.foreach_set("vector", np.asarray(uv, np.float32).ravel())
    data.materials.append(surface)
    if data.validate():
        raise ValueError(f"{name}: the mesh has broken faces")
    return add(name, data, **place)


def box(name, size, centre, surface, bevel=0.0, inside=False, **place):
    """An axis-aligned box; `inside` turns its faces inwards (a room); `bevel` rounds the edges by a modifier."""
    half = np.asarray(size, float) / 2
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    made = mesh(
        name, corners, [face[::-1] for face in faces] if inside else faces, surface, False, location=centre, **place
    )
    if bevel:
        made.modifiers.new("Bevel", "BEVEL").width = bevel
        made.modifiers["Bevel"].segments = 3
    return made


def panel(name, width, height, surface, **place):
    """A rectangle in its own XZ plane, facing -Y, with the whole picture on it."""
    x, z = width / 2, height / 2
    corners = [(-x, 0, -z), (x, 0, -z), (x, 0, z), (-x, 0, z)]
    return mesh(name, corners, [(0, 1, 2, 3)], surface, False, [(0, 0), (1, 0), (1, 1), (0, 1)], **place)


def lathe(name, profile, surface, segments=40, smooth=True, **place):
    """Turn a profile of (radius, height) points, bottom outside first, about Z. Radius 0 becomes a single vertex."""
    vertices, rings = [], []
    for radius, height in profile:
        count = 1 if radius == 0 else segments
        angles = np.arange(count) * 2 * math.pi / segments
        rings.append(range(len(vertices), len(vertices) + count))
        vertices += [(radius * math.cos(angle), radius * math.sin(angle), height) for angle in angles]
    faces = []
    for low, high in zip(rings, rings[1:]):
        for i in range(segments):
            face = [low[i % len(low)], low[(i + 1) % len(low)], high[(i + 1) % len(high)], high[i % len(high)]]
            face = list(dict.fromkeys(face))
            if len(face) > 2:
                faces.append(face)
    return mesh(name, vertices, faces, surface, smooth, **place)


def sphere(name, radius, surface, segments=96, **place):
    """A sphere, `segments` round and half as many high, poles on Z."""
    angles = np.linspace(-math.pi / 2, math.pi / 2, segments // 2 + 1)
    profile = [(radius * math.cos(a), radius * math.sin(a)) for a in angles]
    profile[0], profile[-1] = (0, -radius), (0, radius)
    return lathe(name, profile, surface, segments, **place)


def tube(name, path, radius, surface, segments=16, **place):
    """A round tube with closed ends along (N, 3) points, its frame carried from point to point without twist."""
    path = np.asarray(path, float)
    tangents = np.gradient(path, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    side = np.cross(tangents[0], np.eye(3)[np.argmin(np.abs(tangents[0]))])
    vertices = []
    for point, tangent in zip(path, tangents):
        side = side - tangent * (side @ tangent)
        side /= np.linalg.norm(side)
        other = np.cross(tangent, side)
        for angle in np.arange(segments) * 2 * math.pi / segments:
            vertices.append(point + radius * (math.cos(angle) * side + math.sin(angle) * other))
    faces = [
        (
            r * segments + i,
            r * segments + (i + 1) % segments,
            (r + 1) * segments + (i + 1) % segments,
            (r + 1) * segments + i,
        )
        for r in range(len(path) - 1)
        for i in range(segments)
    ]
    faces += [tuple(range(segments))[::-1], tuple(range((len(path) - 1) * segments, len(path) * segments))]
    made = mesh(name, vertices, faces, surface, **place)
    for cap in list(made.data.polygons)[-2:]:
        cap.use_smooth = False
    return made


def arc(centre, radius, start, end, count=12, plane="xz"):
    """Points on a circle between two angles in degrees, in the named coordinate plane."""
    angles = np.radians(np.linspace(start, end, count))
    points = np.tile(np.asarray(centre, float), (count, 1))
    points[:, "xyz".index(plane[0])] += radius * np.cos(angles)
    points[:, "xyz".index(plane[1])] += radius * np.sin(angles)
    return points


def aim(location, target):
    """The rotation of a camera or lamp that looks from `location` at `target`, upright."""
    return (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()


def lamp(name, location, target, power, size, colour=(1, 1, 1)):
    """A square area light of `size` metres and `power` watts."""
    data = bpy.data.lights.new(name, "AREA")
    data.energy, data.size, data.color = power, size, colour
    return add(name, data, location, aim(location, target))


def camera(location, target, lens=35.0, name="Camera"):
    """The scene's camera, 36 mm wide sensor."""
    data = bpy.data.cameras.new(name)
    data.lens = lens
    made = add(name, data, location, aim(location, target))
    bpy.context.scene.camera = made
    return made


def save(path):
    """Write the file, compressed, without previews."""
    bpy.context.preferences.filepaths.file_preview_type = "NONE"
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, copy=True)
