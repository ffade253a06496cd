"""The view transform's table against OpenColorIO itself."""

import os

import numpy as np
import pytest

from reflect_addon.core.look import Look, axis_from_linear, linear_from_axis
from tests import tolerances


def colours(rng):
    """Greys over 16 stops and saturated colours over 12, scene-linear."""
    grey = np.repeat(np.exp2(np.linspace(-10, 6, 200))[:, None], 3, 1)
    colour = rng.random((4000, 3)) * np.exp2(rng.uniform(-8, 4, (4000, 1)))
    return np.concatenate([[[0, 0, 0]], grey, colour]).astype(np.float32)


def ocio(bpy, view, look, rgb):
    bpy.utils.expose_bundled_modules()
    import PyOpenColorIO as ocio_module

    path = os.path.join(bpy.utils.resource_path("LOCAL"), "datafiles/colormanagement/config.ocio")
    config = ocio_module.Config.CreateFromFile(path)
    transform = ocio_module.DisplayViewTransform(src="scene_linear", display="sRGB", view=view)
    pipeline = ocio_module.LegacyViewingPipeline()
    pipeline.setDisplayViewTransform(transform)
    if look != "None":
        pipeline.setLooksOverrideEnabled(True)
        pipeline.setLooksOverride(look)
    out = np.ascontiguousarray(rgb, np.float32).copy()
    pipeline.getProcessor(config, config.getCurrentContext()).getDefaultCPUProcessor().applyRGB(out)
    return np.clip(out, 0, 1)


def test_axis_round_trip(rng):
    x = np.exp2(rng.uniform(-12, 7, 1000))
    assert np.allclose(linear_from_axis(axis_from_linear(x)), x, rtol=1e-9)


@pytest.mark.parametrize("view", ["AgX", "Filmic", "Standard"])
@pytest.mark.parametrize("exposure", [-2.0, 0.0, 2.0])
def test_against_opencolorio(fresh_file, rng, view, exposure):
    from reflect_addon.scene.look import read_look

    scene = fresh_file.context.scene
    scene.view_settings.view_transform = view
    scene.view_settings.exposure = exposure
    rgb = colours(rng)
    error = np.abs(read_look(scene).apply(rgb) - ocio(fresh_file, view, "None", rgb * 2.0**exposure))
    print(view, exposure, "max", error.max(), "mean", error.mean())
    limit_max, limit_mean = tolerances.LOOK_STANDARD if view == "Standard" else tolerances.LOOK_TABLE
    assert error.max() <= limit_max and error.mean() <= limit_mean


def test_look_gamma_and_curves_are_in_the_table(fresh_file):
    from reflect_addon.scene.look import look_signature, read_look

    scene = fresh_file.context.scene
    view = scene.view_settings
    view.view_transform = "AgX"
    plain = read_look(scene)
    grey = np.full((1, 3), 0.18, np.float32)
    view.gamma = 2.0
    assert np.allclose(read_look(scene).apply(grey), plain.apply(grey) ** 0.5, atol=2e-3)
    view.gamma = 1.0
    view.look = "AgX - High Contrast"
    looked = read_look(scene)
    assert np.abs(looked.apply(grey * 0.2) - ocio(fresh_file, "AgX", view.look, grey * 0.2)).max() <= 3e-3
    assert np.abs(looked.apply(grey * 0.2) - plain.apply(grey * 0.2)).max() > 0.02
    view.look = "None"
    view.use_curve_mapping = True
    before = look_signature(scene)
    view.curve_mapping.curves[3].points[1].location = (1.0, 0.5)
    view.curve_mapping.update()
    assert look_signature(scene) != before
    assert np.abs(read_look(scene).apply(grey) - plain.apply(grey)).max() > 0.02


def test_reading_leaves_the_file_alone(fresh_file):
    from reflect_addon.scene.look import read_look

    scene = fresh_file.context.scene
    scene.view_settings.view_transform = "Filmic"
    before = sorted(x.name for x in [*fresh_file.data.scenes, *fresh_file.data.images])
    first = read_look(scene)
    scene.view_settings.exposure = 1.5
    again = read_look(scene, first)
    assert again.table is first.table and again.exposure == 1.5
    assert before == sorted(x.name for x in [*fresh_file.data.scenes, *fresh_file.data.images])
    assert scene.render.image_settings.color_depth == "8"


def test_standard_needs_no_table():
    assert Look().table is None
    assert np.allclose(Look(exposure=1.0).apply(np.array([[0.25, 0.5, 7.0]])), [[0.7353569, 1.0, 1.0]], atol=1e-5)
