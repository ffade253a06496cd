"""All that lies on disk for a method, read for a window: whole or damaged, of reflectors that are there or gone."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..core import methods, surface_asset
from ..core.asset import Asset
from ..core.asset_files import load_asset
from ..core.errors import ReflectError
from ..core.planning.goal import Goal
from ..core.planning.plan import Plan
from .freshness import has_settings
from .load import PLANNED, plan_in
from .properties import KEPT


@dataclass(frozen=True)
class Loaded:
    """method: whose; folder: where its assets lie."""

    method: str = "OFF"
    folder: Path = Path()
    assets: dict[tuple[str, str], Asset] = field(default_factory=dict)  # by (kind, reflector)
    surfaces: Asset | None = None  # the scene's surface radiance
    plan: Plan | None = None  # which method each reflector has, where the method is `auto`
    problems: tuple[str, ...] = ()  # what could not be read, as sentences

    def kinds(self, reflector: str) -> tuple[str, ...]:
        """Kinds of assets that show a reflector, its method's own last; () where no plan knows it."""
        method = self.method
        if method == methods.AUTO:
            row = self.plan.row_of(reflector) if self.plan else None
            method = row.method if row else None
        return methods.with_required([method]) if method in methods.names() else ()

    def is_as_asked(self, reflector: str, found: Sequence[Asset], asked: dict[str, object], by_hand: str | None) -> bool:
        """Whether a bake with these settings would make the reflector's assets, which are `found`. by_hand: properties.by_hand's, None: what a
        plan takes."""
        if self.plan is None:
            return all(has_settings(asset, asked) for asset in found)
        if by_hand == KEPT:
            return True
        row = self.plan.row_of(reflector)
        return Goal.of(asked) == self.plan.goal and (row.method == by_hand if by_hand else not row.by_hand)

    def asset(self, kind: str, reflector: str) -> Asset | None:
        """The asset for a reflector: its own, or the one of all reflectors."""
        return self.assets.get((kind, reflector)) or self.assets.get((kind, ""))


def load(method: str, folder: Path) -> Loaded:
    """folder: of the scene's assets. What is damaged is told in `problems` and left out."""
    plan, problems, surfaces, assets = None, [], None, {}
    kinds = methods.with_required([method])
    beside = getattr(methods.get(method), "COMPANIONS", ())
    if method == methods.AUTO:
        try:
            plan = plan_in(folder)
        except ReflectError as error:
            problems.append(str(error))
        folder = folder / PLANNED
        taken = {row.method for row in plan.rows} if plan else set()
        kinds = methods.with_required([name for name in methods.names() if name in taken])
    for kind in (*kinds, *beside, surface_asset.KIND):
        for path in sorted(folder.glob(f"{kind}-*")):
            try:
                asset = load_asset(path)
            except ReflectError as error:
                problems.append(str(error))
                continue
            if asset.kind == surface_asset.KIND:
                surfaces = asset
            else:
                assets[asset.kind, asset.reflector] = asset
    return Loaded(method, folder, assets, surfaces, plan, tuple(problems))
