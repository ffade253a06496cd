"""Figs 6 and 7: a mirror teapot on a chequered ground that goes on, without and with the morph."""

import math

import numpy as np

from reflect_addon.core import ground_box
from reflect_addon.core.kernel import Hit
from reflect_addon.core.methods import billboards
from reflect_addon.core.spaces import STATUS_FELL_BACK
from reflect_addon.evaluation import ground_quads
from sample_blends import build_teapots, scene_parts as parts

from .sheet import Panel
from .studio import Figure, Studio, up

HALF = 100.0  # m, of the ground: beyond it the world's own
WIDTH = 1.2  # m, of the small box
BAKE = {"resolution": 256, "samples": 16}
RED, GREEN = (0.9, 0.1, 0.1), (0.1, 0.8, 0.2)
APART = 0.1  # of the display range: a difference that the close-up is about
MARK = 0.55  # of the highlight's colour over the picture


def build():
    """The teapots' ground and world, and one teapot."""
    scene = parts.start("morph")
    parts.set_world_image(scene, build_teapots.small_world(build_teapots.WORLD), turn=math.radians(200))
    vertices, faces = build_teapots.tessellate(8)
    surface = parts.checker("Chequered ground", (0.75, 0.72, 0.66), (0.12, 0.2, 0.3), 0.25)
    corners = [(-HALF, -HALF, 0), (HALF, -HALF, 0), (HALF, HALF, 0), (-HALF, HALF, 0)]
    parts.mesh("Ground", corners, [(0, 1, 2, 3)], surface, smooth=False)
    silver = parts.mirror("Silver", (0.93, 0.93, 0.92))
    parts.mesh("Teapot", vertices * build_teapots.SCALE, faces, silver, rotation=(0, 0, math.radians(200)))
    parts.camera((0.1, -0.85, 0.36), (0.0, 0.0, 0.14), lens=45)
    return scene


def fig6_7(studio: Studio) -> Figure:
    shot = studio.shot(build)
    (name,) = (i.name for i in shot.snapshot.reflectors())
    small, automatic = (
        ground_quads.alone(shot.assets("billboards", **BAKE, ground_size=width)[name]) for width in (WIDTH, 0.0)
    )
    only = ground_quads.ground_alone(small)
    shown = [
        ("environment", shot.answer(shot.assets("environment", **BAKE))),
        ("Fig 6: quad, no morph", shot.answer({name: only}, ground_quads.trace)),
        ("Fig 7: morph", shot.answer({name: small}, billboards.trace)),
        ("box from the parallax", shot.answer({name: automatic}, billboards.trace)),
    ]
    rows, table = studio.compared(shot, shown)
    outside = shown[1][1].status == STATUS_FELL_BACK
    share = shot.answer({name: small}, wall_share).radiance[:, 0]
    morphed = (share > 0) & (share < 1)
    apart = np.abs(shot.picture(shown[1][1]) - shot.picture(shown[3][1])).max(-1) > APART  # what the quad's end does
    close = studio.close_up(shot, apart, rows, shown)
    marks = [
        None,
        None,
        Panel(
            "red: environment map",
            up(marked(shot, shown[1][1], outside, RED)),
            f"{100 * outside.mean():.0f} % of the rays",
        ),
        Panel(
            "green: transition",
            up(marked(shot, shown[2][1], morphed, GREEN)),
            f"{100 * morphed.mean():.0f} % of the rays",
        ),
        None,
    ]
    words = f"Ground: a quad and a box {WIDTH:g} m wide; last column: the box that the bake chooses by itself."
    return Figure(
        "Figs 6 and 7: from billboard to environment map",
        f"{words} Without the morph the ground jumps where its quad ends and shows twice what the quad has; with it "
        "the ground goes on without a step. A box as large as the parallax asks for leaves nothing to see.",
        [("fig06-07.png", studio.sheet([*rows, close, marks], words))],
        table,
    )


def wall_share(k, asset, ray) -> Hit:
    """A kernel that shows the morph's share of the environment map: 0 on the ground, 1 above H."""
    share = ground_box.meeting(k, asset, ray, ray.origin - asset.uniforms["center"])[-1]
    return Hit(radiance=k.vec3(share), position=ray.origin, coverage=1.0, status=1.0)


def marked(shot, answer, rays: np.ndarray, colour) -> np.ndarray:
    """The answer's picture, the pixels of these rays (N,) tinted."""
    picture = shot.picture(answer)
    pixels = np.zeros(shot.mask.shape, bool)
    pixels[shot.mask] = rays
    picture[pixels] = (1 - MARK) * picture[pixels] + MARK * np.array(colour)
    return picture
