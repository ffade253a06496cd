"""Figs 2 and 15: reflections that fade with distance, and Fresnel's share of them."""

import math

import numpy as np

from sample_blends import build_teapots, scene_parts as parts

from .sheet import Panel, short
from .studio import HEADINGS, Figure, Studio, numbers, up

BAKE = {"resolution": 128, "samples": 8, "texels": 512}  # the floor is 3 m wide, and the teapot stands on it
HALF = 0.5  # m: what is so far away is reflected half as brightly; the teapot is 0.3 m high


def build():
    """A black glazed teapot between matt things near and far."""
    scene = parts.start("glaze")
    parts.set_world_image(scene, build_teapots.small_world(build_teapots.WORLD), turn=math.radians(200))
    parts.box(
        "Ground", (3.0, 3.0, 0.04), (0, 0, -0.02), parts.checker("Ground", (0.75, 0.72, 0.66), (0.12, 0.2, 0.3), 0.25)
    )
    vertices, faces = build_teapots.tessellate(8)
    glaze = parts.material("Glaze", (0.01, 0.01, 0.015), roughness=0.0, specular=0.5, IOR=2.2)
    parts.mesh("Teapot", vertices * build_teapots.SCALE, faces, glaze, rotation=(0, 0, math.radians(200)))
    balls = (-0.3, -0.34, (0.8, 0.15, 0.08)), (0.38, -0.2, (0.9, 0.65, 0.1)), (0.75, -0.75, (0.15, 0.5, 0.2))
    for i, (x, y, colour) in enumerate(balls):
        parts.sphere(f"Ball {i + 1}", 0.08, parts.material(f"Ball {i + 1}", colour), 48, location=(x, y, 0.08))
    parts.camera((0.1, -1.05, 0.5), (0.02, -0.03, 0.12), lens=45)
    return scene


def fig2(studio: Studio) -> Figure:
    shot = studio.shot(build)
    answer = shot.answer(shot.assets("billboards", **BAKE))
    both = {"half_distance": HALF}
    truth, shown = shot.picture(shot.truth, **both), shot.picture(answer, **both)
    scores = shot.scores(answer, shown, truth)
    row = [
        Panel("truth, both", up(truth), "Cycles' rays, faded and by Fresnel"),
        Panel("billboards, both", up(shown), scores.words()),
        Panel("its difference", up(shot.difference(shown, truth)), ""),
        Panel("billboards, neither", up(shot.picture(answer, fresnel=False)), "a perfect mirror, no fading"),
    ]
    words = f"Index of refraction 2.2; a reflection halves for every {HALF:g} m that the ray went."
    return Figure(
        "Fig 2: attenuation with distance and Fresnel effects, together",
        f"{words} Cycles has no such attenuation: the truth is its rays' radiance and distance through the same formula.",
        [("fig02.png", studio.sheet([row], words))],
        [HEADINGS, numbers("billboards, both", scores)],
    )


def fig15(studio: Studio) -> Figure:
    shot = studio.shot(build)
    answer = shot.answer(shot.assets("billboards", **BAKE))
    rows, table = [], [HEADINGS]
    for label, how in (("attenuation", {"fresnel": False, "half_distance": HALF}), ("Fresnel", {})):
        truth, shown = shot.picture(shot.truth, **how), shot.picture(answer, **how)
        scores = shot.scores(answer, shown, truth)
        row = [
            Panel(f"truth, {label}", up(truth), "Cycles, along the shader's rays"),
            Panel(f"billboards, {label}", up(shown), scores.words()),
            Panel("its difference", up(shot.difference(shown, truth)), ""),
        ]
        rows.append(row)
        table.append(numbers(label, scores))
    # Resolve's reflectance against the renderer's own, on the same rays.
    frame, truth = shot.look.apply(shot.frame.combined), shot.picture(shot.truth)
    apart = float(np.mean(np.abs(frame - truth)[shot.mask]))
    rows[1].append(Panel("the frame", up(frame), f"Cycles' own Fresnel; mean difference {short(apart)}"))
    rows[0].append(Panel("billboards, neither", up(shot.picture(answer, fresnel=False)), "a perfect mirror, no fading"))
    words = f"Top: a perfect mirror whose reflections halve for every {HALF:g} m. Bottom: glaze of index 2.2."
    return Figure(
        "Fig 15: attenuation with distance, and Fresnel effects, each alone",
        f"{words} Our Fresnel share differs from Cycles' own frame by {short(apart)} of the display range in the mean.",
        [("fig15.png", studio.sheet(rows, words))],
        table,
    )
