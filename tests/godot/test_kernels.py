"""Kernels in Godot's shading language against NumPy, run by Godot."""

from functools import partial

import pytest
from godot_bench import run_godot
from kernel_agreement import methods_agree, random_programs_agree, surface_agrees

from reflect_addon.core.kernel import GODOT

pytestmark = pytest.mark.slow


@pytest.fixture
def run(tmp_path):
    return partial(run_godot, folder=tmp_path / "godot")


def test_random_programs(run, rng):
    random_programs_agree(run, GODOT, rng)


def test_every_gathering_method(run, rng):
    methods_agree(run, GODOT, rng)


def test_surface(run, rng):
    surface_agrees(run, GODOT, rng)
