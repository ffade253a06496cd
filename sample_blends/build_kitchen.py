"""kitchen: a small furnished interior with a kettle, a tap, glazed plates and a glass table.

Claim: reflectors of many kinds side by side (chrome, brushed steel, coloured metal, glazed ceramic at IOR 1.5, glass),
convex, concave, thin and flat, close to each other and to what they reflect: no single stand-in is right for all.
"""

import math

import bpy
import numpy as np

from sample_blends import scene_parts as parts


def glaze(name, colour):
    """Glazed ceramic: matt colour under a smooth dielectric surface."""
    return parts.material(name, colour, roughness=0.03, specular=0.5, IOR=1.5)


def tiles(name, first, second, size, gloss):
    made = parts.checker(name, first, second, size)
    shader = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Specular IOR Level"].default_value = 0.5
    shader.inputs["Roughness"].default_value = gloss
    return made


def room(metals):
    """A room of 3.2 x 3.4 x 2.6 m: a bright pane with bars for a window on the left, a lamp above the camera."""
    wall = parts.material("Plaster", (0.78, 0.74, 0.66))
    parts.box(
        "Floor", (3.2, 3.4, 0.1), (0, 0, -0.05), parts.checker("Floor", (0.55, 0.36, 0.2), (0.42, 0.26, 0.14), 0.4)
    )
    parts.box("Ceiling", (3.2, 3.4, 0.1), (0, 0, 2.65), parts.material("Ceiling", (0.85, 0.84, 0.82)))
    for name, size, centre in (
        ("Wall back", (3.2, 0.1, 2.6), (0, 1.75, 1.3)),
        ("Wall front", (3.2, 0.1, 2.6), (0, -1.75, 1.3)),
        ("Wall left", (0.1, 3.4, 2.6), (-1.65, 0, 1.3)),
        ("Wall right", (0.1, 3.4, 2.6), (1.65, 0, 1.3)),
    ):
        parts.box(name, size, centre, wall)
    parts.box(
        "Splashback", (3.2, 0.02, 0.6), (0, 1.69, 1.2), tiles("Tiles", (0.75, 0.82, 0.8), (0.2, 0.42, 0.46), 0.1, 0.25)
    )
    sky = parts.material("Sky", (0.75, 0.88, 1.0), emission=3.5)
    parts.box("Window pane", (0.02, 1.3, 1.1), (-1.59, 0.35, 1.55), sky)
    frame = parts.material("Window frame", (0.85, 0.83, 0.78))
    for i, (size, centre) in enumerate(
        (
            ((0.06, 1.42, 0.06), (-1.57, 0.35, 0.97)),
            ((0.06, 1.42, 0.06), (-1.57, 0.35, 2.13)),
            ((0.06, 0.06, 1.22), (-1.57, -0.33, 1.55)),
            ((0.06, 0.06, 1.22), (-1.57, 1.03, 1.55)),
            ((0.05, 0.04, 1.1), (-1.57, 0.35, 1.55)),
            ((0.05, 1.3, 0.04), (-1.57, 0.35, 1.6)),
        )
    ):
        parts.box(f"Window bar {i + 1}", size, centre, frame, bevel=0.005)
    parts.lamp("Daylight", (-1.5, 0.35, 1.6), (0.6, 0.4, 0.8), 38, 1.1, (0.85, 0.93, 1.0))
    parts.lamp("Ceiling lamp", (0.5, -0.5, 2.55), (0.5, 0.1, 0), 30, 0.6, (1.0, 0.86, 0.68))
    parts.box(
        "Fridge",
        (0.6, 0.6, 1.8),
        (1.28, -0.6, 0.9),
        parts.material("Brushed steel", (0.72, 0.73, 0.74), 0.22, 1.0, 0.5),
        bevel=0.03,
    )
    parts.tube("Fridge handle", [(0.93, -0.82, 0.7), (0.93, -0.82, 1.0), (0.93, -0.82, 1.3)], 0.012, metals["chrome"])


def counter(metals):
    """Cupboards with a worktop, a sink sunk into it, and a tap over the sink."""
    front = parts.material("Cupboard", (0.2, 0.32, 0.36), 0.55, specular=0.3)
    for i, x in enumerate((-1.2, -0.4, 0.4, 1.2)):
        parts.box(f"Cupboard {i + 1}", (0.78, 0.56, 0.84), (x, 1.38, 0.44), front, bevel=0.012)
        knob = [(0, 0), (0.008, 0), (0.008, 0.02), (0.02, 0.026), (0.018, 0.036), (0, 0.04)]
        parts.lathe(
            f"Knob {i + 1}", knob, metals["brass"], 24, location=(x + 0.3, 1.1, 0.72), rotation=(math.radians(90), 0, 0)
        )
    top = parts.material("Worktop", (0.36, 0.2, 0.1), 0.5, specular=0.3)
    for i, (size, x, y) in enumerate(
        (
            ((0.75, 0.64, 0.04), -1.225, 1.38),
            ((1.85, 0.64, 0.04), 0.675, 1.38),
            ((0.6, 0.12, 0.04), -0.55, 1.64),
            ((0.6, 0.1, 0.04), -0.55, 1.11),
        )
    ):
        parts.box(f"Worktop {i + 1}", size, (x, y, 0.88), top)
    steel = parts.material("Sink steel", (0.75, 0.76, 0.77), 0.12, 1.0, 0.5)
    x, y, low, high = 0.3, 0.21, -0.12, 0.1
    corners = [
        (-x, -y, low),
        (x, -y, low),
        (x, y, low),
        (-x, y, low),
        (-x, -y, high),
        (x, -y, high),
        (x, y, high),
        (-x, y, high),
    ]
    sides = [(0, 1, 2, 3), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]
    parts.mesh("Sink", corners, sides, steel, smooth=False, location=(-0.55, 1.37, 0.8))
    neck = np.vstack(
        [
            [(-0.55, 1.62, 0.9), (-0.55, 1.62, 1.05), (-0.55, 1.62, 1.17)],
            parts.arc((-0.55, 1.52, 1.2), 0.1, 0, 180, 14, "yz"),
            [(-0.55, 1.42, 1.14)],
        ]
    )
    parts.tube("Tap", neck, 0.02, metals["chrome"], 24)
    parts.lathe(
        "Tap base",
        [(0, 0), (0.035, 0), (0.035, 0.02), (0.02, 0.035), (0, 0.035)],
        metals["chrome"],
        location=(-0.55, 1.62, 0.9),
    )
    parts.tube("Tap lever", [(-0.53, 1.62, 0.97), (-0.49, 1.62, 0.99), (-0.44, 1.62, 1.03)], 0.008, metals["chrome"])


def kettle(metals):
    """A chrome kettle: turned body and lid, swept spout and handle."""
    at, grown = (0.12, 1.33, 0.9), (1.35, 1.35, 1.35)
    body = [
        (0, 0),
        (0.115, 0),
        (0.13, 0.012),
        (0.135, 0.05),
        (0.122, 0.11),
        (0.095, 0.15),
        (0.06, 0.168),
        (0.058, 0.174),
        (0.03, 0.186),
        (0, 0.188),
    ]
    parts.lathe("Kettle", rounded(body, 2), metals["chrome"], 64, location=at, scale=grown)
    parts.sphere(
        "Kettle knob",
        0.018,
        parts.material("Bakelite", (0.02, 0.02, 0.02), 0.15, specular=0.5),
        32,
        location=(at[0], at[1], at[2] + 0.27),
        scale=grown,
    )
    parts.tube(
        "Kettle spout",
        [(-0.09, 0, 0.075), (-0.13, 0, 0.09), (-0.155, 0, 0.12), (-0.175, 0, 0.155)],
        0.02,
        metals["chrome"],
        24,
        location=at,
        scale=grown,
    )
    parts.tube(
        "Kettle handle",
        parts.arc((0, 0, 0.13), 0.115, 15, 165, 20),
        0.011,
        bpy.data.materials["Bakelite"],
        location=at,
        scale=grown,
    )


def rounded(profile, times):
    """Corner cutting (Chaikin) on a profile; its ends stay."""
    points = np.asarray(profile, float)
    for _ in range(times):
        inner = np.stack(
            [0.75 * points[:-1] + 0.25 * points[1:], 0.25 * points[:-1] + 0.75 * points[1:]], axis=1
        ).reshape(-1, 2)
        points = np.vstack([points[:1], inner[1:-1], points[-1:]])
    return [(float(radius), float(height)) for radius, height in points]


def crockery():
    """Plates, a bowl with fruit and a cup on the worktop and the shelf."""
    plate = rounded(
        [(0, 0), (0.07, 0), (0.075, 0.006), (0.13, 0.022), (0.13, 0.026), (0.075, 0.012), (0.07, 0.008), (0, 0.008)], 2
    )
    white, blue = glaze("White glaze", (0.85, 0.84, 0.8)), glaze("Blue glaze", (0.03, 0.1, 0.35))
    for i in range(4):
        parts.lathe(f"Plate {i + 1}", plate, (white, blue)[i % 2], location=(0.62, 1.36, 0.9 + 0.014 * i))
    shelf = parts.material("Shelf", (0.5, 0.33, 0.18), 0.6)
    parts.box("Shelf", (1.7, 0.22, 0.03), (0.55, 1.58, 1.72), shelf, bevel=0.004)
    for i, x in enumerate((-0.05, 0.27, 0.59)):
        parts.lathe(
            f"Plate on shelf {i + 1}",
            plate,
            (blue, white, blue)[i],
            location=(x, 1.62, 1.865),
            rotation=(math.radians(78), 0, 0),
        )
    jar = rounded([(0, 0), (0.06, 0), (0.07, 0.03), (0.07, 0.14), (0.045, 0.17), (0.05, 0.2), (0, 0.2)], 2)
    for i, (x, colour) in enumerate(((0.9, (0.6, 0.08, 0.05)), (1.08, (0.8, 0.5, 0.08)), (1.26, (0.1, 0.35, 0.15)))):
        parts.lathe(f"Jar {i + 1}", jar, glaze(f"Jar glaze {i + 1}", colour), location=(x, 1.6, 1.735))
    for i, (x, y, size, colour) in enumerate(
        (
            (1.0, 1.3, 0.042, (0.85, 0.3, 0.03)),
            (1.09, 1.34, 0.04, (0.35, 0.5, 0.05)),
            (1.03, 1.39, 0.038, (0.65, 0.05, 0.04)),
        )
    ):
        parts.sphere(
            f"Fruit {i + 1}",
            size,
            parts.material(f"Fruit {i + 1}", colour, 0.45, specular=0.4),
            32,
            location=(x, y, 0.94 + size),
        )
    bowl = rounded(
        [(0, 0), (0.05, 0), (0.12, 0.05), (0.14, 0.09), (0.132, 0.09), (0.11, 0.055), (0.05, 0.012), (0, 0.012)], 2
    )
    parts.lathe("Fruit bowl", bowl, glaze("Teal glaze", (0.02, 0.3, 0.3)), location=(1.04, 1.34, 0.9))


def table(metals):
    """A glass table in front: a bevelled pane on chrome legs, with a steel bowl and a cup on it."""
    glass = parts.material("Glass", (0.92, 0.98, 0.96), 0.0, specular=0.5, IOR=1.5, Transmission_Weight=1.0)
    parts.box("Table top", (1.3, 0.75, 0.02), (-0.05, 0.2, 0.74), glass, bevel=0.006)
    for i, (x, y) in enumerate(((-0.63, -0.1), (0.53, -0.1), (-0.63, 0.5), (0.53, 0.5))):
        parts.tube(f"Table leg {i + 1}", [(x, y, 0.0), (x, y, 0.36), (x, y, 0.728)], 0.02, metals["chrome"])
    bowl = rounded(
        [(0, 0), (0.06, 0), (0.15, 0.06), (0.17, 0.12), (0.164, 0.12), (0.14, 0.06), (0.06, 0.006), (0, 0.006)], 2
    )
    parts.lathe("Steel bowl", bowl, metals["chrome"], 64, location=(0.2, 0.25, 0.752))
    for i, (x, y) in enumerate(((0.15, 0.24), (0.24, 0.29))):
        parts.sphere(
            f"Lemon {i + 1}",
            0.04,
            parts.material(f"Lemon {i + 1}", (0.9, 0.7, 0.05), 0.5, specular=0.3),
            32,
            location=(x, y, 0.81),
            scale=(1.2, 1, 1),
        )
    cup = rounded(
        [(0, 0), (0.028, 0), (0.042, 0.02), (0.045, 0.08), (0.041, 0.08), (0.037, 0.02), (0.025, 0.008), (0, 0.008)], 2
    )
    parts.lathe("Cup", cup, glaze("Red glaze", (0.6, 0.04, 0.03)), location=(-0.3, 0.15, 0.752))
    parts.tube(
        "Cup handle", parts.arc((-0.255, 0.15, 0.79), 0.022, -80, 80, 12), 0.005, bpy.data.materials["Red glaze"]
    )


def build():
    parts.start("kitchen")
    metals = {
        "chrome": parts.mirror("Chrome", (0.9, 0.91, 0.92)),
        "brass": parts.material("Brass", (0.9, 0.68, 0.3), 0.1, 1.0, 0.5),
    }
    room(metals)
    counter(metals)
    kettle(metals)
    crockery()
    table(metals)
    parts.camera((0.62, -0.95, 1.45), (-0.12, 0.9, 0.95), lens=24)


if __name__ == "__main__":
    build()
    parts.save(parts.HERE / "kitchen.blend")
