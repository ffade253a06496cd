"""What docs/export-format.md says is enough: a reader that knows the page alone gets the same arrays, numbers and answers."""

import numpy as np
import pytest
import tolerances
from analytic import directions
from gles_bench import Job, run_gles
from page_reader import Page
from small_export import baked, look, read_everything, write

from reflect_addon.core import bc1, methods
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.rays import Rays

COUNT = 4000


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    return write(tmp_path_factory.mktemp("page") / "export")


@pytest.fixture(scope="module")
def page(saved):
    return Page(saved)


def own_assets() -> dict:
    """kind -> the asset alone."""
    return {asset.kind: asset.alone or asset for asset in baked()[1].values()}


def test_arrays_and_uniforms_are_the_same_to_the_bit(page):
    seen = set()
    for entry in page.bakes["assets"].values():
        asset = own_assets()[entry["kind"]]
        assert entry["uniforms"] == {k: list(v) if isinstance(v, tuple) else v for k, v in asset.uniforms.items()}
        assert entry["images"].keys() == asset.images.keys()
        for name, key in entry["images"].items():
            found, image = page.image(key), asset.images[name]
            if image.dtype == np.uint8:
                y, x = np.indices(found.shape[:2])
                np.testing.assert_allclose(found[..., :3], bc1.texels(image, x, y), atol=1e-6)
            else:
                assert found.dtype == image.dtype and found.tobytes() == np.ascontiguousarray(image).tobytes()
            seen.add(name.rpartition("_")[2])
    assert seen == {"tx", "bc1"}


def test_tables_of_floats_come_back_to_the_bit(tmp_path, rng):
    """Any finite float: addresses, the largest, what is not normal, both zeros."""
    from dataclasses import replace

    _, assets = baked()
    texels = rng.integers(0, 2**32, (7, 5, 4), dtype=np.uint32).view("f")
    texels[~np.isfinite(texels)] = -0.0
    halves = rng.integers(0, 2**16, (6, 3, 4)).astype(np.uint16).view(np.float16)
    halves[~np.isfinite(halves)] = 0
    made = replace(assets["environment"], images={**assets["environment"].images, "random_buf": texels, "random_tx": halves}, alone=None)
    folder = write(tmp_path / "export", {"environment": made})
    (entry,) = Page(folder).bakes["assets"].values()
    assert Page(folder).image(entry["images"]["random_buf"]).tobytes() == texels.tobytes()
    assert Page(folder).image(entry["images"]["random_tx"]).tobytes() == halves.tobytes()
    (back,) = read_everything(folder).values()
    assert back.images["random_buf"].tobytes() == texels.tobytes() and back.images["random_tx"].tobytes() == halves.tobytes()


def test_answers_are_those_of_the_assets(page, rng, tmp_path):
    """The page's kernels, samplers and slots in GLSL ES, the asset's own in NumPy."""
    pytest.importorskip("moderngl", reason="SKIPPED: no moderngl; ./dev installs it")
    out = directions(rng, COUNT)
    rays = Rays((np.array([0.3, -0.2, 0.1]) + 0.5 * out).astype("f"), out.astype("f"))
    width, spread = np.full(COUNT, 0.01, "f"), rng.choice([0.0, 0.05, 0.5], COUNT).astype("f")
    inputs = {"origin": rays.origin, "direction": rays.direction, "width": width, "spread": spread}
    _, assets = baked()
    jobs = []
    for method in assets:
        source, samplers, slots = page.program(0, method)
        jobs.append(Job(source, inputs, {"radiance": "vec3", "coverage": "float"}, {k: np.ascontiguousarray(v) for k, v in samplers.items()}, slots))
    for (method, asset), got in zip(assets.items(), run_gles(jobs, tmp_path)):
        wanted = run_numpy(record(methods.get(method).trace, asset), asset, rays, width, spread)
        for field in ("radiance", "coverage"):
            want = getattr(wanted, field)
            off = np.abs(got[field] - want) > tolerances.KERNEL_RADIANCE_RELATIVE * np.maximum(np.abs(want), 1e-3)
            assert off.reshape(COUNT, -1).any(1).mean() <= tolerances.EXPORT_COARSE_BRINKS, (method, field)


def test_the_look_is_the_scenes(page, rng):
    radiance = np.exp2(rng.uniform(-12, 8, (500, 3)))
    np.testing.assert_allclose(page.shown(radiance), look().apply(radiance), atol=tolerances.EXPORT_LOOK)


def test_nodes_stand_where_reflectors_stand(page):
    scene, _ = baked()
    place = np.array(page.node(0)["matrix"]).reshape(4, 4).T[:3, 3]
    x, y, z = place
    np.testing.assert_allclose([x, -z, y], scene.named()["Mirror"].world_from_object[:3, 3], atol=1e-6)
    material = page.manifest["materials"][page.manifest["reflectors"][0]["materials"][0]]
    assert material["name"] == "mirror" and material["metallic"] == 1.0


def test_what_is_read_is_what_was_baked(saved):
    for asset in read_everything(saved).values():
        own = own_assets()[asset.kind]
        assert asset.uniforms == own.uniforms and asset.options == own.options and asset.requires == own.requires
        assert asset.images.keys() == own.images.keys()
        for name, image in own.images.items():
            assert asset.images[name].dtype == image.dtype and asset.images[name].flags.writeable
            np.testing.assert_array_equal(asset.images[name], image)
