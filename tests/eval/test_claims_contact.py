"""Issue 3, what `contact` and scenes like it must show of depth maps: hit errors with one map an object and with several,
self-reflection and further orders included, measured on the committed file and on two small scenes against Cycles.

By default bakes have one path a texel, so that all tests of the file share what was traced; the issue's number is slow with more, and so is what
is said of it twice: of coarser maps, and of those that are as fast as `layered_distance`."""

from pathlib import Path

import bpy
import pytest
import tolerances
from claims import Remembered, measure

from sample_blends import scene_parts as parts

SAMPLE = Path(__file__).resolve().parents[2] / "sample_blends" / "contact.blend"
FAST = {"order": 2, "refine": False}


@pytest.fixture(scope="module")
def contact(device, tmp_path_factory):
    """claims.measure of the file: what was traced and baked for one test serves the next."""
    folder, tracer = tmp_path_factory.mktemp("contact"), Remembered()

    def measured(methods, size, samples, settings):
        bpy.ops.wm.open_mainfile(filepath=str(SAMPLE))
        return measure(methods, folder, size, samples, settings, tracer=tracer)

    return measured


@pytest.mark.parametrize("maps", [1, pytest.param(4, marks=pytest.mark.slow)])
def test_contact(maps, contact, record_property):
    settings = {"resolution": 64, "samples": 1, "maps": maps, "points": 16}
    methods = ("environment", "depth_maps", *(["layered_distance"] if maps > 1 else []))
    found = contact(methods, (120, 90), 16, settings)
    errors = found.hit_errors("depth_maps")
    record_property("errors", errors)
    record_property("rmse_over_environment", found.rmse("depth_maps") / found.rmse("environment"))
    assert errors.hit_p50 <= tolerances.CONTACT_HIT_P50
    if maps > 1:
        assert errors.hit_p95 <= tolerances.CONTACT_HIT_P95
        assert errors.missed_hit + errors.false_hit <= tolerances.CONTACT_LOST
        assert found.rmse("depth_maps") < found.rmse("layered_distance")
        assert found.rmse("depth_maps") < tolerances.CONTACT_SELF_RMSE * found.rmse("environment")
    assert found.rmse("depth_maps") < found.rmse("environment")


@pytest.mark.parametrize("samples, paths", [(1, 16), pytest.param(8, 32, marks=pytest.mark.slow)])
@pytest.mark.parametrize("settings", [{}, pytest.param(FAST, marks=pytest.mark.slow)], ids=["defaults", "fast"])
def test_contact_has_a_fifth_of_the_error_of_an_environment(settings, samples, paths, contact, record_property):
    """The issue's number, from the file's own camera: with the defaults, and with what is as fast as `layered_distance`."""
    found = contact(("environment", "layered_distance", "depth_maps"), (160, 120), paths, {"samples": samples, **settings})
    rmse = {method: found.rmse(method) for method in found.answers}
    record_property("rmse", rmse)
    errors = found.hit_errors("depth_maps")
    assert rmse["depth_maps"] < tolerances.CONTACT_RMSE * rmse["environment"]
    assert rmse["depth_maps"] < rmse["layered_distance"]
    assert errors.hit_p95 <= tolerances.CONTACT_HIT_P95
    assert errors.missed_hit + errors.false_hit <= tolerances.CONTACT_LOST


def ring():
    """A mirror ring with a matt ball that touches it inside: its inner side sees itself all around."""
    scene = parts.start("ring")
    parts.set_world(scene, (0.35, 0.45, 0.6), 0.6)
    parts.box("Ground", (6, 6, 0.1), (0, 0, -0.05), parts.checker("Ground", (0.7, 0.66, 0.6), (0.35, 0.3, 0.28), 0.5))
    bpy.ops.mesh.primitive_torus_add(major_radius=0.8, minor_radius=0.25, major_segments=96, minor_segments=48, location=(0, 0, 0.25))
    torus = bpy.context.object
    torus.name = torus.data.name = "Ring"
    torus.data.polygons.foreach_set("use_smooth", [True] * len(torus.data.polygons))
    torus.data.materials.append(parts.mirror())
    parts.sphere("Ball", 0.3, parts.material("Terracotta", (0.75, 0.26, 0.12)), 48, location=(-0.25, 0, 0.3))
    parts.lamp("Key", (1.5, -2.0, 3.0), (0, 0, 0.3), 120, 1.5, (1.0, 0.93, 0.82))
    parts.camera((0.2, -3.0, 2.2), (0, 0, 0.2), lens=45)


def two_balls():
    """Two mirror balls that touch each other and the floor, below a lamp."""
    scene = parts.start("two balls")
    parts.set_world(scene, (0.35, 0.45, 0.6), 0.6)
    parts.box("Ground", (6, 6, 0.1), (0, 0, -0.05), parts.checker("Ground", (0.7, 0.66, 0.6), (0.35, 0.3, 0.28), 0.5))
    for name, x in (("Left", -0.5), ("Right", 0.5)):
        parts.sphere(name, 0.5, parts.mirror(name), 64, location=(x, 0, 0.5))
    parts.lamp("Key", (0.5, -1.5, 3.0), (0, 0, 0.5), 120, 1.2, (1.0, 0.93, 0.82))
    parts.camera((0.2, -3.2, 1.6), (0, 0, 0.5), lens=45)


@pytest.mark.parametrize("build", [ring, pytest.param(two_balls, marks=pytest.mark.slow)])
def test_scenes_like_it(build, device, tmp_path, record_property):
    build()
    settings = {"resolution": 64, "samples": 4, "texels": 128}
    found = measure(("environment", "layered_distance", "depth_maps"), tmp_path, (96, 72), 16, settings)
    errors = found.hit_errors("depth_maps")
    rmse = {method: found.rmse(method) for method in found.answers}
    record_property("errors", errors)
    record_property("rmse", rmse)
    assert errors.hit_p95 <= tolerances.CONTACT_HIT_P95
    assert errors.missed_hit + errors.false_hit <= tolerances.CONTACT_LOST
    assert rmse["depth_maps"] < rmse["layered_distance"]
    assert rmse["depth_maps"] < tolerances.CONTACT_RMSE * rmse["environment"]
