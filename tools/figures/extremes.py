"""Fig 16: extreme magnification and minification, by a billboard and by a depth map, with and without levels of detail."""

import math

import numpy as np
from mathutils import Matrix

from reflect_addon.evaluation import eye
from reflect_addon.evaluation.bench_depth_scene import bunny
from sample_blends import build_columns, build_teapots, scene_parts as parts

from .sheet import Panel, short
from .shot import FINE, Shot
from .studio import Figure, Studio, up

BAKE = {"resolution": 256, "samples": 4, "texels": 256}
RIPPLE, WAVE = 0.022, 0.32  # m: height of the dish's rings, and from ring to ring
DISH = 0.62  # m, its radius


def _dish(scene_name: str):
    """A mirror whose middle is hollow (it magnifies) between rings that bulge (they minify), facing the camera's side."""
    scene = parts.start(scene_name)
    parts.set_world_image(scene, build_teapots.small_world(build_teapots.WORLD), turn=math.radians(200))
    parts.box(
        "Ground", (4.0, 4.0, 0.04), (0, 0, -0.02), parts.checker("Ground", (0.75, 0.72, 0.66), (0.12, 0.2, 0.3), 0.25)
    )
    radii = np.linspace(0, DISH, 80)
    profile = [(r, RIPPLE * (1 - math.cos(2 * math.pi * r / WAVE))) for r in radii]
    profile[0] = (0, 0.0)
    parts.lathe(
        "Dish",
        profile,
        parts.mirror("Dish", (0.95, 0.95, 0.95)),
        160,
        location=(0, 0.5, 0.66),
        rotation=(math.radians(90), 0, 0),
    )
    parts.camera((-0.5, -1.15, 0.85), (0.0, 0.5, 0.64), lens=38)
    return scene


def with_picture():
    scene = _dish("picture")
    pixels = np.kron(build_columns.blocks(np.random.default_rng(1963), 64, 64), np.ones((4, 4, 1), np.float32))
    y, x = np.mgrid[: len(pixels), : len(pixels)]
    pixels[(x // 4 + y // 4) % 2 == 0] *= 0.55  # finer than a pixel where the mirror minifies
    parts.panel(
        "Picture", 0.6, 0.6, parts.picture("Picture", pixels), location=(0.25, -0.35, 0.55), rotation=(0, 0, math.pi)
    )
    return scene


def with_bunny():
    scene = _dish("bunny")
    thing, _ = bunny()
    thing.name = "Object"
    extent = float(np.ptp([v.co for v in thing.data.vertices], axis=0).max())
    thing.data.materials.clear()
    thing.data.materials.append(parts.checker("Checks", (0.85, 0.25, 0.08), (0.95, 0.9, 0.8), extent / 40))
    thing.data.polygons.foreach_set("use_smooth", [True] * len(thing.data.polygons))
    corners = np.array([thing.matrix_world @ v.co for v in thing.data.vertices])
    turned = Matrix.Scale(0.3, 4) @ Matrix.Rotation(math.pi, 4, "Z")
    thing.matrix_world = (
        Matrix.Translation((0.25, -0.35, 0.25 - 0.3 * corners[:, 2].min())) @ turned @ thing.matrix_world
    )
    parts.box("Stand", (0.5, 0.5, 0.25), (0.25, -0.35, 0.125), parts.material("Stand", (0.3, 0.32, 0.35)))
    return scene


def fig16(studio: Studio) -> Figure:
    rows, table = [], [["", "FLIP", "pixel to pixel", "truth's"]]
    for method, scene, thing in (("billboards", with_picture, "a picture"), ("depth_maps", with_bunny, "a bunny")):
        found, scores = _row(studio, studio.shot(scene), method, thing)
        rows += found
        table += scores
    words = f"truth: {FINE * FINE} rays a pixel. A pixel's footprint chooses the level of colours (mip-mapping)."
    return Figure(
        "Fig 16: extreme magnification and minification",
        f"{words} The dish's hollow middle magnifies, its bulging rings minify.",
        [("fig16.png", studio.sheet(rows, words))],
        table,
    )


def _row(studio: Studio, shot: Shot, method: str, thing: str) -> tuple[list[list[Panel]], list[list[str]]]:
    """The strip of one scene and its numbers."""
    truth, whole = shot.fine_frame
    assets = shot.assets(method, **BAKE)
    row, table = [Panel(f"truth, {thing}", up(truth), f"Cycles, {FINE * FINE} rays a pixel")], []
    for label, filtered in (("with levels", True), ("single rays", False)):
        picture = shot.picture(shot.answer(assets, filtered=filtered))
        flip = eye.flip(picture, truth, whole)[0]
        row.append(Panel(f"{method}, {label}", up(picture), f"FLIP {short(flip)}"))
        row.append(Panel("its difference", up(shot.difference(picture, truth, whole)), ""))
        table.append(
            [
                f"{thing}: {method}, {label}",
                short(flip),
                short(_roughness(picture, whole)),
                short(_roughness(truth, whole)),
            ]
        )
    return [row], table


def _roughness(picture: np.ndarray, mask: np.ndarray) -> float:
    """Root mean square of the steps between neighbouring pixels of the mask: what aliasing adds."""
    steps = [np.diff(picture, axis=a)[np.diff(mask.astype(int), axis=a) == 0] for a in (0, 1)]
    return float(np.sqrt(np.mean(np.concatenate([s.ravel() for s in steps]) ** 2)))
