"""Issue 5's stability table: searches and drawn pictures of hard cases (bench_estalella_stable_cases.py).

Searches: in every piece of the reflector, by both methods, of all vertices around and of what has no answer or many: vertices on the
surface, in the eye, in the map's centre, on the line from the eye through it, at infinity; from the eye, from a point of the surface and
from infinity. What is asked is that they end: no more look-ups than the loops allow, every number finite, whatever the status.
Drawn: small pictures from before the reflector, from just above its surface and from infinity. Every number is finite, and what is
said to be a surface's point is on some surface, within WRONG of its distance from the reflector and the width of its pixel there:
fragments fill cracks between triangles that the pixel's own ray passes by less than that (core/methods/virtual_objects.py).
"""

from dataclasses import dataclass, field
from functools import cache
from types import SimpleNamespace

import numpy as np

from ..core import methods, reflection_search, surface_radiance, virtual_status
from ..core.asset import Asset
from ..core.kernel import evaluate, record_function
from ..core.map_space import MapSpace
from ..core.methods import layered_distance, virtual_objects
from ..core.reflector_map import IMAGES
from ..core.spaces import STATUS_HIT
from .bench_estalella_stable_cases import Case, cases
from .bench_row import row
from .exhibit import Exhibit
from .stability_scene import Surfaces

STEPS = {"newton": 24, "midpoint": 40}
# Look-ups that the kernels' loops allow: Newton's steps, then a hidden vertex's lowest place and false position; midpoint's, twice.
BOUNDS = {"newton": 2 * STEPS["newton"] + reflection_search.DEEPEST + 5, "midpoint": 4 * STEPS["midpoint"]}
BAKE = {"resolution": 16, "samples": 1, "sky_error": 0, "layers": 2}
SURFACES = {**surface_radiance.DEFAULTS, "surface_samples": 1, "surface_tolerance": 0.5, "surface_levels": 2}
WRONG = 1e-3
AXES = np.array([v for v in np.ndindex(3, 3, 3) if v != (1, 1, 1)]) - 1.0
ALONG = np.array([-1e3, -2.0, -0.3, 0.0, 1e-6, 0.2, 0.9, 1.0, 1.1, 30.0])  # places on the line from the middle through the eye, over the eye's


@dataclass
class Stable:
    """What became of one case."""

    name: str
    searches: int = 0  # of each method
    most: dict[str, int] = field(default_factory=dict)  # look-ups of the longest
    nonfinite: int = 0
    statuses: dict[str, dict[str, float]] = field(default_factory=dict)  # method -> status -> share
    pixels: int = 0
    drawn: int = 0
    bad_pixels: int = 0  # with a value that is no number
    wrong: int = 0  # drawn, and on no surface


def measure(progress) -> list:
    """A row for targets.json, and an Exhibit of the table."""
    found, all_cases = [], cases()
    for number, case in enumerate(all_cases):
        progress(number / len(all_cases), f"stability: {case.name}")
        found.append(measured(case))
    return [_row(found), _shown(found)]


def measured(case: Case, draw: bool = True) -> Stable:
    surfaces = Surfaces(case.scene)
    job = surfaces.job({**virtual_objects.DEFAULTS, **layered_distance.DEFAULTS, **BAKE, "map_texels": case.maps}, {})
    asset, out = virtual_objects.bake(job), Stable(case.name)
    _search(case, asset, out)
    if draw:
        under = methods.get(layered_distance.NAME).bake(job)
        lit = surface_radiance.bake(case.scene, surfaces.trace, case.scene.instances, SURFACES)
        _draw(case, surfaces, {case.scene.instances[0].name: asset.joined(under)}, lit, out)
    return out


def _search(case: Case, asset: Asset, out: Stable):
    asked = asked_of(case, asset)
    out.searches = len(asked["vertex"])
    for name in STEPS if out.searches else ():
        answer = evaluate(_program(name), asked, SimpleNamespace(images=asset.images, uniforms={}))
        out.most[name] = int(answer["evaluations"].max())
        out.nonfinite += sum(int((~np.isfinite(values)).sum()) for values in answer.values())
        out.statuses[name] = {text: float((answer["status"] == value).mean()) for value, text in virtual_status.NAMES.items()}


def asked_of(case: Case, asset: Asset) -> dict[str, np.ndarray]:
    """The search's inputs, (N, 4) each: every piece from every eye, all in one batch, which ends when its slowest search does."""
    points = np.concatenate([case.scene.world_positions(i) for i in case.scene.instances])
    on_it = case.reflector[0][case.reflector[1]].mean(1)
    asked = {name: [] for name in reflection_search.INPUTS}
    for part in virtual_objects.parts_in(asset):
        space = MapSpace(part.center, np.eye(3) / part.size)
        observers = [*(space.observer(camera) for camera in case.cameras), np.append(space.points(on_it[0]), 1.0)]
        vertices = np.concatenate([_at(space.points(points)), _at(space.points(on_it[:: max(len(on_it) // 50, 1)])), np.pad(AXES, ((0, 0), (0, 1)))])
        for observer in observers:
            special = np.concatenate([observer[None], _at(observer[None, :3] * ALONG[:, None])])
            values = {"observer": observer, "start": part.start, "block": part.block, "ball": part.ball, "cone": part.cone}
            asked["vertex"] += [vertices, special]
            for name, value in values.items():
                asked[name].append(np.broadcast_to(value, (len(vertices) + len(special), 4)))
    return {name: np.concatenate(parts) if parts else np.zeros((0, 4)) for name, parts in asked.items()}


@cache
def _program(name: str):
    options = {"steps": STEPS[name], "tolerance": reflection_search.TOLERANCE}
    return record_function(getattr(reflection_search, name), reflection_search.INPUTS, IMAGES, options=options)


def _at(points: np.ndarray) -> np.ndarray:
    return np.pad(points, ((0, 0), (0, 1)), constant_values=1.0)


def _draw(case: Case, surfaces: Surfaces, assets: dict, lit: Asset, out: Stable):
    from ..gpu.renderer import Renderer

    renderer = Renderer(case.scene, assets, surfaces=lit)
    for camera in case.cameras:
        seen, answer = renderer.ray_map(camera), renderer.answer(camera)
        mask = seen.covered()
        values = np.concatenate([answer.radiance, answer.position, answer.coverage[..., None], answer.status[..., None]], -1)
        finite = np.isfinite(values).all(-1)
        drawn = mask & (answer.status == STATUS_HIT) & finite
        out.pixels += int(mask.sum())
        out.drawn += int(drawn.sum())
        out.bad_pixels += int((~finite).sum())
        away = np.linalg.norm(answer.position[drawn].astype(np.float64) - seen.origin[drawn], axis=-1)
        width = seen.width[drawn] + seen.spread[drawn] * away
        out.wrong += int((~on_surfaces(case, surfaces, answer.position[drawn], width)).sum())
    renderer.free()


def on_surfaces(case: Case, surfaces: Surfaces, points: np.ndarray, width: np.ndarray) -> np.ndarray:
    """(N,) bool: points (N, 3) that are on some surface of the scene; width (N,): of their pixels there, m."""
    points = points.astype(np.float64)
    middle = case.scene.world_positions(case.scene.instances[0]).mean(0)
    allowed = WRONG * (np.linalg.norm(points - middle, axis=1) + case.size) + width
    near = np.zeros(len(points), bool)
    for instance in case.scene.instances:
        left = np.flatnonzero(~near)
        near[left] = surfaces.distance(instance, points[left]) <= allowed[left]
    return near


def _row(found: list[Stable]) -> dict:
    most = {name: max(one.most.get(name, 0) for one in found) for name in STEPS}
    counts = [sum(getattr(one, name) for one in found) for name in ("nonfinite", "bad_pixels", "wrong")]
    return row(
        "I5-stable", [*most.values(), *counts], [*BOUNDS.values(), 0, 0, 0],
        all(most[name] <= BOUNDS[name] for name in STEPS) and not any(counts),
        f"{len(found)} cases: look-ups of the longest search, Newton's and midpoint's; values of {2 * sum(one.searches for one in found):,} searches "
        f"that are not finite; pixels of {sum(one.pixels for one in found):,} drawn with such values; pixels drawn where no surface is. The table "
        "is an exhibit.",
    )  # fmt: skip


def _shown(found: list[Stable]) -> Exhibit:
    names = tuple(virtual_status.NAMES.values())
    heads = (
        "case", "searches", *(f"{method}: {what}" for method in STEPS for what in (*(f"{n} %" for n in names), "most look-ups")), "not finite",
        "pixels", "virtual objects %", "pixels not finite", "on no surface",
    )  # fmt: skip

    def searched(one: Stable, method: str) -> list[str]:
        shares = one.statuses.get(method)
        return [*(f"{100 * shares[name]:.1f}" if shares else "-" for name in names), str(one.most.get(method, 0))]

    rows = tuple(
        (
            one.name, f"{one.searches:,}", *searched(one, "newton"), *searched(one, "midpoint"), str(one.nonfinite),
            f"{one.pixels:,}", f"{100 * one.drawn / max(one.pixels, 1):.1f}", str(one.bad_pixels), str(one.wrong),
        )
        for one in found
    )  # fmt: skip
    return Exhibit(
        "Stability of virtual objects",
        "Searches of each case's vertices and of impossible ones (on the surface, in the eye, on the line through the middle, at infinity) in every "
        "piece, from the eye, from the surface and from infinity; and what small pictures from there show. Numbers of no meaning and points on no "
        "surface must be 0.",
        heads, rows,
    )  # fmt: skip
