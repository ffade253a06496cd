"""CONTRIBUTING, "Adding a method": one module and one line. A toy method goes all the way without any other change."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from analytic import directions
from mesh_scenes import snapshot, tracer
from trimesh.creation import box, icosphere

from reflect_addon.core import methods, spaces
from reflect_addon.core.asset import Asset, half_with_scale
from reflect_addon.core.errors import ReflectError
from reflect_addon.core.kernel import Hit, record, run_numpy
from reflect_addon.core.rays import Rays

SOURCE = Path(__file__).resolve().parents[2] / "reflect_addon"


def bake(job) -> Asset:
    """Six rays from the reflector's centre along the axes; `gain` is a setting."""
    axes = np.concatenate([np.eye(3), -np.eye(3)]).astype("f")
    start = np.broadcast_to(job.center().astype("f"), axes.shape).copy()
    found = job.trace(Rays(start, axes), hide=(job.reflector.object_name,), samples=int(job.settings["samples"]))
    image = np.ones((2, 3, 4), np.float32)
    half, scale = half_with_scale(found.radiance)
    image[..., :3] = half.reshape(2, 3, 3)
    required = job.required["environment"]
    assert required.kind == "environment"
    return Asset(
        "toy", job.reflector.name, {"ambient_tx": image.astype(np.float16)},
        {"ambient_scale": scale * float(job.settings["gain"])}, settings=dict(job.settings), requires=("environment",),
    )  # fmt: skip


def trace(k, asset, ray) -> Hit:
    """The ambient cube [McTaggart 2004]: three of six colours, weighted by the squares of the direction."""
    weight = ray.direction * ray.direction
    image, colour = asset.images["ambient_tx"], k.vec3(0.0)
    for axis, letter in enumerate("xyz"):
        row = k.select(getattr(ray.direction, letter) < 0.0, 1.0, 0.0)
        colour = colour + k.fetch(image, float(axis), row).xyz * getattr(weight, letter)
    sky = ray.origin + ray.direction * spaces.FAR
    return Hit(colour * asset.uniforms["ambient_scale"], sky, 1.0, spaces.STATUS_HIT)


@pytest.fixture
def toy():
    """The toy method, registered for one test."""
    method = SimpleNamespace(
        NAME="toy", LABEL="Toy", REQUIRES=("environment",), DEFAULTS={"samples": 1, "gain": 2.0, "resolution": 4},
        bake=bake, trace=trace, __doc__="`toy`: six colours. For the tests.",
    )  # fmt: skip
    methods.register(method)
    yield method
    methods.unregister("toy")
    assert "toy" not in methods.names()


@pytest.fixture
def baked(toy, tmp_path):
    """(snapshot, folder, the asset as it comes back from disk)."""
    from reflect_addon.scene.bake import bake_assets
    from reflect_addon.scene.load import load_assets

    scene = snapshot(icosphere(2, 0.5), Crate=box((1, 1, 1)).apply_translation([2, 0, 0]))
    paths = bake_assets(scene, ["toy"], tmp_path, settings={"resolution": 4, "gain": 3.0}, tracer=tracer(scene))
    assert [p.name for p in paths] == ["environment-Mirror", "toy-Mirror"]
    return scene, tmp_path, load_assets(scene, "toy", tmp_path)["Mirror"]


def wanted(scene, rays) -> np.ndarray:
    """The ambient cube by hand, three times as bright."""
    axes = np.concatenate([np.eye(3), -np.eye(3)]).astype("f")
    six = tracer(scene)(Rays(np.zeros((6, 3), "f"), axes), hide=("Mirror",)).radiance
    weight, side = rays.direction.astype(float) ** 2, (rays.direction < 0) * 3 + np.arange(3)
    return 3.0 * np.einsum("na,nac->nc", weight, six[side])


def test_it_bakes_loads_and_answers(baked, rng):
    scene, folder, asset = baked
    assert asset.settings["gain"] == 3.0 and {"ambient_tx", "radiance_tx"} <= asset.images.keys()
    d = directions(rng, 500).astype("f")
    rays = Rays(d, d)
    found = run_numpy(record(trace, asset), asset, rays)
    np.testing.assert_allclose(found.radiance, wanted(scene, rays), rtol=1e-3)


def test_it_is_drawn(device, baked, rng):
    from reflect_addon.gpu.fill import trace_rays

    scene, _, asset = baked
    d = directions(rng, 500).astype("f")
    np.testing.assert_allclose(trace_rays(asset, trace, Rays(d, d), 0.0, 0.0).radiance, wanted(scene, Rays(d, d)), rtol=1e-3)


def test_the_command_line_knows_it(toy, fresh_file, tmp_path, monkeypatch, capsys):
    """`--methods all` bakes it."""
    from reflect_addon import cli
    from reflect_addon.scene import bake as baking

    blend = tmp_path / "empty.blend"
    fresh_file.ops.wm.save_as_mainfile(filepath=str(blend))
    asked = []
    monkeypatch.setattr(baking, "bake_assets", lambda scene, wanted, *more, **given: asked.append(tuple(wanted)) or [])
    assert cli.main(["bake", str(blend), "--methods", "all", "--out", str(tmp_path / "assets")]) == 0
    assert asked == [methods.names()] and "toy" in asked[0]
    assert "toy" in methods.with_required(("toy",)) and methods.with_required(("toy",))[0] == "environment"


def test_the_panel_lists_it(toy, fresh_file):
    from reflect_addon.ui import settings

    listed = {item[0]: item for item in settings.method_items(None, None)}
    assert listed["toy"][1:3] == ("Toy", "Six colours. For the tests")
    assert len({item[3] for item in listed.values()}) == len(listed), "numbers are stored in files: each its own"


def test_a_name_is_taken_once_and_an_unknown_one_is_explained(toy):
    with pytest.raises(ValueError, match="toy exists already"):
        methods.register(toy)
    with pytest.raises(ReflectError, match="no method named 'ploy'"):
        methods.get("ploy")


def test_nothing_outside_its_module_names_a_method():
    """The promise itself: beside the registry no module of the package spells a gather method's name, except where
    one method builds upon another and where the papers' benches choose theirs."""
    allowed = {"core/methods", "evaluation"}
    for path in SOURCE.rglob("*.py"):
        inside = path.relative_to(SOURCE).as_posix()
        if not any(inside.startswith(a) for a in allowed):
            text = path.read_text()
            for name in ("sphere_proxy", "box_proxy", "distance_map", "layered_distance", "billboards"):
                assert f'"{name}"' not in text, f"{inside} names {name}"
