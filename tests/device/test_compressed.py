"""BC1 blocks on the GPU: every texel where it belongs, the file's data untouched, and the same picture without BC1."""

import numpy as np
import pytest
from glsl_bench import run_glsl
from tolerances import BC1_TEXEL

from reflect_addon.core import bc1
from reflect_addon.core.asset import Asset
from reflect_addon.core.errors import ReflectError
from reflect_addon.core.kernel import KernelError, emit_glsl, evaluate, record_function
from reflect_addon.gpu import compressed, upload
from reflect_addon.gpu.counts import Counts
from reflect_addon.gpu.texture_cache import TextureCache


def look_ups(device, blocks, monkeypatch, counts):
    """{fetch, sample: (GLSL's, NumPy's)} at every texel and beyond the edges."""
    import glsl_bench

    def texture(_gpu, pixels, plain=glsl_bench.texture):
        return upload.texture_from("light_bc1", pixels, counts) if pixels.dtype == np.uint8 else plain(_gpu, pixels)

    monkeypatch.setattr(glsl_bench, "texture", texture)
    asset = Asset("a", "", {"light_bc1": blocks})

    def kernel(k, scope, at):
        image = scope.images["light_bc1"]
        return {"texel": k.fetch(image, at).xyz, "mixed": k.sample(image, at.x + 0.3, at.y + 0.7).xyz}

    program = record_function(kernel, {"at": "vec2"}, images=("light_bc1",))
    x, y = np.meshgrid(np.arange(-2, 4 * blocks.shape[1] + 40), np.arange(-2, 4 * blocks.shape[0] + 40))
    given = {"at": np.stack([x, y], -1).reshape(-1, 2).astype("f")}
    (got,) = run_glsl(device, [emit_glsl(program, ("texel", "mixed"), "look")], given, [asset])
    want = evaluate(program, given, asset)
    return {name: (got[name], want[name]) for name in want}, given["at"]


def names(data):
    return {prop.identifier: len(getattr(data, prop.identifier)) for prop in data.bl_rna.properties if prop.type == "COLLECTION"}


@pytest.mark.parametrize("shape", [(16, 32, 8), (6, 9, 8), (1, 1, 8)])
def test_every_texel_is_where_the_array_has_it(device, fresh_file, monkeypatch, rng, shape):
    blocks, counts = rng.integers(0, 256, shape, dtype=np.uint8), Counts()
    before, dirty = names(fresh_file.data), fresh_file.data.is_dirty
    found, at = look_ups(device, blocks, monkeypatch, counts)
    for got, want in found.values():
        assert np.abs(got - want).max() < BC1_TEXEL
    inside = ((at >= 0) & (at < [4 * shape[1], 4 * shape[0]])).all(1)
    assert np.abs(found["texel"][0][inside].reshape(4 * shape[0], 4 * shape[1], 3) - bc1.decode(blocks)).max() < BC1_TEXEL
    assert names(fresh_file.data) == before and fresh_file.data.is_dirty == dirty
    rows, columns = (1 << (n - 1).bit_length() for n in shape[:2])
    assert (counts.uploads, counts.upload_bytes) == (1, 8 * rows * columns), "it is compressed here, 4 bits a texel"


def test_without_bc1_the_picture_is_the_same(device, fresh_file, monkeypatch, rng):
    """Blender refuses sides that are no powers of two, as it does all where the driver lacks BC1."""
    monkeypatch.setattr(compressed, "_power", lambda count: count)
    blocks, counts = rng.integers(0, 256, (5, 7, 8), dtype=np.uint8), Counts()
    found, _ = look_ups(device, blocks, monkeypatch, counts)
    for got, want in found.values():
        assert np.abs(got - want).max() < BC1_TEXEL
    assert counts.upload_bytes == 20 * 28 * 16 // 3, "RGBA8 with its levels"


def test_the_cache_counts_and_lets_go(device, fresh_file, rng):
    blocks = rng.integers(0, 256, (4, 6, 8), dtype=np.uint8)
    cache = TextureCache(Counts())
    texture = cache.texture("light_bc1", blocks)
    assert texture.format == compressed.FORMAT and cache.texture("light_bc1", blocks) is texture
    assert cache.bytes() == 4 * 8 * 8
    cache.keep_only(())
    assert cache.bytes() == 0 and len(fresh_file.data.images) == 0


def test_what_cannot_be_is_refused(device, monkeypatch, tmp_path):
    with pytest.raises(ReflectError, match="no blocks"):
        upload.texture_from("light_bc1", np.zeros((4, 4, 4), np.float16), Counts())
    monkeypatch.setattr(upload, "max_texture_side", lambda: 16)
    with pytest.raises(ReflectError, match="32 x 4"):
        upload.texture_from("light_bc1", np.zeros((1, 5, 8), np.uint8), Counts())
    with pytest.raises(KernelError, match="asset.options"):
        record_function(lambda k, s: {"x": s.images["light_bc1"].size.x}, {}, images=("light_bc1",))


def test_a_full_disk_is_a_sentence(device, fresh_file, monkeypatch, tmp_path):
    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(compressed.dds, "body", fail)
    monkeypatch.setattr(compressed.tempfile, "tempdir", str(tmp_path))
    with pytest.raises(ReflectError, match="No space left"):
        upload.texture_from("light_bc1", np.zeros((4, 4, 8), np.uint8), Counts())
    assert list(tmp_path.iterdir()) == [] and len(fresh_file.data.images) == 0
