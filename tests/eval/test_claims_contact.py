"""Issue 3, what `contact` must show of depth maps: hit errors with one map an object and with several, self-reflection
included, measured on the committed file against Cycles."""

from pathlib import Path

import bpy
import pytest
import tolerances
from claims import measure

SAMPLE = Path(__file__).resolve().parents[2] / "sample_blends" / "contact.blend"


@pytest.mark.parametrize("maps", [1, 4])
def test_contact(maps, device, tmp_path, record_property):
    bpy.ops.wm.open_mainfile(filepath=str(SAMPLE))
    settings = {"resolution": 64, "samples": 4, "maps": maps, "points": 16}
    found = measure(("environment", "depth_maps"), tmp_path, (120, 90), 16, settings)
    errors = found.hit_errors("depth_maps")
    record_property("errors", errors)
    record_property("rmse_over_environment", found.rmse("depth_maps") / found.rmse("environment"))
    assert errors.hit_p50 <= tolerances.CONTACT_HIT_P50
    if maps > 1:
        assert errors.hit_p95 <= tolerances.CONTACT_HIT_P95
        assert errors.missed_hit + errors.false_hit <= tolerances.CONTACT_LOST
    assert found.rmse("depth_maps") < found.rmse("environment")
