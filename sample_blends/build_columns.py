"""columns: a mirror sphere moves among coloured columns in a box room with pictures on its walls (yu-2005, Fig. 10).

Claim: walls are what a box stand-in answers exactly, so `box_proxy` is right about pictures and pattern and wrong about
the columns, and stays so while the sphere moves (frames 1 to 60); `environment` swims against the walls.
"""

import math

import bpy
import numpy as np

from sample_blends import scene_parts as parts

ROOM = (6.0, 5.0, 3.0)


def blocks(rng, height=64, width=96):
    """Coloured rectangles between dark lines."""
    pixels = np.full((height, width, 3), 0.93, np.float32)
    palette = np.array([(0.85, 0.12, 0.1), (0.1, 0.25, 0.65), (0.95, 0.8, 0.15), (0.95, 0.93, 0.9)])
    xs, ys = (
        [0, *sorted(rng.choice(np.arange(8, width - 8), 4, False)), width],
        [0, *sorted(rng.choice(np.arange(8, height - 8), 3, False)), height],
    )
    for left, right in zip(xs, xs[1:]):
        for low, high in zip(ys, ys[1:]):
            pixels[low:high, left:right] = palette[rng.integers(4)]
            pixels[low : low + 2, left:right] = 0.05
            pixels[low:high, left : left + 2] = 0.05
    return pixels


def rings(height=64, width=64):
    """A target of rings that turn from orange to blue."""
    y, x = np.mgrid[:height, :width]
    radius = np.hypot(x - width / 2 + 0.5, y - height / 2 + 0.5) / (height / 2)
    mix = np.clip(radius, 0, 1)[..., None]
    colour = (1 - mix) * np.array([0.98, 0.5, 0.1]) + mix * np.array([0.1, 0.3, 0.7])
    return np.where((np.floor(radius * 7) % 2 == 0)[..., None], colour, 0.95).astype(np.float32)


def sunset(height=64, width=112):
    """A sun over hills."""
    y, x = np.mgrid[:height, :width] / np.array([height, width])[:, None, None]
    pixels = y[..., None] * np.array([0.15, 0.2, 0.5]) + (1 - y[..., None]) * np.array([1.0, 0.55, 0.25])
    pixels[np.hypot((x - 0.62) * width / height, y - 0.5) < 0.14] = (1.0, 0.93, 0.6)
    for base, frequency, colour in (
        (0.38, 7, (0.3, 0.25, 0.4)),
        (0.24, 11, (0.16, 0.2, 0.22)),
        (0.12, 5, (0.06, 0.12, 0.1)),
    ):
        pixels[y < base + 0.07 * np.sin(x * frequency + 9 * base)] = colour
    return pixels.astype(np.float32)


def room():
    """Six patterned sides of one box, facing inwards, and pictures a finger in front of the walls."""
    x, y, z = ROOM
    sides = {
        "Floor": ((0, 0, -0.05), (x, y, 0.1), parts.checker("Floor", (0.62, 0.5, 0.36), (0.3, 0.2, 0.13), 0.5)),
        "Ceiling": ((0, 0, z + 0.05), (x, y, 0.1), parts.material("Ceiling", (0.85, 0.84, 0.8))),
        "Wall back": (
            (0, y / 2 + 0.05, z / 2),
            (x, 0.1, z),
            parts.checker("Wall back", (0.72, 0.7, 0.62), (0.62, 0.6, 0.5), 0.3),
        ),
        "Wall front": (
            (0, -y / 2 - 0.05, z / 2),
            (x, 0.1, z),
            parts.checker("Wall front", (0.55, 0.65, 0.6), (0.45, 0.56, 0.52), 0.3),
        ),
        "Wall left": (
            (-x / 2 - 0.05, 0, z / 2),
            (0.1, y, z),
            parts.checker("Wall left", (0.7, 0.48, 0.42), (0.6, 0.38, 0.34), 0.3),
        ),
        "Wall right": (
            (x / 2 + 0.05, 0, z / 2),
            (0.1, y, z),
            parts.checker("Wall right", (0.45, 0.52, 0.68), (0.36, 0.43, 0.6), 0.3),
        ),
    }
    for name, (centre, size, surface) in sides.items():
        parts.box(name, size, centre, surface)
    rng = np.random.default_rng(1963)
    hung = [
        ("Blocks", 1.5, 1.0, blocks(rng), (-1.5, y / 2 - 0.02, 1.7), 0),
        ("Sunset", 1.75, 1.0, sunset(), (1.35, y / 2 - 0.02, 1.7), 0),
        ("Rings", 1.1, 1.1, rings(), (-x / 2 + 0.02, 0.3, 1.6), 90),
        ("Blocks right", 1.5, 1.0, blocks(rng), (x / 2 - 0.02, 0.4, 1.6), -90),
        ("Sunset front", 1.75, 1.0, sunset(), (-1.2, -y / 2 + 0.02, 1.7), 180),
        ("Rings front", 1.1, 1.1, rings(), (1.4, -y / 2 + 0.02, 1.7), 180),
    ]
    for name, width, height, pixels, centre, degrees in hung:
        parts.panel(
            name, width, height, parts.picture(name, pixels), location=centre, rotation=(0, 0, math.radians(degrees))
        )


def build():
    parts.start("columns", frames=(1, 60))
    room()
    colours = [(0.75, 0.1, 0.08), (0.9, 0.6, 0.08), (0.12, 0.5, 0.18), (0.1, 0.25, 0.7), (0.5, 0.15, 0.55)]
    spots = [(-1.7, 0.9), (-0.55, 1.45), (0.75, 1.3), (1.8, 0.45), (-1.9, -0.9)]
    for i, ((x, y), colour) in enumerate(zip(spots, colours)):
        shaft = [
            (0.0, 0.0),
            (0.24, 0.0),
            (0.24, 0.12),
            (0.16, 0.16),
            (0.13, 1.5),
            (0.22, 1.56),
            (0.22, 1.66),
            (0.0, 1.66),
        ]
        column = parts.lathe(
            f"Column {i + 1}", shaft, parts.material(f"Column {i + 1}", colour), 32, smooth=False, location=(x, y, 0)
        )
        column.data.polygons.foreach_set("use_smooth", [True] * len(column.data.polygons))
        edges = column.modifiers.new("Edges", "EDGE_SPLIT")
        edges.split_angle = math.radians(40)
    ball = parts.sphere("Mirror sphere", 0.55, parts.mirror(), location=(0, 0, 0.6))
    for frame, place in (
        (1, (-0.7, -0.2, 0.62)),
        (20, (-0.05, 0.35, 0.75)),
        (40, (0.75, 0.05, 0.62)),
        (60, (0.35, -0.6, 0.9)),
    ):
        ball.location = place
        ball.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(1)
    for name, x in (("Lamp left", -1.5), ("Lamp right", 1.5)):
        parts.lamp(name, (x, -0.4, 2.9), (x, -0.4, 0), 75, 0.8, (1.0, 0.94, 0.85))
    parts.camera((0.4, -2.38, 1.6), (-0.05, 0.3, 0.85), lens=19)


if __name__ == "__main__":
    build()
    parts.save(parts.HERE / "columns.blend")
