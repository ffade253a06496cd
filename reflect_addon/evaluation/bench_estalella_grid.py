"""Targets E1, E2, E3 and E7 of estalella-2005, which grids answer for (core/virtual_grid.py, core/virtual_follow.py).

Seconds are the processor's, of NumPy in one thread. What they are beside the work itself has to weigh on both ways alike, as nothing
did in the paper's program. NumPy takes some time for a call whatever its size, and a batch takes as long as its slowest search: so all
vertices are searched in batches about as large as the grid has nodes, and each batch holds every n-th vertex, as mixed as the nodes are
(a batch of one mesh ends in half the time where none of it is hidden). And processors slow down and speed up by two under
other work: each batch has a whole frame of the grid beside it, before it or after it in turns, and what is told is the median of such pairs'
ratios. What each way asks is counted too, as look-ups.
Where a grid cannot say (a node failed, or the silhouette passes), vertices are searched after all; the paper interpolates there, so its
ratios are compared without, and `how` has those with.
"""

from dataclasses import dataclass, replace
from time import process_time

import numpy as np

from ..core.virtual_follow import follow
from ..core.virtual_grid import CORNERS, grid, interpolated
from ..core.virtual_octree import octree
from ..core.virtual_status import CONVERGED, FAILED, HIDDEN
from ..scene.raymap_numpy import numpy_ray_map
from .bench_estalella_scene import STEPS, Kitchen, kitchen
from .bench_row import row

SHARES = (0.041, 0.055, 0.096, 0.143)
FASTER = (12.5, 10.5, 7.8, 6.4)  # target E2; the paper's own ratios
TENTH = 0.1
VISIBLE = 0.5  # px, target E3
SLOPE = 0.15  # a power of 1 may be off by so much
AWAY = (0.5, 1, 2, 4, 8, 16)  # distances of the eye, over the camera's own
ZOOM = 7.0  # the kettle across the picture, seen from the same place
PAIRS, TURNS = 40, 3  # of a batch and a frame of the grid, at least; and times that all vertices are searched, at least


def measure(progress) -> list[dict]:
    """Rows of targets.json (bench.Target)."""
    progress(0.0, "grids: kitchen")
    scene = kitchen()
    full = {name: scene.search(scene.positions, name) for name in STEPS}
    runs = {}
    for number, share in enumerate(SHARES):
        progress(0.1 + 0.15 * number, f"grids: {share:.1%} of the vertices")
        runs[share] = {name: _run(scene, share, name) for name in STEPS}
    progress(0.7, "grids: displacement")
    rows = [*_faster(scene, full, runs), _displaced(scene, full["newton"])]
    progress(0.8, "grids: cost")
    return [*rows, _cost(scene)]


@dataclass(frozen=True)
class Run:
    """Both ways in turns: ratios of the processor's seconds, and counts."""

    ratio: float  # all vertices searched, over the grid's frame: its nodes searched and the vertices interpolated
    whole: float  # the same, with what the grid cannot say searched after all
    between: float  # share of the grid's frame that is interpolation
    node_share: float
    rest_share: float
    work: float  # look-ups of all vertices over the nodes'


def _run(scene: Kitchen, share: float, name: str) -> Run:
    tables = grid(scene.positions, scene.instance, share)
    count, vertices = len(tables.node_position), len(scene.positions)
    batches = mixed(vertices, count)
    # The first makes what no later frame makes again.
    found = scene.search(tables.node_position, name)
    _, status = interpolated(tables, found["virtual"], found["status"])
    again = np.flatnonzero(status == FAILED)
    looks = sum(float(scene.search(scene.positions[batch], name)["evaluations"].sum()) for batch in batches)

    def frame() -> tuple[float, float]:
        start = process_time()
        nodes = scene.search(tables.node_position, name)
        middle = process_time()
        interpolated(tables, nodes["virtual"], nodes["status"])
        return middle - start, process_time() - middle

    def searched(batch) -> float:
        start = process_time()
        scene.search(scene.positions[batch], name)
        return process_time() - start

    pairs, rest = [], []
    for turn in range(max(TURNS, -(-PAIRS // len(batches)))):
        for batch in batches:
            if turn % 2:
                pairs.append((searched(batch), *frame()))
            else:
                nodes, between = frame()
                pairs.append((searched(batch), nodes, between))
        rest.append(sum(searched(again[batch]) for batch in mixed(len(again), count)) / sum(frame()))
    full, nodes, between = np.array(pairs).T
    ratio = len(batches) * float(np.median(full / (nodes + between)))
    return Run(
        ratio, ratio / (1 + float(np.median(rest))), float(np.median(between / (nodes + between))), count / vertices, len(again) / vertices,
        looks / float(found["evaluations"].sum()),
    )  # fmt: skip


def mixed(count: int, size: int) -> list[np.ndarray]:
    """Indices 0 to count - 1 in batches of about `size`, as equal as may be; each holds every n-th of them."""
    batches = max(round(count / size), 1)
    return [np.arange(first, count, batches) for first in range(min(batches, count))]


def _faster(scene: Kitchen, full, runs) -> list[dict]:
    midpoint, residual = [runs[share]["midpoint"] for share in SHARES], {}
    for name in STEPS:
        found = full[name]["status"] < FAILED
        residual[name] = np.percentile(full[name]["point"][found, 3], 95)

    def told(key, name, form):
        return ", ".join(format(getattr(runs[share][name], key), form) for share in SHARES)


    how = (
        f"{len(scene.positions)} vertices, searched as published in {STEPS['midpoint']} steps (95 % of residuals below "
        f"{residual['midpoint']:.1e}; newton {residual['newton']:.1e}); nodes {told('node_share', 'midpoint', '.1%')} of them. Medians of "
        f"{PAIRS} pairs and more; of the grid's time interpolation is {told('between', 'midpoint', '.1%')}. Look-ups of all vertices over the nodes' "
        f"{told('work', 'midpoint', '.1f')}. With what a grid cannot say ({told('rest_share', 'midpoint', '.1%')} of the vertices) searched too: {told('whole', 'midpoint', '.1f')}. "
        f"Newton {told('ratio', 'newton', '.1f')}, with those {told('whole', 'newton', '.1f')}"
    )
    ratios = [one.ratio for one in midpoint]
    tenth, wanted = ratios[2], FASTER[2]
    return [
        row("E1", tenth, wanted, tenth >= wanted, f"seconds of full search over a grid's of {SHARES[2]:.1%}; how: E2", wanted),
        row("E2", ratios, list(FASTER), all(a >= b for a, b in zip(ratios, FASTER, strict=True)), how, list(FASTER)),
    ]


def _displaced(scene: Kitchen, full) -> dict:
    tables = grid(scene.positions, scene.instance, TENTH)
    nodes = scene.search(tables.node_position)
    virtual, status = interpolated(tables, nodes["virtual"], nodes["status"])
    seen = (full["status"] == CONVERGED) & (status == CONVERGED)
    ours = _percentiles(scene, virtual, full["virtual"], seen)
    lens = np.diag([ZOOM, ZOOM, 1.0, 1.0]) @ scene.camera.clip_from_camera
    near = scene.seen_from(replace(scene.camera, clip_from_camera=lens))
    wide = _percentiles(near, virtual, full["virtual"], seen)
    hidden = _percentiles(scene, virtual, full["virtual"], (full["status"] == HIDDEN) & (status != FAILED))
    place, truth = _by_rays(scene)
    how = (
        f"px, at {scene.camera.width} x {scene.camera.height}; {seen.sum() / (full['status'] == CONVERGED).sum():.1%} of the reflected "
        f"vertices are interpolated; 99th percentile {ours[1]:.2f}. Seen {ZOOM:.0f} times as wide: {wide[0]:.2f}, {wide[1]:.2f}; hidden "
        f"ones {hidden[0]:.2f}. Against rays, whose hits' images should be at their pixels ({len(place)} of them): "
        f"{np.percentile(truth, 50):.3f}, 95th percentile {np.percentile(truth, 95):.2f}, with searches of the hits themselves"
    )
    return row("E3", ours[0], VISIBLE, ours[0] < VISIBLE, how)


def _percentiles(scene: Kitchen, virtual, truth, chosen) -> tuple[float, float]:
    """95th and 99th percentile of the displacement, px."""
    off = np.linalg.norm(scene.project(virtual) - scene.project(truth), axis=1)[chosen]
    return tuple(np.percentile(off, [95, 99])) if len(off) else (0.0, 0.0)


def _by_rays(scene: Kitchen) -> tuple[np.ndarray, np.ndarray]:
    """((N, 2) px, (N,) px how far from there the image of what its mirrored ray comes to is): points a metre along the rays."""
    rays = numpy_ray_map(scene.scene, scene.camera)
    rows, columns = np.nonzero(rays.reflector == rays.reflector_names.index(scene.reflector))
    points = rays.origin[rows, columns] + rays.direction[rows, columns]
    found = scene.search(points)
    good = found["status"] == CONVERGED
    place = np.stack([columns, rows], 1)[good] + 0.5
    return place, np.linalg.norm(scene.project(found["virtual"][good]) - place, axis=1)


def _cost(scene: Kitchen) -> dict:
    """Searches over vertices, and those of octrees over the reflector's size on the screen."""
    random = np.random.default_rng(1)
    counts, searches = [], []
    for part in (1.0, 0.5, 0.25, 0.125):
        some = np.sort(random.choice(len(scene.positions), int(part * len(scene.positions)), replace=False))
        counts.append(len(some))
        searches.append(len(grid(scene.positions[some], scene.instance[some], TENTH).node_position))
    slope = np.polyfit(np.log(counts), np.log(searches), 1)[0]
    tree = octree(scene.positions, scene.instance)
    center, told = scene.space.center, []
    low, high = scene.scene.bounds([scene.scene.named()[scene.reflector]])
    corners = np.where(CORNERS, high, low)
    for away in AWAY:
        pose = scene.camera.world_from_camera.copy()
        pose[:3, 3] = center + (pose[:3, 3] - center) * away
        there = scene.seen_from(replace(scene.camera, world_from_camera=pose))

        def search(points, instance, there=there):
            found = there.search(points)
            return found["virtual"], found["status"]

        box = there.project(np.column_stack([scene.space.points(corners), np.ones(8)]))
        told.append((float(np.prod(np.ptp(box, axis=0))), int(follow(tree, search, there.project, VISIBLE)[2].sum())))
    falls = all(b[1] < a[1] for a, b in zip(told, told[1:], strict=False))
    how = (
        f"power of a grid's nodes over the vertices, {TENTH:.0%} asked for; each reflector has its own searches, so they grow with the "
        f"number of reflectors. Octrees to {VISIBLE} px, (px^2 of the reflector's box, searches of {len(scene.positions)}): "
        + ", ".join(f"({area:.0f}, {count})" for area, count in told)
    )
    return row("E7", slope, 1.0, abs(slope - 1) <= SLOPE and falls, how)
