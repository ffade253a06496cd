"""Rooms that nobody tuned for, each with a mirror ball that moves: what light fields claim of `columns` and "rooms like it"."""

import bpy
import numpy as np

from sample_blends import scene_parts as parts

FRAMES = 24


def build(seed: int, things: int = 7) -> bpy.types.Scene:
    """A new file: chequered walls, floor and ceiling of random sizes and colours, lamps below the ceiling, blocks, balls and posts
    wherever they do not meet the way of the ball, which goes from one random place to another over FRAMES frames."""
    rng = np.random.default_rng(seed)
    scene = parts.start(f"room {seed}", (1, FRAMES))
    parts.set_world(scene, (0.05, 0.05, 0.06))
    size = rng.uniform([4, 4, 2.6], [8, 7, 4])

    def colour():
        return tuple(rng.uniform(0.1, 0.9, 3))

    for axis in range(3):
        for sign in (-1, 1):
            wall, at = size.copy(), np.array([0, 0, size[2] / 2])
            wall[axis], at[axis] = 0.1, at[axis] + sign * (size[axis] / 2 + 0.05)
            first = np.array(colour())
            surface = parts.checker(f"Wall {axis}{sign}", tuple(first), tuple(0.7 * first), rng.uniform(0.25, 0.7))
            parts.box(f"Wall {axis}{sign}", wall, at, surface)
    radius = rng.uniform(0.3, 0.6)
    ways = np.array([rng.uniform(-0.15, 0.15, 3) * size + [0, 0, 0.45 * size[2]] for _ in range(2)])
    ways[1] = ways[0] + (ways[1] - ways[0]) * min(1.0, 1.2 / np.linalg.norm(ways[1] - ways[0]))
    ball = parts.sphere("Ball", radius, parts.mirror(), 64, location=tuple(ways[0]))
    for frame, place in zip((1, FRAMES), ways, strict=True):
        ball.location = tuple(place)
        ball.keyframe_insert("location", frame=frame)
    for i in range(things):
        width, height = rng.uniform(0.12, 0.35), rng.uniform(0.4, 0.8) * size[2]
        while True:
            x, y = rng.uniform(-0.42, 0.42, 2) * size[:2]
            middle = ways.mean(0)[:2]
            if np.hypot(x - middle[0], y - middle[1]) > radius + width + 0.8 and y > -0.3 * size[1]:
                break
        surface = parts.material(f"Thing {i}", colour())
        if i % 3 == 0:
            parts.sphere(f"Thing {i}", width, surface, 32, location=(x, y, rng.uniform(width, size[2] - width)))
        else:
            parts.box(f"Thing {i}", (2 * width, width, height), (x, y, height / 2), surface, rotation=(0, 0, rng.uniform(0, 3)))
    for i in range(2):
        x, y = rng.uniform(-0.35, 0.35, 2) * size[:2]
        parts.lamp(f"Lamp {i}", (x, y, size[2] - 0.1), (x, y, 0), 60, rng.uniform(0.4, 1.0))
    middle = ways.mean(0)
    parts.camera((middle[0] + 0.3, -0.47 * size[1], middle[2] + 0.3), tuple(middle), lens=55)
    scene.frame_set(1)
    return scene
