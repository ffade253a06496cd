"""Small scenes for tests, built into the file that is open: each makes its objects, a world and a camera, and returns
{"reflectors": [...], "camera": object, ...}. Metres; nothing random."""

import math

import bpy
import numpy as np

from sample_blends import scene_parts as parts


def convex_mirror_under_world(hdr_path, radius=1.0):
    """A mirror sphere at the origin, nothing else, under an equirectangular world read from `hdr_path`."""
    scene = parts.prepare(bpy.context.scene, "convex mirror")
    parts.set_world_image(scene, bpy.data.images.load(str(hdr_path)))
    ball = parts.sphere("Mirror", radius, parts.mirror(colour=(1, 1, 1)), 192)
    view = parts.camera((0, -4 * radius, 0.8 * radius), (0, 0, 0), lens=50)
    return {"reflectors": [ball], "camera": view}


def sphere_in_box_room(size=(4.0, 5.0, 3.0), centre=(0.0, 0.0, 1.5), at=(0.7, 0.9, 1.1), radius=0.5):
    """A mirror sphere off-centre in a closed room of six chequered, glowing sides (so that there is no noise).

    The room is one inward box of `size` about `centre`; each side has its own two colours."""
    scene = parts.prepare(bpy.context.scene, "box room")
    parts.set_world(scene, (0, 0, 0))
    half, middle = np.asarray(size) / 2, np.asarray(centre, float)
    colours = [
        (0.9, 0.2, 0.15),
        (0.15, 0.6, 0.9),
        (0.2, 0.8, 0.3),
        (0.9, 0.75, 0.2),
        (0.7, 0.3, 0.8),
        (0.85, 0.85, 0.85),
    ]
    walls = []
    for i, colour in enumerate(colours):
        axis, sign = i // 2, 1 - 2 * (i % 2)
        u, v = [a for a in range(3) if a != axis]
        corners = np.tile(middle, (4, 1))
        corners[:, axis] += sign * half[axis]
        corners[:, u] += half[u] * np.array([-1, 1, 1, -1])
        corners[:, v] += half[v] * np.array([-1, -1, 1, 1])
        # Counter-clockwise from u to v faces along +axis for x and z, along -axis for y.
        outward = (sign > 0) == (axis != 1)
        face = (3, 2, 1, 0) if outward else (0, 1, 2, 3)
        walls.append(
            parts.mesh(
                f"Wall {'xyz'[axis]}{'+' if sign > 0 else '-'}",
                corners,
                [face],
                glowing_checker(f"Wall {i}", colour, tuple(0.35 * c for c in colour), 0.5),
                smooth=False,
            )
        )
    ball = parts.sphere("Mirror", radius, parts.mirror(colour=(1, 1, 1)), 192, location=at)
    view = parts.camera(tuple(middle + half * (-0.75, -0.85, 0.4)), at, lens=40)
    return {"reflectors": [ball], "camera": view, "walls": walls, "box_min": middle - half, "box_max": middle + half}


def pictures_around_mirror(count=5, distance=2.0, radius=0.6):
    """`count` flat glowing pictures in a ring about a mirror sphere, facing it, under a dim world, no walls."""
    scene = parts.prepare(bpy.context.scene, "pictures")
    parts.set_world(scene, (0.05, 0.06, 0.08))
    ball = parts.sphere("Mirror", radius, parts.mirror(colour=(1, 1, 1)), 192)
    pictures = []
    for i in range(count):
        angle = 2 * math.pi * i / count - math.pi / 2  # the first stands in front; the camera looks over it
        place = (distance * math.cos(angle), distance * math.sin(angle), 0.15 * (i % 3 - 1))
        y, x = np.mgrid[:48, :64]
        stripes = ((x // 8 + (i + 1) * (y // 12)) % (i + 2))[..., None] / (i + 1)
        pixels = (0.15 + 0.8 * stripes * np.roll([1.0, 0.6, 0.25], i)).astype(np.float32)
        pictures.append(
            parts.panel(
                f"Picture {i + 1}",
                1.0,
                0.75,
                parts.picture(f"Picture {i + 1}", pixels, emission=1.0),
                location=place,
                rotation=(0, 0, angle - math.pi / 2),
            )
        )
    view = parts.camera((0, -4.6, 2.3), (0, 0, 0), lens=50)
    return {"reflectors": [ball], "camera": view, "pictures": pictures}


def glowing_checker(name, first, second, size):
    """A checker that only emits, strength 1."""
    made = parts.checker(name, first, second, size)
    tree = made.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    link = shader.inputs["Base Color"].links[0]
    tree.links.new(link.from_socket, shader.inputs["Emission Color"])
    tree.links.remove(link)
    shader.inputs["Base Color"].default_value = (0, 0, 0, 1)
    shader.inputs["Emission Strength"].default_value = 1.0
    return made
