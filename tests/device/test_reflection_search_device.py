"""Both searches for reflection points in GLSL and in NumPy: the same pairs, the same answers."""

from types import SimpleNamespace

import analytic_reflectors as shapes
import numpy as np
import pytest
import tolerances
from glsl_bench import run_glsl

from reflect_addon.core import reflection_search as search
from reflect_addon.core import virtual_status as status
from reflect_addon.core.kernel import emit_glsl, evaluate, record_function
from reflect_addon.core.reflector_map import IMAGES, atlas
from reflect_addon.evaluation import known_reflectors as known

COUNT = 10_000  # of each reflector


@pytest.mark.parametrize("kernel, share", [(search.newton, 1.0), (search.midpoint, 0.999)])
def test_glsl_finds_what_numpy_finds(device, rng, kernel, share):
    """Pairs around a sphere, an ellipsoid and an open paraboloid in one atlas: lit, hidden and beyond the rim."""
    made = [known.map_of(reflector, 64) for reflector in (shapes.ROUND["sphere"], shapes.ROUND["ellipsoid"], shapes.OPEN["paraboloid"])]
    images, blocks = atlas(made)
    asset = SimpleNamespace(images=images, uniforms={})
    options = {"steps": 24, "tolerance": search.TOLERANCE}
    program = record_function(kernel, search.INPUTS, IMAGES, options=options, name="reflection_point")
    eye, vertex = (np.pad(p, ((0, 0), (0, 1)), constant_values=1) for p in known.random_pairs(rng, COUNT * len(blocks)))
    count = len(eye)
    given = {
        "observer": eye, "vertex": vertex, "start": np.zeros((count, 4)), "block": np.repeat([(*b, 1.0) for b in blocks], COUNT, 0),
        "ball": np.tile((0, 0, 0, 1.0), (count, 1)), "cone": np.tile((0, 0, 1.0, -1.0), (count, 1)),
    }  # fmt: skip
    given = {name: values.astype(np.float32) for name, values in given.items()}
    (got,) = run_glsl(device, [emit_glsl(program, ("point", "status"), "reflection_point")], given, [asset])
    want = evaluate(program, given, asset)
    # Two float32 runs may differ where one differs from float64 already.
    exact = evaluate(program, given, asset, dtype=np.float64)
    same = got["status"] == want["status"]
    assert same.mean() >= tolerances.SEARCH_STATUS_GPU
    found = same & np.isin(want["status"], (status.CONVERGED, status.HIDDEN))
    stable = found & (np.abs(want["point"] - exact["point"])[:, :3].max(-1) < tolerances.SEARCH_POINT_GPU / 3)
    assert stable.sum() >= 0.95 * found.sum() and found.sum() > COUNT
    # midpoint's steps grow and shrink at thresholds: where rounding decides one, the run ends elsewhere within its tolerance.
    near = np.abs(got["point"] - want["point"])[stable, :3].max(-1) <= tolerances.SEARCH_POINT_GPU
    assert near.mean() >= share
