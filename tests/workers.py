"""The tests in two processes (pytest-xdist, a file at a time): when, in which order, and what has the machine for itself."""

import os
from contextlib import contextmanager
from pathlib import Path

import pytest

try:
    import fcntl
except ImportError:  # Windows: one process
    fcntl = None

HERE = Path(__file__).parent
# What takes long goes first: begun last, it would leave the other process without work. These files, then these folders.
FIRST = ("blender/test_bad_models.py", "eval/test_claims_finite.py", "eval/test_claims_contact.py", "blender/test_methods_nodes.py",
         "eval/test_claims_light_field.py", "device/test_virtual_objects_drawn.py", "blender/test_bad_machines.py", "eval", "device", "blender")  # fmt: skip


def count(config) -> int:
    """Two for everything. None where a path is given: they cost seconds to start; nor where the output is wanted at once."""
    everything = config.args_source is config.ArgsSource.TESTPATHS
    return 2 if fcntl and everything and config.option.capture != "no" and (os.cpu_count() or 1) > 1 else 0


def order(items) -> None:
    """As FIRST says; within a file, and among files of one place, as they were."""

    def place(item) -> int:
        path = item.path.relative_to(HERE)
        return min((FIRST.index(name) for name in (path.as_posix(), path.parent.as_posix()) if name in FIRST), default=len(FIRST))

    items.sort(key=place)


@contextmanager
def room(alone: bool):
    """All tests share the machine, the ones marked `alone` do not: a lock that is shared or exclusive, on a file of ours.

    Who wants it waits at a turnstile, a second lock, so that nobody slips in before a test that waits to be alone.
    """
    with open(HERE / "conftest.py") as lock, open(HERE / "workers.py") as turnstile:
        fcntl.flock(turnstile, fcntl.LOCK_EX)
        fcntl.flock(lock, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        fcntl.flock(turnstile, fcntl.LOCK_UN)
        try:
            yield
        finally:
            fcntl.flock(lock, fcntl.LOCK_UN)


def is_worker(config) -> bool:
    return hasattr(config, "workerinput")


# The hooks, which conftest.py takes over.


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config):
    return count(config)


def pytest_collection_modifyitems(config, items):
    if is_worker(config):
        order(items)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item):
    """What tests record goes from process to process: anything but plain numbers and words as its text."""
    report = yield
    report.user_properties = [(name, v if type(v) in (int, float, bool, str) else repr(v)) for name, v in report.user_properties]
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    if not is_worker(item.config):
        return (yield)
    with room(item.get_closest_marker("alone") is not None):
        return (yield)
