"""Fixtures: an isolated Blender profile, a fresh file per test, real data where it is there, the GPU where it works."""

import os
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "blender")]
# Before bpy is imported: tests must never see or touch the profile of the person who runs them.
# A process beside others has its own, and must not take the one that pytest's first process made.
if "PYTEST_XDIST_WORKER" in os.environ or "BLENDER_USER_RESOURCES" not in os.environ:
    os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="reflect-profile-")

from workers import (  # noqa: E402, F401  hooks; the path is set above
    pytest_collection_modifyitems,
    pytest_runtest_makereport,
    pytest_runtest_protocol,
    pytest_xdist_auto_num_workers,
)


def pytest_terminal_summary(terminalreporter, config):
    """What pyproject.toml's -m 'not slow' left out is said loudly, with the command that runs it."""
    if count := config.stash.get(LEFT_OUT, 0):
        word = "test is" if count == 1 else "tests are"
        terminalreporter.write_sep("!", f"{count} slow {word} left out; run with: ./dev test -m slow", yellow=True)


LEFT_OUT = pytest.StashKey()


def pytest_deselected(items):
    if items and items[0].config.option.markexpr != "slow":
        slow = sum(item.get_closest_marker("slow") is not None for item in items)
        items[0].config.stash[LEFT_OUT] = items[0].config.stash.get(LEFT_OUT, 0) + slow


def pytest_sessionfinish(session):
    """Where the tests run in several processes, each has left out the same; the one that writes the end is told."""
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["left out"] = session.config.stash.get(LEFT_OUT, 0)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node):
    told = getattr(node, "workeroutput", {}).get("left out", 0)  # nothing by a process that crashed
    node.config.stash[LEFT_OUT] = max(told, node.config.stash.get(LEFT_OUT, 0))


@pytest.fixture
def rng():
    """A generator with a fixed seed: every random test is the same test every time."""
    return np.random.default_rng(20260102)


@pytest.fixture
def fresh_file():
    """An empty .blend in this process: no objects, no world, one scene with one view layer. Yields bpy."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    yield bpy


@pytest.fixture(scope="session")
def device():
    """Blender's gpu module, initialised. A machine without one fails: software OpenGL is enough and ./dev installs it."""
    import bpy  # noqa: F401  gpu needs it first
    import gpu

    gpu.init()
    return gpu


@pytest.fixture(scope="session")
def shared():
    """The folder with real models and worlds beside the checkout; tests that need it are skipped loudly without it."""
    for candidate in (os.environ.get("REFLECT_SHARED"), ROOT.parent / "shared"):
        if candidate and (Path(candidate) / "models").is_dir():
            return Path(candidate)
    pytest.skip("SKIPPED: no shared/models beside the checkout; set REFLECT_SHARED to try real data")
