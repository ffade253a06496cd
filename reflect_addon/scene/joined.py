"""A window's assets as renderers take them: each reflector's with what its method requires, drawn as is asked for now.

The same question has the same objects for an answer, so that nothing is uploaded twice.
"""

from collections.abc import Callable, Sequence

from ..core import methods
from ..core.asset import Asset
from ..core.asset_places import asset_name
from ..core.drawn_settings import drawn_with
from ..core.errors import ReflectError
from ..core.focus import refocused
from ..core.snapshot import Instance
from .load import answering
from .loaded import Loaded


class Joined:
    """Of what is loaded. asked: settings of its method and those it requires; problem(sentence) is told of assets that lack what their
    method's kernel asks for."""

    def __init__(self, loaded: Loaded, problem: Callable[[str], object]):
        self.asked: dict[str, object] = {}
        self._loaded, self._problem = loaded, problem
        self._joined: dict[tuple[int, ...], Asset | None] = {}
        self._focused: tuple[tuple, dict[str, Asset]] = ((), {})  # what `focused` was asked and answered last

    def ask(self, asked: dict[str, object]) -> None:
        """Other settings; what a bake has fixed stays as it was baked."""
        self.asked = asked
        self._joined = {key: asset and drawn_with(asset, asked) for key, asset in self._joined.items()}

    def of(self, reflectors: Sequence[Instance]) -> dict[str, Asset]:
        """By reflector, without those that are not baked."""
        if self._loaded.method in ("", "OFF"):
            return {}
        found = {}
        for reflector in reflectors:
            assets = [self._loaded.asset(kind, reflector.name) for kind in self._loaded.kinds(reflector.name)]
            if not assets or None in assets:
                continue
            beside = (self._loaded.asset(kind, reflector.name) for kind in methods.companions(self._loaded.method, self.asked))
            assets = [*[asset for asset in beside if asset is not None][:1], *assets]
            if (asset := self._join(assets)) is not None:
                found[reflector.name] = asset
        return found

    def focused(self, reflectors: Sequence[Instance], distance: float) -> dict[str, Asset]:
        """`of`, focused on a distance (core/focus.py)."""
        joined = self.of(reflectors)
        asked = (distance, *((name, id(asset)) for name, asset in joined.items()))
        if self._focused[0] != asked:
            self._focused = asked, refocused(joined, distance)
        return self._focused[1]

    def _join(self, assets: list[Asset]) -> Asset | None:
        """The last asset with the others; None where that is a problem."""
        key = tuple(id(asset) for asset in assets)
        if key not in self._joined:
            own = assets[-1]
            try:
                joined = answering(own, assets[:-1], self._loaded.folder / asset_name(own.kind, own.reflector))
                self._joined[key] = drawn_with(joined, self.asked)
            except ReflectError as error:
                self._joined[key] = None
                self._problem(str(error))
        return self._joined[key]
