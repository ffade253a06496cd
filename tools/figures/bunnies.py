"""Figs 3, 13 and 14: a matt bunny at and in a mirror bunny, and before a mirror ball, reflected by depth maps."""

import math
from functools import partial

import bpy
import numpy as np
from mathutils import Matrix

from reflect_addon.core import metrics, srdm, srdm_greedy, srdm_optimal
from reflect_addon.core.depth_camera import fit
from reflect_addon.core.depth_fit import DepthView
from reflect_addon.core.rays import Answer
from reflect_addon.core.spaces import STATUS_HIT
from reflect_addon.evaluation.bench_depth import ERROR, z_error
from reflect_addon.evaluation.bench_depth_scene import bunny, outline_error
from reflect_addon.scene.intersect import intersector
from sample_blends import build_teapots, scene_parts as parts

from .sheet import Panel, short
from .shot import Shot
from .studio import HEADINGS, Figure, Studio, busiest, magnified, numbers, outlined, up

BAKE = {"resolution": 128, "samples": 8, "texels": 256}
# As in the paper: one map of the object, rows alone, no maps of the mirror.
PAPER = {**BAKE, "maps": 1, "self_reflections": False, "refine": False}
POINTS = (4, 8, 16, 64)  # m of Fig 13
BALL = 1.6  # m, its radius
INCREMENTS = (20, 10, 3, 2)  # degrees, of Fig 14
TOUCHING, INTERSECTING = -1.35, -0.95  # m from bunny to bunny, which are 2 m wide


def _matt_bunny() -> tuple[bpy.types.Scene, bpy.types.Object, float]:
    """(a new scene, its bunny on a chequered table under the teapots' world, height of the table)."""
    scene = parts.start("bunnies")
    parts.set_world_image(scene, build_teapots.small_world(build_teapots.WORLD), turn=math.radians(200))
    thing, _ = bunny()
    thing.name = "Object"
    _dressed(thing, parts.material("Matt", (0.75, 0.26, 0.12)))
    low = min((thing.matrix_world @ v.co).z for v in thing.data.vertices)
    ground = parts.checker("Table", (0.75, 0.72, 0.66), (0.12, 0.2, 0.3), 0.5)
    parts.box("Table", (8.0, 8.0, 0.1), (0.1, -0.7, low - 0.05), ground)
    return scene, thing, low


def _dressed(thing: bpy.types.Object, surface: bpy.types.Material) -> None:
    thing.data.materials.clear()
    thing.data.materials.append(surface)
    thing.data.polygons.foreach_set("use_smooth", [True] * len(thing.data.polygons))


def face_to_face(away: float) -> bpy.types.Scene:
    """A mirror bunny `away` m along y from the matt one."""
    scene, thing, _ = _matt_bunny()
    copy = thing.copy()
    copy.data, copy.name = thing.data.copy(), "Mirror"
    scene.collection.objects.link(copy)
    copy.matrix_world = Matrix.Translation((0.2, away, 0.0)) @ Matrix.Rotation(np.pi, 4, "Z") @ thing.matrix_world
    _dressed(copy, parts.mirror(colour=(0.95, 0.95, 0.95)))
    parts.camera((4.5, 1.2, 1.2), (0.2, -0.9, -0.1), lens=62)
    return scene


def before_a_ball() -> bpy.types.Scene:
    """The matt bunny's outline, whole, in a mirror ball."""
    scene, _, low = _matt_bunny()
    parts.sphere("Mirror", BALL, parts.mirror(colour=(0.95, 0.95, 0.95)), 128, location=(0.0, -3.0, low + 0.7 * BALL))
    parts.camera((2.2, 1.0, 1.3), (0.0, -1.6, -0.05), lens=75)
    return scene


touching, intersecting = partial(face_to_face, TOUCHING), partial(face_to_face, INTERSECTING)


def fig3(studio: Studio) -> Figure:
    sheets, table = [], [HEADINGS]
    for file, label, scene in (
        ("fig03-touching.png", "touching", touching),
        ("fig03-intersecting.png", "intersecting", intersecting),
    ):
        shot = studio.shot(scene)
        shown = [
            ("environment", shot.answer(shot.assets("environment", **BAKE))),
            ("billboards", shot.answer(shot.assets("billboards", **BAKE))),
            ("depth map, as the paper", shot.answer(shot.assets("depth_maps", **PAPER, points=8))),
            ("depth_maps", shot.answer(shot.assets("depth_maps", **BAKE))),
        ]
        rows, found = studio.compared(shot, shown)
        table += [[f"{label}: {row[0]}", *row[1:]] for row in found[1:]]
        words = f"The bunnies are {label}. As the paper: one map of the matt bunny, m = 8, n = 60; depth_maps: several, and the mirror's own."
        sheets.append((file, studio.sheet(rows, words)))
    return Figure(
        "Fig 3: diffuse and reflective bunnies",
        "Where the bunnies meet, reflection and object must join; a flat billboard cannot. The paper has no self-reflections: "
        "what the mirror bunny shows of itself (ears, feet) is the last column's gain.",
        sheets,
        table,
    )


def fig13(studio: Studio) -> Figure:
    shot = studio.shot(touching)
    shown = [(f"m = {m}", shot.answer(shot.assets("depth_maps", **PAPER, points=m))) for m in POINTS]
    rows, table = studio.compared(shot, shown)
    close = studio.close_up(shot, meets_the_object(shot), rows, shown)
    plots, errors = _simplification(shot)
    table[0] = [*table[0], "bunny: hit p50", "relative z error"]
    rays = meets_the_object(shot)[shot.mask]
    for row, m, (_, answer) in zip(table[1:], POINTS, shown, strict=True):
        off = metrics.hit_distance_error(answer, shot.truth, shot.rays, shot.diagonal)[rays]
        row += [short(float(np.median(off[np.isfinite(off)]))), f"{100 * errors[m]:.2g} %"]
    words = "One 256x256 map, n = 60, poly-lines alone; rays that it cannot serve (the mirror's own, the bunny's far side) are in the numbers."
    return Figure(
        "Fig 13: reflections by simplified rows",
        f"{words} Eight points a row are enough for the eye. Below: a row of a rotated domain and its poly-lines (Fig 12), the map's "
        "rotated rows, and the error that simplifying leaves over m (mean of z over the object's depth range).",
        [("fig13.png", studio.sheet([*rows, close, plots], words))],
        table,
    )


def fig14(studio: Studio) -> Figure:
    shot = studio.shot(before_a_ball)
    bakes = [(f"{step}°", {"turns": 180 // step}) for step in INCREMENTS] + [
        ("10°, two rows", {"turns": 18, "rows": 2})
    ]
    shown = [(label, shot.answer(shot.assets("depth_maps", **PAPER, points=16, **turns))) for label, turns in bakes]
    true = meets_the_object(shot)
    outlines = [_shown(shot, answer) for _, answer in shown]
    window = busiest(outlines[0] != outlines[-2], (studio.size[0] // 6, studio.size[1] // 6))
    frame = shot.picture(shot.truth)
    top = [Panel("truth", magnified(frame, window, studio.size), "6 times")]
    below = [Panel("where", up(outlined(frame, window)), "the window that is shown")]
    table = [[*HEADINGS, "edge error, px"]]
    for (label, answer), outline in zip(shown, outlines, strict=True):
        picture, error = shot.picture(answer), outline_error(outline, true)
        top.append(Panel(label, magnified(picture, window, studio.size), f"edges {short(error)} px off"))
        wrong = np.where((outline != true)[..., None], (1.0, 0.55, 0.05), 0.3 * picture)
        below.append(Panel("wrong pixels", magnified(wrong, window, studio.size), "object or not: orange where wrong"))
        table.append([*numbers(label, shot.scores(answer, picture)), short(error)])
    words = "m = 16, one row of poly-lines a ray; edge error: wrong pixels over the length of the outline of the bunny's reflection."
    return Figure(
        "Fig 14: edges over the angular increment",
        f"{words} The paper finds 3 degrees good. Two rows at 10 degrees (the paper's wish) are the last column.",
        [("fig14.png", studio.sheet([top, below], words, legend=False))],
        table,
    )


def meets_the_object(shot: Shot) -> np.ndarray:
    """(H, W) bool: rays that meet the matt bunny, and not the mirror itself before it."""
    out = np.zeros(shot.mask.shape, bool)
    hits = shot.truth
    out[shot.mask] = hits.hit & (hits.object == hits.object_names.index("Object"))
    return out


def _shown(shot: Shot, answer: Answer) -> np.ndarray:
    """(H, W) bool: pixels that show the matt bunny: what stands nearer than the table, which is a quad, and is no sky."""
    low, high = shot.snapshot.bounds([shot.snapshot.named()["Object"]])
    slack = 0.01 * float(np.max(high - low))
    inside = np.all((answer.position > low - slack) & (answer.position < high + slack), axis=1)
    table_top = shot.snapshot.bounds([shot.snapshot.named()["Table"]])[1][2]
    out = np.zeros(shot.mask.shape, bool)
    out[shot.mask] = (answer.status == STATUS_HIT) & inside & (answer.position[:, 2] > table_top + 1e-3)
    return out


def _simplification(shot: Shot) -> tuple[list[Panel], dict[int, float]]:
    """(plots of what a depth map becomes, relative z error by m)."""
    thing = shot.snapshot.named()["Object"]
    camera = fit(shot.snapshot.world_positions(thing), (0, -1, 0))
    view = DepthView("Object", camera)
    depth = view.depth(intersector(shot.snapshot)(thing, view.rays(256)))
    n, w = 60, len(depth)
    turned = srdm.rotated_rows(depth, n)
    errors = {m: z_error(camera, turned, srdm_greedy.simplify, m) for m in sorted({*POINTS, *ERROR})}
    # Of a domain turned by 36 degrees the row that has most samples in two spans, as the paper's has.
    turn = n // 5
    block = turned[turn * w : (turn + 1) * w]
    spans, solid = (
        np.count_nonzero(np.diff(np.isnan(block), axis=1), axis=1) // 2,
        np.count_nonzero(~np.isnan(block), axis=1),
    )
    at = int(np.argmax(np.where(spans == 2, solid, 0)))
    row = block[at]
    greedy, optimal = (
        f(srdm.with_spans(block[at : at + 1], 8), 8)[0] for f in (srdm_greedy.simplify, srdm_optimal.simplify)
    )

    def image(values, line=None):
        def paint(axes):
            axes.imshow(values, origin="lower", cmap="viridis", aspect="equal")
            if line is not None:
                axes.axhline(line, color="#e4572e", linewidth=1)
            axes.tick_params(labelsize=7)

        return paint

    def lines(axes):
        axes.plot(np.arange(w) + 0.5, row, color="#999", linewidth=2.5, label="depth samples")
        for points, colour, label in ((greedy, "#1f6feb", "greedy, m = 8"), (optimal, "#d9730d", "optimal, m = 8")):
            for span in _spans(points):
                axes.plot(span[:, 0], span[:, 1], color=colour, marker="o", markersize=3, linewidth=1, label=label)
                label = None
        axes.legend(fontsize=6, frameon=False)
        axes.tick_params(labelsize=7)

    def over_m(axes):
        axes.semilogy(list(errors), [100 * e for e in errors.values()], marker="o", color="#1f6feb", label="greedy")
        axes.semilogy(
            list(ERROR), [100 * e for e in ERROR.values()], marker="s", color="#999", label="the paper (over z)"
        )
        axes.legend(fontsize=6, frameon=False)
        axes.tick_params(labelsize=7)

    plots = [
        Panel("depth map", image(depth), "q = normalised 1/z"),
        Panel(f"domain {turn} of {n}", image(block, at), f"turned {180 // n * turn}°; the line: row {at}"),
        Panel(f"row {at}", lines, "q over u, texels"),
        Panel("z error over m", over_m, "% of the object's depth range"),
    ]
    return plots, errors


def _spans(points: np.ndarray) -> list[np.ndarray]:
    """Poly-lines of one simplified row (m, 2); a negative u begins one (core/srdm.py)."""
    used = points[np.abs(points[:, 0]) < srdm.FILL]
    begins = np.flatnonzero(used[:, 0] < 0)
    return [np.abs(part) for part in np.split(used, begins) if len(part)]
