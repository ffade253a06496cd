"""What a scene is made of, as plain values: two builds of a sample share them, while their bytes differ."""

import hashlib

import bpy
import numpy as np


def rounded(values):
    """Floats to 5 digits as a list, so that platforms may differ in the last bits."""
    return (np.round(np.asarray(values, float).ravel(), 5) + 0.0).tolist()


def describe(scene):
    """A dictionary of the scene's settings, objects, meshes, materials, images, lights and animation."""
    return {
        "scene": [
            scene.name,
            scene.frame_start,
            scene.frame_end,
            scene.render.engine,
            scene.camera.name,
            scene.world.name,
        ],
        "objects": {made.name: _object(made) for made in scene.objects},
        "materials": {made.name: _tree(made.node_tree) for made in bpy.data.materials if made.users},
        "world": _tree(scene.world.node_tree),
        "images": {image.name: _image(image) for image in bpy.data.images if image.users and image.packed_file},
    }


def _object(made):
    entry = {
        "type": made.type,
        "matrix": rounded(made.matrix_world),
        "modifiers": [(modifier.type, modifier.name) for modifier in made.modifiers],
        "keys": _keys(made),
    }
    if made.type == "MESH":
        points = np.empty(len(made.data.vertices) * 3, np.float32)
        made.data.vertices.foreach_get("co", points)
        entry |= {
            "mesh": made.data.name,
            "counts": [len(made.data.vertices), len(made.data.polygons), len(made.data.loops)],
            "centroid": rounded(points.reshape(-1, 3).mean(axis=0)),
            "spread": rounded(points.reshape(-1, 3).std(axis=0)),
            "materials": [slot.material.name for slot in made.material_slots],
            "smooth": sum(face.use_smooth for face in made.data.polygons),
        }
    elif made.type == "LIGHT":
        entry |= {"light": [made.data.type, *rounded([made.data.energy, made.data.size, *made.data.color])]}
    elif made.type == "CAMERA":
        entry |= {"lens": rounded([made.data.lens, made.data.sensor_width])}
    return entry


def _keys(made):
    """Keyframes as [(path, axis, frame, value)]: Blender 5 keeps them per slot in layers of strips."""
    data = made.animation_data
    if data is None or data.action is None:
        return []
    bags = [bag for layer in data.action.layers for strip in layer.strips for bag in strip.channelbags]
    return [
        (curve.data_path, curve.array_index, *rounded(point.co))
        for bag in bags
        for curve in bag.fcurves
        for point in curve.keyframe_points
    ]


def _tree(tree):
    """Node types, their unlinked values and the links between them."""
    nodes = {}
    for node in tree.nodes:
        values = {}
        for socket in node.inputs:
            if not socket.is_linked and hasattr(socket, "default_value") and socket.type in ("VALUE", "RGBA", "VECTOR"):
                values[socket.identifier] = rounded(socket.default_value)
        nodes[node.name] = (node.bl_idname, values)
    links = sorted(
        (link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier)
        for link in tree.links
    )
    return {"nodes": nodes, "links": links}


def _image(image):
    """Size, and a checksum of the packed file: it is written by one library from fixed pixels."""
    return [*image.size, hashlib.sha256(image.packed_file.data).hexdigest()]
