"""How long work tells how far it is, and hears that it shall stop."""

from collections.abc import Callable

from .errors import Cancelled

# progress(share done in [0, 1], what is going on) -> False to stop; anything else goes on.
Progress = Callable[[float, str], object]


def teller(progress: Progress | None, what: str) -> Callable[[float, str], None]:
    """A function that passes on, or does nothing without a listener, and raises Cancelled(what) when told to stop."""

    def say(share: float, text: str) -> None:
        if progress is not None and progress(share, text) is False:
            raise Cancelled(what)

    return say
