"""Small scenes and independent truths that the tests of this folder share."""

import bpy
import numpy as np

from sample_blends import scene_parts as parts


def add_mesh(name, positions, faces, matrix=None, material=None):
    """An object of the given vertices and faces, linked to the scene."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(positions, float).tolist(), [], [list(f) for f in faces])
    mesh.update()
    if material is not None:
        mesh.materials.append(material)
    obj = bpy.data.objects.new(name, mesh)
    if matrix is not None:
        from mathutils import Matrix

        obj.matrix_world = Matrix(np.asarray(matrix).tolist())
    bpy.context.scene.collection.objects.link(obj)
    return obj


def glowing_room(name):
    """(the open scene, its walls' material): a closed room, turned, of glowing walls, under a dim world."""
    scene = parts.prepare(bpy.context.scene, name)
    parts.set_world(scene, (0.2, 0.2, 0.2))
    walls = parts.material("Walls", (0.7, 0.5, 0.3), emission=1.0)
    parts.box("Room", (6.0, 5.0, 3.0), (0, 0, 1.5), walls).rotation_euler.z = 0.3
    return scene, walls


def two_mirrors(path):
    """A closed room, saved, with a ball that mirrors, and a small one far from it behind a pillar; a camera sees both. Returns the path."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    _, walls = glowing_room("hall")
    parts.box("Pillar", (0.5, 0.5, 1.5), (1.5, 0.6, 0.75), walls)
    # Round, and nearer to one of them: before the panel is captured, other rays are traced for each.
    parts.sphere("Bead", 0.15, walls, 12, location=(0.9, -0.4, 0.7))
    parts.panel("Panel", 0.5, 0.5, walls, location=(-0.5, 0.2, 0.5))
    parts.sphere("Near", 0.4, parts.mirror(), 16, location=(0.3, -0.2, 1.0))
    parts.sphere("Far", 0.15, bpy.data.materials["Mirror"], 16, location=(-1.2, 1.2, 0.8))
    parts.camera((0, -1.9, 1.3), (0.1, 1.0, 1.1), lens=24)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def saved_ball(path):
    """A small ball in the open file, marked by hand and selected, and the file saved. The add-on must be on."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6)
    bpy.context.object.name = "Ball"
    bpy.context.object.reflect_mark = "YES"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return bpy.context.object


def add_soup(name, rng, triangles, centre, size, matrix=None):
    """Random triangles around a centre: nothing for a ray tracer to be clever about."""
    corners = centre + rng.normal(0, size, (triangles, 1, 3)) + rng.normal(0, size / 3, (triangles, 3, 3))
    return add_mesh(name, corners.reshape(-1, 3), np.arange(triangles * 3).reshape(-1, 3), matrix)


def random_matrix(rng, mirrored=False):
    """Rotation, uneven scale (mirrored on request) and shift, as one would build it by hand: (4, 4) float64."""
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    scale = rng.uniform(0.5, 1.5, 3) * ([-1, 1, 1] if mirrored else 1)
    out = np.eye(4)
    out[:3, :3] = q * np.sign(np.linalg.det(q)) * scale
    out[:3, 3] = rng.normal(0, 1, 3)
    return out


def emission(name, color, strength=1.0):
    """A material that only glows: its radiance has no noise."""
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    glow = tree.nodes.new("ShaderNodeEmission")
    glow.inputs["Color"].default_value = (*color, 1)
    glow.inputs["Strength"].default_value = strength
    out = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(glow.outputs[0], out.inputs["Surface"])
    return material


def set_world(color, strength=1.0):
    world = bpy.data.worlds.new("World")
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*color, 1)
    background.inputs["Strength"].default_value = strength
    bpy.context.scene.world = world
    return world


def world_triangles():
    """(T, 3, 3) float64 of the meshes of the scene, and (T,) object names: read polygon by polygon."""
    bpy.context.view_layer.update()
    triangles, names = [], []
    for obj in bpy.context.scene.objects:
        if obj.type != "MESH":
            continue
        matrix = np.array(obj.matrix_world)
        points = np.array([v.co for v in obj.data.vertices]) @ matrix[:3, :3].T + matrix[:3, 3]
        for polygon in obj.data.polygons:
            assert len(polygon.vertices) == 3
            triangles.append(points[list(polygon.vertices)])
            names.append(obj.name)
    return np.array(triangles), np.array(names)


def random_rays(rng, count, triangles):
    """Rays from in and around the scene; half aim at it, half go anywhere. (origin, direction) float32."""
    low, high = triangles.min((0, 1)), triangles.max((0, 1))
    origin = rng.uniform(low - 0.2 * (high - low), high + 0.2 * (high - low), (count, 3))
    target = np.where(
        rng.random((count, 1)) < 0.5,
        triangles[rng.integers(len(triangles), size=count)].mean(1),
        origin + rng.normal(size=(count, 3)),
    )
    direction = (target - origin) / np.linalg.norm(target - origin, axis=1, keepdims=True)
    return origin.astype(np.float32), direction.astype(np.float32)
