"""Issue 6's stability table: small pictures of hard cases (bench_nielsen_stable_cases.py), drawn by mirrored views and live cube maps.

What is asked is that work ends and numbers are finite, whatever the case: no more views than a tree may have, no deeper than the depth, for
each of them as many passes as there are reflectors and a few more. Besides, the table says by what mirrors' pixels were answered, and how far
that is from rays that are reflected from mirror to mirror. Those are traced through Blender's BVH trees, which know nothing of ours.
Limits. The truth is of planar mirrors: of round ones it would need their shading normals. It ends where the depth does; pixels whose ray meets
one mirror more are answered by distance maps, and not judged.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..core import surface_radiance
from ..core.look import Look
from ..core.methods import layered_distance, recursive
from ..core.rays import Rays
from ..core.reflection_tree import TreeSettings
from ..core.spaces import STATUS_FELL_BACK, STATUS_HIT
from .bench_nielsen_stable_cases import CROWD, SIZE, Case, cases
from .bench_nielsen_stable_rays import DEPTH, LIFT, Reflecting
from .bench_row import row
from .exhibit import Exhibit
from .maps import difference_map
from .stability_scene import Surfaces

BAKE = {"resolution": 16, "samples": 1, "sky_error": 0, "layers": 2, "depth": DEPTH, "map_side": 64, "maps_per_frame": 2}
SURFACES = {**surface_radiance.DEFAULTS, "surface_samples": 1, "surface_tolerance": 0.02, "surface_levels": 5}
OWN_MAPS = 4  # reflectors that are baked by themselves; others share the last one's maps
# Passes of a picture or view beside one for each reflector: sky, light, taking over, lamps.
PASSES = 4
WRONG = 0.1  # of the mean radiance: a pixel that is farther off shows something else
EDGES = 0.05  # of a case's pixels: they may be at edges, or seen in views that are too many
SHOWN = ("three mirrors that meet in a corner", f"{CROWD} mirrors in a ring", "a sharp wedge of mirrors", "a ball in a ball, the eye between")


@dataclass
class Stable:
    """What became of one case, all its pictures together."""

    name: str
    views: int = 0  # of the picture with most
    deepest: int = 0
    passes: int = 0  # of the picture with most
    share: float = 0.0  # of the passes that may be, largest
    pixels: int = 0  # px of mirrors
    drawn: int = 0  # answered by a view
    gathered: int = 0  # by maps, distances as baked or live
    drawn_views: int = 0  # px of all views
    nonfinite: int = 0  # values
    judged: int = 0  # px
    wrong: int = 0
    errors: tuple[float, ...] = ()  # median of each picture, over its mean
    pictures: tuple[tuple[str, np.ndarray], ...] = ()


def measure(progress) -> list:
    """Rows for targets.json, and an Exhibit of the table."""
    found, all_cases = [], cases()
    for number, one in enumerate(all_cases):
        progress(number / len(all_cases), f"nielsen, stability: {one.name}")
        found.append(measured(one))
    return [*_rows(found), _shown(found)]


def measured(case: Case) -> Stable:
    from ..gpu.renderer import Renderer

    surfaces, out = Surfaces(case.scene), Stable(case.name)
    tracer = Reflecting(case, surfaces)
    lit = surface_radiance.bake(case.scene, tracer.trace, case.scene.instances, SURFACES)
    renderer = Renderer(case.scene, assets_of(case, surfaces, tracer), surfaces=lit)
    for camera in case.cameras:
        renderer.settle(camera)
        ray_map, before = renderer.ray_map(camera), renderer.counts()
        answer = renderer.answer(camera)
        after, views, mask = renderer.counts(), renderer.mirrored_views, ray_map.covered()
        picture = renderer.picture(camera)
        values = [answer.radiance, answer.position, answer.coverage, answer.status, picture]
        out.nonfinite += sum(int((~np.isfinite(v)).sum()) for v in values)
        passes = after["passes"] - before["passes"]
        out.views, out.deepest = max(out.views, len(views.nodes)), max([out.deepest, *(n.depth for n in views.nodes)])
        out.passes = max(out.passes, passes)
        out.share = max(out.share, passes / ((1 + len(views.nodes)) * (len(renderer.reflector_names) + PASSES)))
        out.pixels += int(mask.sum())
        out.drawn += int((answer.status[mask] == STATUS_HIT).sum())
        out.gathered += int((answer.status[mask] == STATUS_FELL_BACK).sum())
        out.drawn_views += views.pixels
        if not case.curved and mask.any():
            _judge(case, tracer, ray_map, answer.radiance[mask], out)
        if case.name in SHOWN:
            out.pictures += ((f"{case.name}: what mirrors show", _developed(answer.radiance)),)
    renderer.free()
    return out


def assets_of(case: Case, surfaces: Surfaces, tracer: Reflecting) -> dict:
    """By reflector, as a bake makes them."""
    job, assets = surfaces.job({**recursive.DEFAULTS, **layered_distance.DEFAULTS, **BAKE, "curved": case.curved}, {}), {}
    for number, reflector in enumerate(case.scene.reflectors()):
        if number < OWN_MAPS:
            own = replace(job, reflector=reflector, trace=tracer.trace)
            asset = recursive.bake(own).joined(layered_distance.bake(own))
        assets[reflector.name] = asset
    return assets


def _judge(case: Case, tracer: Reflecting, ray_map, radiance: np.ndarray, out: Stable):
    """Pixels of mirrors against rays; radiance (N, 3) of those that are covered."""
    mask = ray_map.covered()
    normal = ray_map.normal[mask]
    start = ray_map.origin[mask] + LIFT * case.size * normal
    hits, mirrors = tracer.followed(Rays(start.astype(np.float32), ray_map.direction[mask]), DEPTH)
    truth, judged = hits.radiance, mirrors < DEPTH
    error = np.abs(radiance - truth).max(-1)[judged] / max(float(truth[judged].mean()), 1e-30)
    out.judged += int(judged.sum())
    out.wrong += int((error > WRONG).sum())
    out.errors += (float(np.median(error)),)
    if case.name in SHOWN:
        shown = [np.zeros((*mask.shape, 3), np.float32) for _ in range(2)]
        for picture, values in zip(shown, (truth, radiance), strict=True):
            picture[mask] = np.where(judged[:, None], values, 0)
        right, ours = (_developed(picture) for picture in shown)
        out.pictures += ((f"{case.name}: rays", right), (f"{case.name}: difference", difference_map(ours, right, mask)))


def _developed(radiance: np.ndarray) -> np.ndarray:
    return Look().apply(np.nan_to_num(0.5 * radiance))


def _rows(found: list[Stable]) -> list[dict]:
    most = TreeSettings().most
    work = [max(getattr(one, name) for one in found) for name in ("views", "deepest", "share")]
    bad, pixels = sum(one.nonfinite for one in found), sum(one.pixels for one in found)
    judged, shares = sum(one.judged for one in found), [one.wrong / one.judged for one in found if one.judged]
    return [
        row("N-stable-finite", bad, 0, not bad,
            f"Values that are not finite in pictures of {len(found)} cases, radiance, places, coverage and status, {pixels:,} px of mirrors. The table "
            "is an exhibit."),
        row("N-stable-work", work, [most, DEPTH, 1], all(a <= b for a, b in zip(work, (most, DEPTH, 1), strict=True)),
            "Views of a picture, the deepest of them, and passes over those that may be: for the picture and each view one for each reflector and "
            f"{PASSES} more; the largest of all cases."),
        row("N-stable-truth", max(shares, default=0.0), EDGES, max(shares, default=0.0) <= EDGES,
            f"Largest share of a case's pixels of planar mirrors that are farther from reflected rays than {WRONG} of the mean radiance, {len(shares)} cases, "
            f"{judged:,} px, {SIZE[0]}x{SIZE[1]}: pixels at edges fall on either side, and {CROWD} mirrors have more views than are drawn."),
    ]  # fmt: skip


def _shown(found: list[Stable]) -> Exhibit:
    heads = (
        "case", "views", "deepest", "pixels of views", "passes", "pixels of mirrors", "by views or in live maps %", "by distance maps or not in live ones %", "not finite", "median error %", "wrong %",
    )  # fmt: skip

    def share(part: int, whole: int) -> str:
        return f"{100 * part / whole:.1f}" if whole else "-"

    rows = tuple(
        (
            one.name, str(one.views), str(one.deepest), str(one.drawn_views), str(one.passes), str(one.pixels), share(one.drawn, one.pixels),
            share(one.gathered, one.pixels), str(one.nonfinite), f"{100 * max(one.errors):.2f}" if one.errors else "-", share(one.wrong, one.judged),
        )
        for one in found
    )  # fmt: skip
    return Exhibit(
        "Stability of recursive mirrors",
        f"Pictures of {SIZE[0]}x{SIZE[1]} to depth {DEPTH}: views, the deepest, pixels drawn in them, passes (of the picture with most, where there are several), what "
        "answered the mirrors' pixels, and of planar mirrors the error against reflected rays over their mean, in the middle pixel, and the share of "
        f"pixels that are off by more than {WRONG:.0%}.",
        heads, rows, tuple(picture for one in found for picture in one.pictures),
    )  # fmt: skip
