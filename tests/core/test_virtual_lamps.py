"""core/virtual_lamps.py and the light of lamps in core/surface_radiance.py: shapes, and their own light without what is behind."""

import numpy as np
import pytest
from lamp_scenes import LIGHT, lit_scene, lit_tracer

from reflect_addon.core import surface_radiance, virtual_lamps
from reflect_addon.core.surface_asset import meshes_of

SCENE = lit_scene()


@pytest.fixture(scope="module")
def meshes():
    settings = {**surface_radiance.DEFAULTS, "surface_samples": 1}
    return meshes_of(surface_radiance.bake(SCENE, lit_tracer(SCENE), (*SCENE.instances[1:], *SCENE.lamps), settings))


def test_a_lamp_has_its_own_light_alone(meshes):
    for name, light in LIGHT.items():
        assert np.allclose(meshes[name].radiance, light, atol=1e-5), name


def test_a_lamp_shines_on_one_side(meshes):
    assert all((meshes[name].side == 1).all() for name in LIGHT)


def test_rows_lead_to_the_unit_shapes(meshes):
    rows = virtual_lamps.lamp_rows(SCENE, meshes).astype(np.float64)
    assert [row[virtual_lamps.CENTER, 3] for row in rows] == [virtual_lamps.RECTANGLE, virtual_lamps.ELLIPSE, virtual_lamps.BALL]
    for row, lamp in zip(rows, SCENE.lamps, strict=True):
        unit = (SCENE.world_positions(lamp) - row[0, :3]) @ row[1:4, :3].T
        flat = row[0, 3] != virtual_lamps.BALL
        assert np.abs(unit[:, 2]).max() < 1e-6 if flat else np.allclose(np.linalg.norm(unit, axis=1), 1, atol=1e-5)
        if flat:
            assert np.allclose(np.abs(unit[:, :2]).max(0), 1, atol=1e-5)
            above = (row[0, :3] + 0.1 * np.linalg.inv(row[1:4, :3])[:, 2] - row[0, :3]) @ row[1:4, :3].T
            assert np.allclose(above, [0, 0, 0.1])
        assert np.allclose(row[virtual_lamps.RADIANCE, :3], LIGHT[lamp.name], atol=1e-5)


def test_lamps_without_surfaces_or_size_are_left_out(meshes):
    assert virtual_lamps.lamp_rows(SCENE, {}).shape == (0, virtual_lamps.TEXELS, 4)
