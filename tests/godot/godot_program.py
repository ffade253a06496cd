"""Godot as tests run it: skipped loudly, with the reason, where there is none. tools/godot.py installs it."""

import functools
import importlib.util
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROJECT = ROOT / "reflect-godot"


@functools.cache
def tool():
    """tools/godot.py as a module, once Godot runs."""
    spec = importlib.util.spec_from_file_location("godot_tool", ROOT / "tools" / "godot.py")
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    try:
        found.program()
    except found.NoGodot as reason:
        pytest.skip(f"SKIPPED: {reason}")
    return found


def godot(*arguments, project: Path = PROJECT, fails: bool = False) -> str:
    """What Godot says. fails: it ends with status 1 rather than 0; everything else fails the test with what was said."""
    try:
        done = tool().run(project, *arguments)
    except tool().NoGodot as reason:
        pytest.skip(f"SKIPPED: {reason}")
    except subprocess.TimeoutExpired as late:
        pytest.fail(f"Godot did not end: {(late.stdout or b'')[-3000:]}")
    assert done.returncode == fails, done.stdout[-4000:]
    return done.stdout
