"""scene/node_images.py and node_report.py: few data-blocks, each texel where it was, kept bit for bit, and what a group costs."""

import json
import subprocess
import sys

import numpy as np
import pytest
from node_bench import run_nodes

from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import evaluate, record_function
from reflect_addon.scene.kernel_nodes import emit_nodes
from reflect_addon.scene.node_images import MOST, image_from, images_from, keep_images
from reflect_addon.scene.node_report import describe_group, images_of

NAMES = ("a_tx", "b_tx", "c_tx", "d_buf", "e_buf", "f_buf", "g_tx")
LOAD = """
import bpy, json, sys, numpy as np
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
assert not any("reflect_addon" in name for name in sys.modules)
found = {}
for image in bpy.data.images:
    if image.size[0]:
        pixels = np.empty(image.size[0] * image.size[1] * 4, "f")
        image.pixels.foreach_get(pixels)
        np.save(sys.argv[2] + "/" + str(len(found)) + ".npy", pixels)
        found[image.name] = [len(found), image.use_half_precision, image.alpha_mode, image.colorspace_settings.name]
print("FOUND" + json.dumps(found))
"""


@pytest.fixture
def images(rng):
    """Seven images of either precision, of numbers that only float32 tells apart in the tables; alpha 0 in places."""
    shapes = [(9, 16), (5, 40), (3, 3), (2, 7), (64, 2), (4, 11), (40, 5)]
    made = {}
    for name, shape in zip(NAMES, shapes, strict=True):
        wide = rng.normal(size=(*shape, 4)) * (10.0 ** rng.uniform(-20, 20, (*shape, 4)) if name.endswith("buf") else 1.0)
        wide[0, 0, 3] = 0.0
        made[name] = wide.astype(np.float32 if name.endswith("buf") else np.float16)
    return made


def reader(images) -> Asset:
    return Asset("reader", "", images)


def group_that_reads(asset: Asset, inputs: dict[str, str]):
    """A group of all the images' texels around x, y, one output each."""

    def kernel(k, scope, x, y):
        return {name: k.fetch(scope.images[name], x, y).xyz for name in scope.images}

    return record_function(kernel, inputs, asset.images)


def test_at_most_four_data_blocks_each_of_one_precision(fresh_file, images):
    places = images_from("Some", images)
    blocks = {place.image for place in places.values()}
    assert len(blocks) == MOST
    for name, place in places.items():
        assert place.image.use_half_precision == (images[name].dtype == np.float16)
        (width, height), (x, y), (w, h) = place.image.size, place.at, place.size
        pixels = np.empty(width * height * 4, "f")
        place.image.pixels.foreach_get(pixels)
        assert np.array_equal(pixels.reshape(height, width, 4)[y : y + h, x : x + w], images[name].astype("f")), name
    apart = [images_from("Few", {n: images[n] for n in NAMES[:MOST]})[n] for n in NAMES[:MOST]]
    assert len({p.image for p in apart}) == MOST and all(p.at == (0, 0) for p in apart)


@pytest.mark.parametrize("engine", ["CYCLES", "BLENDER_EEVEE"])
def test_no_texel_of_a_neighbour(engine, fresh_file, tmp_path, rng, images):
    """Looked up all over and beyond every edge: a data-block's other images, levels and filters are never seen."""
    tables = {name: (np.arange(i.shape[0] * i.shape[1]).reshape(i.shape[:2])[..., None] % 251 + 1) for name, i in images.items()}
    asset = reader({name: (t * np.ones(4) * (n + 1)).astype(images[name].dtype) for n, (name, t) in enumerate(tables.items())})
    given = {"x": rng.uniform(-9, 60, 1024), "y": rng.uniform(-9, 80, 1024)}
    program = group_that_reads(asset, {"x": "float", "y": "float"})
    tree = emit_nodes(program, asset, "R", NAMES, unrolled=engine == "CYCLES")
    found = run_nodes(fresh_file, tmp_path, {"r": (tree, dict.fromkeys(NAMES, 3))}, given, engine)["r"]
    wanted = evaluate(program, given, asset)
    for name in NAMES:
        assert np.array_equal(found[name], wanted[name]), name


@pytest.mark.parametrize("pack", [True, False])
def test_pixels_survive_saving(pack, fresh_file, tmp_path, images):
    """Opened in a process of its own that has no add-on: bit for bit, halves half."""
    asset = reader(images)
    tree = emit_nodes(group_that_reads(asset, {"x": "float", "y": "float"}), asset, "Kept", NAMES)
    tree.use_fake_user = True
    blocks = images_of(tree)
    before = {}
    for image in blocks:
        before[image.name] = np.empty(image.size[0] * image.size[1] * 4, "f"), image.use_half_precision
        image.pixels.foreach_get(before[image.name][0])
    keep_images(tree, pack, tmp_path / "beside")
    assert len(list((tmp_path / "beside").glob("*.exr"))) == (0 if pack else len(blocks))
    fresh_file.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    command = [sys.executable, "-c", "import bpy\n" + LOAD, str(tmp_path / "kept.blend"), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert "FOUND" in done.stdout, done.stderr
    found = json.loads(done.stdout.partition("FOUND")[2].splitlines()[0])
    assert found.keys() >= before.keys() and len(before) == MOST
    for name, (pixels, half) in before.items():
        number, *kept = found[name]
        assert kept == [half, "CHANNEL_PACKED", "Non-Color"]
        assert np.array_equal(np.load(tmp_path / f"{number}.npy").view(np.uint32), pixels.view(np.uint32)), name


def test_a_folder_that_cannot_be_is_said(fresh_file, tmp_path, images):
    asset = reader({"a_tx": images["a_tx"]})
    tree = emit_nodes(group_that_reads(asset, {"x": "float", "y": "float"}), asset, "Kept", ("a_tx",))
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OSError):
        keep_images(tree, False, tmp_path / "file" / "beside")


def test_what_a_group_costs(fresh_file, rng):
    def kernel(k, scope, a):
        texel = k.fetch(scope.images["t_tx"], a, 0.0)
        return {"x": k.loop(k.min(texel.x, 8.0), (texel.y,), lambda i, t: ((t + k.sample(scope.images["u_buf"], t, i).x,), None))[0]}

    asset = Asset("a", "", {"t_tx": rng.random((3, 5, 4)).astype(np.float16), "u_buf": rng.random((8, 2, 4)).astype("f")})
    program = record_function(kernel, {"a": "float"}, asset.images)
    kept, unrolled = (describe_group(emit_nodes(program, asset, "C", ("x",), unrolled)) for unrolled in (False, True))
    assert (kept.look_ups, kept.zones, kept.images) == (5, 1, ("C t_tx", "C u_buf"))
    assert kept.megabytes == pytest.approx((15 * 8 + 16 * 16) / 1e6)
    assert not kept.cycles and unrolled.cycles
    assert kept.inlined > kept.own and kept.groups == 1  # a sample
    assert "5 image look-ups" in kept.sentence() and kept.sentence().endswith("for EEVEE")


def test_float_images_are_kept_whole(fresh_file):
    image = image_from("one", np.full((1, 1, 4), 1 + 2**-23, np.float32))
    assert image.pixels[0] == 1 + 2**-23 and not image.use_half_precision
