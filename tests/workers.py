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
# Files that take long, longest first: begun last, one would leave the other process without work. A new file may be missing.
LONG = (
    "eval/test_claims_finite.py",
    "device/test_methods_agree.py",
    "blender/test_methods_nodes.py",
    "eval/test_claims_mirrors.py",
    "eval/test_claims_rooms.py",
    "eval/test_bench_yu.py",
    "eval/test_bench_mirrors.py",
    "eval/test_claims_worlds.py",
    "eval/test_claims_samples.py",
    "eval/test_claims_contact.py",
    "eval/test_claims_light_field.py",
    "eval/test_claims_glossy.py",
    "eval/test_claims_rough.py",
    "device/test_follow.py",
    "device/test_follow_maps.py",
    "device/test_background.py",
    "device/test_virtual_objects.py",
    "blender/test_bad_machines.py",
    "blender/test_bad_assets.py",
)


def count(config) -> int:
    """Two for everything. None where a path is given: they cost seconds to start; nor where the output is wanted at once."""
    everything = config.args_source is config.ArgsSource.TESTPATHS
    return 2 if fcntl and everything and config.option.capture != "no" and (os.cpu_count() or 1) > 1 else 0


def order(items) -> None:
    """Long files first; within a file, and among the others, as they were."""
    place = {HERE / name: i for i, name in enumerate(LONG)}
    items.sort(key=lambda item: place.get(item.path, len(place)))


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


# The hooks, which conftest.py takes over. The others' hooks are missing where pytest-xdist is switched off (-n0 does not).


def pytest_xdist_auto_num_workers(config):
    return count(config)


def pytest_collection_modifyitems(config, items):
    if is_worker(config):
        order(items)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    if not is_worker(item.config):
        return (yield)
    with room(item.get_closest_marker("alone") is not None):
        return (yield)
