"""Godot as tests run it: skipped loudly, with the reason, where there is none. tools/godot.py installs it."""

import functools
import subprocess
from pathlib import Path

import pytest

from tools import godot as tool
from tools.exports.measured import PROJECT


@functools.cache
def need_godot() -> None:
    """Skips where none runs."""
    try:
        tool.program()
    except tool.NoGodot as reason:
        pytest.skip(f"SKIPPED: {reason}")


def godot(*arguments, project: Path = PROJECT, fails: bool = False) -> str:
    """What Godot says. fails: it ends with status 1 rather than 0; everything else fails the test with what was said."""
    need_godot()
    try:
        done = tool.run(project, *arguments)
    except tool.NoGodot as reason:
        pytest.skip(f"SKIPPED: {reason}")
    except subprocess.TimeoutExpired as late:
        pytest.fail(f"Godot did not end: {(late.stdout or b'')[-3000:]}")
    assert done.returncode == fails, done.stdout[-4000:]
    return done.stdout
