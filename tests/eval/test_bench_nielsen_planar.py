"""evaluation/bench_nielsen_planar.py: rooms have the mirrors that their names say, a lamp's light is baked, rows judge growth."""

from functools import partial

import numpy as np
import pytest

from reflect_addon.core import surface_radiance
from reflect_addon.core.asset import Asset
from reflect_addon.core.mirror_planes import planes_of
from reflect_addon.core.surface_asset import meshes_of
from reflect_addon.evaluation import bench
from reflect_addon.evaluation import bench_nielsen_planar as planar
from reflect_addon.evaluation import bench_nielsen_rooms as rooms
from reflect_addon.evaluation.assets import Baked
from reflect_addon.evaluation.bench import Target
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.scene.raytrace import trace


@pytest.mark.parametrize(("build", "count", "cosine"), [(rooms.one_mirror, 1, 1), (rooms.facing, 2, -1), (rooms.angle, 2, 0)])
def test_the_mirrors_of_a_room(build, count, cosine):
    with open_frame(build(), None) as snapshot:
        planes = planes_of(snapshot)
        assert len(planes) == count and len(snapshot.lamps) == 1
        assert np.dot(planes[0].normal, planes[-1].normal) == pytest.approx(cosine, abs=1e-6)


def test_a_point_lamp_keeps_its_own_light():
    """Rays that start in a ball meet it as well: what lies behind it has to be asked beyond it."""
    scene = rooms.one_mirror()
    light = next(o for o in scene.objects if o.type == "LIGHT").data
    with open_frame(scene, None) as snapshot:
        baked = surface_radiance.bake(snapshot, partial(trace, scene=scene), snapshot.lamps, surface_radiance.DEFAULTS)
    (lamp,) = meshes_of(baked).values()
    expected = light.energy / (4 * np.pi**2 * light.shadow_soft_size**2)  # W / (m^2 sr) of a ball
    assert np.median(lamp.radiance, axis=0) == pytest.approx([expected] * 3, rel=0.02)


def test_depth_is_all_that_is_changed():
    asset = Asset("recursive", "Panel", {}, settings={"depth": 3, "endless": True, "resolution": 64})
    ending = planar.ending_at(Baked({"Panel": asset}, None), 5).assets["Panel"]
    assert ending.settings == {"depth": 5, "endless": False, "resolution": 64} and asset.settings["depth"] == 3


def test_time_may_grow_with_the_views():
    views, even = [[2, 4], [4, 4]], [[1.0, 1.9], [1.0, 1.05]]
    rows = [Target(**r) for r in planar._work(views, even)]
    assert [r.id for r in rows] == ["N-depth-views", "N-depth-time"] and all(r.holds for r in rows)
    assert rows[0].ours == [2, 4, 4, 4] and rows[1].target == [1, 2, 1, 1]
    assert not planar._work(views, [[1.0, 1.9], [1.0, 1.5]])[1]["holds"]


def test_the_paper_is_measured():
    assert planar.measure in bench.PAPERS["nielsen"]
