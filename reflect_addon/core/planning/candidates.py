"""What a reflector can be given, each tried: baked coarsely and without light, its kernel run in NumPy on the rays that are seen.

Problem. Which stand-in is right where can only be measured, but baking all of them to find out costs more than it saves.
Idea. Where an answer lies is told by geometry alone: a bake whose rays meet meshes and bring no light (scene/geometric_trace.py), with a quarter of
the texels a side, takes a fiftieth of the time and shows the same points. Stand-ins are tried from cheap to dear, until one keeps the tolerance;
geometry says beforehand what cannot help.
Limits. Errors of coarse texels are in what is measured, so that it is too much rather than too little. What a stand-in leaves out of the light
(noise, highlights, second reflections' places) is not seen.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from .. import methods
from ..asset import Asset
from ..asset_images import kind_of
from ..job import BakeJob
from ..kernel import Counts, record, run_numpy
from .errors import Measured, measured, ray_errors
from .goal import Goal
from .samples import UNSEEN, Sample, Seen

# From cheap to dear.
LADDER = ("environment", "sphere_proxy", "box_proxy", "distance_map", "billboards", "layered_distance", "depth_maps", "light_field")
COARSER, LEAST = 4, 16  # times fewer texels a side; texels a side
SIDES = ("resolution", "texels", "view_texels")
# What a try leaves out: what needs light, and what finds more of it.
PLAIN = {"samples": 1, "sky_error": 0.0, "live": False, "view_dependent": False}
# Images that grow with the side of what was baked, or not at all, and not with its square.
GROWTH = {"billboard_buf": 0, "srdm_buf": 1, "srdm_tx": 1}
LOOK_UP = 4.0  # operations on a number that a fetched texel costs as much as
PATHS = 4e5  # Cycles' paths a second on two cores
FLAT = {"flat", "flat_mirror", "flat_glossy", "reflector"}  # kinds of parts that no depth map shows better than a quad (core/remake.py)


@dataclass(frozen=True)
class Candidate:
    """One stand-in for one reflector."""

    method: str
    errors: Measured | None = None  # None: not tried
    cost: float = 0.0  # of a ray, in look-ups of an environment map
    bytes: int = 0  # at the settings that are asked for
    bake_seconds: float = 0.0
    pruned: str = ""  # why it was not tried

    @property
    def promised(self) -> float:
        """Degrees."""
        return np.inf if self.errors is None else self.errors.promised


def tried(seen: Seen, job: BakeJob, asked: Callable[[str], dict], goal: Goal, say: Callable[[str], object] = lambda method: None) -> Iterator[Candidate]:
    """The candidates for a reflector, in the order of LADDER. job: its trace brings no light; asked(method) -> settings of the real bake."""
    if why := _needs_no_more(seen):
        sample = replace(seen.planned)
        made = _Made(job, asked)
        yield made.candidate(LADDER[0], sample)
        yield from (Candidate(method, pruned=why) for method in LADDER[1:])
        return
    made, held, round_things = _Made(job, asked), False, True
    for method in LADDER:
        why = ""
        if goal.tolerance and held:
            why = "a cheaper one keeps the tolerance"
        elif method == "depth_maps" and not round_things:
            why = "all that is met is flat, and a quad shows it exactly"
        if why:
            yield Candidate(method, pruned=why)
            continue
        say(method)
        one = made.candidate(method, seen.planned)
        if method == "billboards":
            own = any(name == seen.reflector.object_name for name in _met(seen.planned))
            round_things = own or any(part.kind not in FLAT for part in made.assets[method].parts)
        held |= one.promised <= goal.tolerance
        yield one


def measure(asset: Asset, sample: Sample) -> tuple[Measured, Counts]:
    """How far off the asset's answers to the sample's rays are, and the work that they were."""
    counts = Counts()
    answer = run_numpy(record(methods.get(asset.kind).trace, asset), asset, sample.rays, counts=counts)
    return measured(ray_errors(answer, sample.truth, sample.rays)), counts


def _needs_no_more(seen: Seen) -> str:
    """Why an environment map is all that a reflector needs, from what its rays meet alone; "" where it is not known."""
    if seen.by_cameras and seen.share < UNSEEN:
        return "no camera sees the reflector large enough"
    if not (seen.planned.truth.hit.any() or seen.held_out.truth.hit.any()):
        return "its rays meet nothing but the sky"
    return ""


def _met(sample: Sample) -> set[str]:
    return {sample.truth.object_names[k] for k in np.unique(sample.truth.object[sample.truth.hit])}


class _Made:
    """Coarse bakes of one reflector, each made once."""

    def __init__(self, job: BakeJob, asked: Callable[[str], dict]):
        self._job, self._asked = job, asked
        self.assets: dict[str, Asset] = {}
        self._paths: dict[str, float] = {}
        self._base: float | None = None

    def candidate(self, method: str, sample: Sample) -> Candidate:
        kinds = methods.with_required((method,))
        own, *others = [self._asset(kind) for kind in reversed(kinds)]
        errors, counts = measure(own.joined(*others), sample)
        work = counts.operations_per_ray + LOOK_UP * counts.fetches_per_ray
        if method == LADDER[0]:
            self._base = max(work, 1.0)
        size = sum(_grown(asset) for asset in (own, *others))
        seconds = sum(self._paths[kind] for kind in kinds) / PATHS
        return Candidate(method, errors, work / self._base, size, seconds)

    def _asset(self, kind: str) -> Asset:
        if kind not in self.assets:
            asked, rays = self._asked(kind), 0

            def traced(bundle, hide=(), samples=1, **more):
                nonlocal rays
                rays += len(bundle) * samples
                return self._job.trace(bundle, hide, samples, **more)

            required = {k: self._asset(k) for k in methods.get(kind).REQUIRES}
            job = replace(self._job, trace=traced, settings=coarse(asked), required=required)
            self.assets[kind] = methods.get(kind).bake(job)
            self._paths[kind] = rays * COARSER**2 * int(asked.get("samples", 1))
        return self.assets[kind]


def coarse(asked: dict[str, object]) -> dict[str, object]:
    """The settings of a try."""
    sides = {name: max(int(asked[name]) // COARSER, min(LEAST, int(asked[name]))) for name in SIDES if name in asked}
    return {**asked, **sides, **{name: value for name, value in PLAIN.items() if name in asked}}


def _grown(asset: Asset) -> int:
    """Bytes of what a coarse asset is at its full size."""
    return sum(
        image.shape[0] * image.shape[1] * kind_of(name).bytes * COARSER ** GROWTH.get(name, 2) for name, image in asset.images.items()
    )
