"""Fig 5: nine mirrors on a ground that goes on."""

import math

from sample_blends import build_teapots, scene_parts as parts

from .studio import Figure, Studio
from .teapots import mirrors_compared

# Nine bakes: half of the texels that one mirror gets.
BAKE = {"resolution": 128, "samples": 8, "texels": 64}
DEPTH = {**BAKE, "maps": 1, "turns": 30}
HALF = 100.0  # m, of the ground
STEP = 0.5  # m between spheres' centres
RADIUS = 0.17


def build():
    """Spheres of triangles, three by three, under the teapots' world."""
    scene = parts.start("nine")
    parts.set_world_image(scene, build_teapots.small_world(build_teapots.WORLD), turn=math.radians(200))
    ground = parts.checker("Chequered ground", (0.75, 0.72, 0.66), (0.12, 0.2, 0.3), 0.25)
    corners = [(-HALF, -HALF, 0), (HALF, -HALF, 0), (HALF, HALF, 0), (-HALF, HALF, 0)]
    parts.mesh("Ground", corners, [(0, 1, 2, 3)], ground, smooth=False)
    colours = {"Silver": (0.93, 0.93, 0.92), "Gold": (1.0, 0.78, 0.42), "Copper": (0.96, 0.64, 0.54)}
    metals = [parts.mirror(name, colour) for name, colour in colours.items()]
    for i in range(9):
        x, y = (i % 3 - 1) * STEP, (i // 3 - 1) * STEP
        parts.sphere(f"Sphere {i + 1}", RADIUS, metals[(i + i // 3) % 3], 64, location=(x, y, RADIUS))
    parts.camera((0.35, -1.75, 1.1), (0.0, -0.08, 0.1), lens=42)
    return scene


def fig5(studio: Studio) -> Figure:
    rows, table, pairs = mirrors_compared(studio, studio.shot(build), BAKE, DEPTH)
    words = f"{pairs} second-order reflections."
    return Figure(
        "Fig 5: nine reflectors",
        f"{words} The paper: 72. The ground has no end near by: it is a box over the environment map (Fig 7), eight mirrors "
        "stand before it. What a sphere shows in a sphere in a sphere (order three) is left out by design.",
        [("fig05.png", studio.sheet(rows, words))],
        table,
    )
