"""What a reflector can be given, each tried: baked coarsely and without light, its kernel run in NumPy on the rays that are seen.

Problem. Which stand-in is right where can only be measured, but baking all of them to find out costs more than it saves.
Idea. Where an answer lies is told by geometry alone: a bake whose rays meet meshes and bring no light (scene/geometric_trace.py), with a quarter of
the texels a side, takes a fiftieth of the time and shows the same points. Stand-ins are tried from cheap to dear, until one keeps the tolerance;
geometry says beforehand what cannot help, and objects that no ray meets are left out of all of them. What is round and shown as well by a quad gets no
depth map: that is tried once more, as one.
Limits. Errors of coarse texels are in what is measured, so that it is too much rather than too little; what is left of them with full ones is
told from two tries (errors.foretold) where nothing is good enough without. What a stand-in leaves out of the light
(noise, highlights, second reflections' places) is not seen.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np

from .. import methods
from ..asset import Asset
from ..job import BakeJob
from ..methods import environment
from .candidate import QUADS, WITHOUT, Candidate, Changes, ladder
from .coarse_bake import COARSER, COARSEST, FINER, coarse, finer, grown
from .errors import EXACT, Measured, foretold, measured
from .goal import PROMISED, Goal
from .met import met_by
from .samples import UNSEEN, Sample, Seen
from .shown import Views, draws, mirrored_views, shown

SMALL = 2e-4  # of the cameras' pixels: a reflector of fewer, 400 of 1920 x 1080, is shown by what is cheap
CHEAP = 5.0  # effort of a try that is made whether or not it can be good enough: something must be taken where nothing is
CONTEST = 1.3  # times the least error: what may be the least in truth is looked at again
PATHS = 4e5  # Cycles' paths a second on two cores

_Key = tuple[str, Changes, int]  # what is tried: a method, its changes, how many times coarser


class Trial:
    """The candidates of one reflector. job: its trace brings no light; asked(method) -> settings of the real bake; only: a method chosen by hand; kept: the one
    stand-in, (method, settings that differ), that may be taken."""

    def __init__(self, seen: Seen, job: BakeJob, asked: Callable[[str], dict], goal: Goal, only: str = "", kept: tuple[str, Changes] | None = None):
        self.seen, self._job, self._asked, self._goal, self._only, self._kept = seen, job, asked, goal, only, kept
        self._assets: dict[_Key, Asset] = {}
        self._paths: dict[_Key, float] = {}
        self._errors: dict[_Key, np.ndarray] = {}
        self._tried: dict[_Key, Candidate] = {}
        self.unmet: tuple[str, ...] = ()  # names of objects that none of its rays meets

    @cached_property
    def _base(self) -> float:
        """Work of a look-up of an environment map."""
        return max(self._measured((environment.NAME, (), COARSER))[1], 1.0)

    @cached_property
    def _views(self) -> Views | None:
        return mirrored_views(self._job.scene, self.seen, self._job.shared)

    def candidates(self, say: Callable[[str], object] = lambda method: None) -> tuple[Candidate, ...]:
        """From cheap to dear. Where none keeps the tolerance the one that comes nearest is tried with COARSEST texels, too, to tell what the full ones bring; where
        none is asked for all are, since each is compared with each, and those that are nearly as good with FINER ones."""
        if self._kept is not None:
            return self._as_it_is(say)
        found = list(self._climbed(say))
        tried = [c for c in found if c.errors]
        for one in tried if not self._goal.tolerance else [min(tried, key=Candidate.far_off)]:
            if one.promised > self._goal.tolerance and one.method != environment.NAME and not self._is_small():
                say(one.method)
                found[found.index(one)] = replace(one, errors=self._foretold(one, COARSER, COARSEST))
        for one in self._contenders(found):
            say(one.method)
            found[found.index(one)] = replace(one, errors=self._foretold(one, FINER, COARSER))
        return tuple(found)

    def _contenders(self, found: list[Candidate]) -> list[Candidate]:
        """The nearest of each method where what is foretold of several does not choose among them, and nothing but their errors does."""
        if self._goal.tolerance or self._is_small():
            return []
        told = sorted((c for c in found if c.errors and c.method != environment.NAME), key=lambda c: c.errors.mean, reverse=True)
        best = {c.method: c for c in told}
        near = [c for c in best.values() if c.errors.mean <= CONTEST * told[-1].errors.mean]
        return near if len(near) > 1 and told[-1].errors.mean > EXACT else []

    def _foretold(self, one: Candidate, *times: int) -> Measured:
        """times: fewer texels a side, of two tries."""
        fine, coarse = ((one.method, one.changes, t) for t in times)
        for key in (fine, coarse):
            if key not in self._errors:
                self._measured(key)
        asked = self._asked(one.method) | dict(one.changes)
        return foretold(self._errors[fine], self._errors[coarse], finer(asked, times[0]), self._goal.unit)

    def _as_it_is(self, say: Callable[[str], object]) -> tuple[Candidate, ...]:
        method, changes = self._kept
        say(method)
        others = [Candidate(name, differ, pruned="it is kept as it is") for _, name, differ in ladder() if (name, differ) != self._kept]
        return (self.tried(method, changes), *others)

    def _climbed(self, say: Callable[[str], object]) -> Iterator[Candidate]:
        enough = self._enough()
        alone = self._only or (environment.NAME if enough else "")
        met = set() if alone == environment.NAME else met_by(self._job, self.seen)
        self.unmet = tuple(sorted({i.object_name for i in (*self._job.scene.instances, *self._job.scene.lamps)} - met - {self.seen.reflector.object_name}))
        own_share = _share(self.seen.planned, self.seen.reflector.object_name)
        blind = self._goal.tolerance > 0 and not self._only and own_share > 1 - PROMISED
        own, held, tried = self.seen.reflector.object_name in met, False, []
        for effort, method, changes in self._by_effort(bool(alone)):
            why = getattr(methods.get(method), "needless", lambda *_: "")({kind: asset for (kind, *_), asset in self._assets.items()}, own)
            if alone and method != alone:
                why = f"{self._only} was chosen by hand" if self._only else enough
            elif draws(method) and not self._goal.views:
                why = "mirrored views are switched off"
            elif draws(method) and self._views is None:
                why = "it has no planar mirror"
            elif held:
                why = "a cheaper one keeps the tolerance"
            elif effort > CHEAP and self._is_small():
                why = "the reflector covers too little of the picture"
            elif effort > CHEAP and blind and not (draws(method) or _shows_itself(method, self._asked(method) | dict(changes))):
                why = f"{own_share:.0%} of the rays meet the reflector itself, which it does not show"
            if why:
                yield Candidate(method, changes, pruned=why)
                continue
            say(method)
            one = self.tried(method, self._leaving_out(method, changes))
            tried.append(one)
            yield one
            if (more := self._with_quads(one, tried)) is not None:
                tried.append(one := self.tried(*more))
                yield one
            held = bool(self._goal.tolerance) and any(c.promised <= self._goal.tolerance for c in tried)

    def _by_effort(self, is_settled: bool) -> list[tuple[float, str, Changes]]:
        """ladder(), of views with what they cost here: of a large mirror less than billboards, of a small one in a large scene more than depth maps. is_settled:
        nothing will be chosen among."""
        if is_settled or not self._goal.views or self._views is None:
            return ladder()
        effort = self._views.work / self._base
        return sorted(((effort if draws(method) else usual, method, changes) for usual, method, changes in ladder()), key=lambda step: step[0])

    def _enough(self) -> str:
        """Why an environment map is all that a reflector needs, from what its rays meet alone; "" where it is not known."""
        if self.seen.by_cameras and self.seen.share < UNSEEN:
            return "no camera sees the reflector large enough"
        if not (self.seen.planned.truth.hit.any() or self.seen.held_out.truth.hit.any()):
            return "its rays meet nothing but the sky"
        return ""

    def _is_small(self) -> bool:
        """Whether nobody would see what dear stand-ins are for."""
        return self.seen.by_cameras and self.seen.share < SMALL and not self._only

    def _leaving_out(self, method: str, changes: Changes) -> Changes:
        return changes if not self.unmet or WITHOUT not in methods.get(method).DEFAULTS else tuple(sorted({**dict(changes), WITHOUT: self.unmet}.items()))

    def _with_quads(self, one: Candidate, tried: list[Candidate]) -> tuple[str, Changes] | None:
        """The stand-in whose round things are quads where a quad is good enough; None where that is nothing new."""
        if QUADS not in methods.get(one.method).DEFAULTS:
            return None
        volumes = {p.instance for p in self._assets[one.method, one.changes, COARSER].parts if p.kind == "map"}
        keys = ((c.method, c.changes, COARSER) for c in tried)
        flat = next((key for key in keys if any(p.kind == "volume" for p in self._assets[key].parts)), None)
        if not volumes or flat is None:
            return None
        truth, named = self.seen.planned.truth, self._job.scene.named()
        quads = self._errors[flat]
        chosen = []
        for name in sorted({named[v].object_name for v in volumes if v in named} - {self.seen.reflector.object_name}):
            some = truth.object == truth.object_names.index(name) if name in truth.object_names else np.zeros(len(truth.object), bool)
            as_quad = measured(quads[some], self._goal.unit)
            if as_quad.promised <= self._goal.tolerance or as_quad.mean <= EXACT:
                chosen.append(name)
        return (one.method, tuple(sorted({**dict(one.changes), QUADS: tuple(chosen)}.items()))) if chosen else None

    def tried(self, method: str, changes: Changes, coarser: int = COARSER) -> Candidate:
        key = method, changes, coarser
        if key not in self._tried:
            errors, work = self._measured(key)
            needed = [(kind, changes if kind == method else (), coarser) for kind in methods.with_required((method,))]
            size = sum(grown(self._assets[k], coarser) for k in needed)
            seconds = sum(self._paths[k] for k in needed) / PATHS
            if draws(method) and self._views is not None:  # a row that is locked may have lost its planes
                size, seconds = size + self._views.bytes, seconds + self._views.paths / PATHS
            self._tried[key] = Candidate(method, changes, errors, work / self._base, size, seconds)
        return self._tried[key]

    def _measured(self, key: _Key) -> tuple[Measured, float]:
        """(errors, operations of a ray)."""
        method, changes, coarser = key
        own, *others = [self._asset((kind, changes if kind == method else (), coarser)) for kind in reversed(methods.with_required((method,)))]
        self._errors[key], work = shown(own.joined(*others), self.seen.planned, self._goal.unit, self._views)
        return measured(self._errors[key], self._goal.unit), work

    def _asset(self, key: _Key) -> Asset:
        if key not in self._assets:
            kind, changes, coarser = key
            asked, rays = {**self._asked(kind), **dict(changes)}, 0

            def traced(bundle, hide=(), samples=1, **more):
                nonlocal rays
                rays += len(bundle) * samples
                return self._job.trace(bundle, hide, samples, **more)

            required = {k: self._asset((k, (), coarser)) for k in methods.get(kind).REQUIRES}
            self._assets[key] = methods.get(kind).bake(replace(self._job, trace=traced, settings=coarse(asked, coarser), required=required))
            self._paths[key] = rays * coarser**2 * int(asked.get("samples", 1))
        return self._assets[key]


def _shows_itself(method: str, settings: dict[str, object]) -> bool:
    return bool(settings.get(getattr(methods.get(method), "SHOWS_ITSELF", ""), False))


def _share(sample: Sample, name: str) -> float:
    """Of the rays, those that meet the object."""
    names = sample.truth.object_names
    return float(np.mean(sample.truth.hit & (sample.truth.object == names.index(name)))) if name in names and len(sample.rays) else 0.0
