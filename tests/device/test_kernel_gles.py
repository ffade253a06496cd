"""Kernels as GLSL ES 3.00 in a context of their own against NumPy."""

from functools import partial

import pytest
from gles_bench import run_gles
from kernel_agreement import methods_agree, random_programs_agree, surface_agrees

from reflect_addon.core.kernel import ES_300

pytest.importorskip("moderngl", reason="SKIPPED: no moderngl; ./dev installs it")


@pytest.fixture
def run(tmp_path):
    return partial(run_gles, folder=tmp_path)


def test_random_programs(run, rng):
    random_programs_agree(run, ES_300, rng)


def test_every_gathering_method(run, rng):
    methods_agree(run, ES_300, rng)


def test_surface(run, rng):
    surface_agrees(run, ES_300, rng)
