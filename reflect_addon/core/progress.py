"""How long work tells how far it is, and hears that it shall stop."""

import time
from collections.abc import Callable

from .errors import Cancelled

# progress(share done in [0, 1], what is going on) -> False to stop; anything else goes on.
Progress = Callable[[float, str], object]
FIRST_GUESS = 0.02  # share of a work from which the time that is left is said


def teller(progress: Progress | None, what: str) -> Callable[[float, str], None]:
    """A function that passes on, or does nothing without a listener, and raises Cancelled(what) when told to stop. What it passes on never goes back: a
    bake that traces more than it foresaw stands still for a while."""
    furthest = 0.0

    def say(share: float, text: str) -> None:
        nonlocal furthest
        furthest = max(furthest, share)
        if progress is not None and progress(furthest, text) is False:
            raise Cancelled(what)

    return say


class Stages:
    """How far one asset's bake is: bakes that say which share of them the next trace is get the time that is left, too."""

    def __init__(self, say: Callable[[float, str], None]):
        self._say, self._began = say, time.perf_counter()
        self._low, self._high, self._text = 0.0, 1.0, ""

    def set(self, low: float, high: float, text: str) -> None:
        self._low, self._high, self._text = low, high, text
        self.tell(0.0)

    def tell(self, share: float) -> None:
        """share: of the present stage."""
        share = self._low + (self._high - self._low) * share
        left = ""
        if self._text and share > FIRST_GUESS:
            left = f", about {(time.perf_counter() - self._began) * (1 / share - 1):.0f} s left"
        self._say(share, (f": {self._text}" if self._text else "") + left)
