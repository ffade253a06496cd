"""Change Blender's data for the length of a block and leave everything as it was found."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

# (owner, attribute name, value for the length of the block)
Change = tuple[object, str, object]


@contextmanager
def attributes(changes: Iterable[Change]) -> Iterator[None]:
    """Sets attributes and puts the old values back at the end, in reverse order, also when the body raises.

    Values that already hold are not written: writing would tag their data-block as changed. When one value cannot be
    put back, the others still are, and then that error is raised.
    """
    undo: list[Change] = []
    try:
        for owner, name, value in changes:
            old = _copied(getattr(owner, name))
            if old != value:
                undo.append((owner, name, old))
                setattr(owner, name, value)
        yield
    finally:
        failures = []
        for owner, name, old in reversed(undo):
            try:
                setattr(owner, name, old)
            except (ReferenceError, AttributeError, TypeError) as error:
                failures.append(f"{name}: {error}")
        if failures:
            raise RuntimeError("could not restore " + "; ".join(failures))


def _copied(value):
    """A value that does not change with its owner: vectors and colours are views into Blender's memory."""
    return value[:] if hasattr(value, "__len__") and not isinstance(value, (str, bytes, set)) else value
