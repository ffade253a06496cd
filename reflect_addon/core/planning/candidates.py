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
from functools import cached_property

import numpy as np

from .. import methods
from ..asset import Asset
from ..asset_images import kind_of
from ..job import BakeJob
from ..kernel import Counts, record, run_numpy
from ..methods import environment
from .errors import Measured, measured, ray_errors
from .goal import Goal
from .samples import UNSEEN, Sample, Seen

COARSER, LEAST = 4, 16  # times fewer texels a side; texels a side
SIDES = ("resolution", "texels", "view_texels")
# What a try leaves out: what needs light, and what finds more of it.
PLAIN = {"samples": 1, "sky_error": 0.0, "live": False, "view_dependent": False}
# Images that grow with the side of what was baked, or not at all, and not with its square.
GROWTH = {"billboard_buf": 0, "srdm_buf": 1, "srdm_tx": 1}
LOOK_UP = 4.0  # operations on a number that a fetched texel costs as much as
PATHS = 4e5  # Cycles' paths a second on two cores


def ladder() -> tuple[str, ...]:
    """The methods that a plan chooses among, from cheap to dear."""
    return tuple(sorted(methods.gathering(), key=lambda name: getattr(methods.get(name), "EFFORT", 1.0)))


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


def tried(
    seen: Seen, job: BakeJob, asked: Callable[[str], dict], goal: Goal, only: str = "", say: Callable[[str], object] = lambda method: None
) -> Iterator[Candidate]:
    """The candidates for a reflector, in the order of ladder(). job: its trace brings no light; asked(method) -> settings of the real bake; only: a method that
    was chosen by hand."""
    made, held = _Made(job, asked, seen.planned), False
    alone = only or (environment.NAME if _needs_no_more(seen) else "")
    own = seen.reflector.object_name in _met(seen.planned)
    for method in ladder():
        why = getattr(methods.get(method), "needless", lambda *_: "")(made.assets, own)
        if alone and method != alone:
            why = f"{only} was chosen by hand" if only else _needs_no_more(seen)
        elif goal.tolerance and held:
            why = "a cheaper one keeps the tolerance"
        if why:
            yield Candidate(method, pruned=why)
            continue
        say(method)
        one = made.candidate(method)
        held |= one.promised <= goal.tolerance
        yield one


def measure(asset: Asset, sample: Sample) -> tuple[Measured, Counts]:
    """How far off the asset's answers to the sample's rays are, and the work that they were."""
    counts = Counts()
    answer = run_numpy(record(methods.get(asset.kind).trace, asset), asset, sample.rays, counts=counts)
    return measured(ray_errors(answer, sample.truth, sample.rays)), counts


def _work(counts: Counts) -> float:
    return counts.operations_per_ray + LOOK_UP * counts.fetches_per_ray


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

    def __init__(self, job: BakeJob, asked: Callable[[str], dict], sample: Sample):
        self._job, self._asked, self._sample = job, asked, sample
        self.assets: dict[str, Asset] = {}
        self._paths: dict[str, float] = {}

    @cached_property
    def _base(self) -> float:
        """Work of a look-up of the environment map."""
        return max(_work(measure(self._asset(environment.NAME), self._sample)[1]), 1.0)

    def candidate(self, method: str) -> Candidate:
        kinds = methods.with_required((method,))
        own, *others = [self._asset(kind) for kind in reversed(kinds)]
        errors, counts = measure(own.joined(*others), self._sample)
        size = sum(_grown(asset) for asset in (own, *others))
        seconds = sum(self._paths[kind] for kind in kinds) / PATHS
        return Candidate(method, errors, _work(counts) / self._base, size, seconds)

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
