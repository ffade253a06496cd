"""gpu/srdm_build.py: the device's tables are the reference's, bit by bit, for every kind of map."""

import numpy as np
import pytest
import trimesh
from mesh_scenes import depth_map

from reflect_addon.core import srdm, srdm_greedy
from reflect_addon.core.errors import ReflectError


def reference(depth, n, m):
    return srdm_greedy.simplify(srdm.with_spans(srdm.rotated_rows(depth, n), m), m).reshape(n, len(depth), m, 2)


def maps(w, rng):
    """name -> (w, w) float32 depth map."""
    y, x = np.mgrid[:w, :w] / w
    full = rng.random((w, w)).astype(np.float32)
    none = np.full((w, w), np.nan, np.float32)

    def where(kept, depth=full):
        return np.where(kept, depth, np.float32(np.nan)).astype(np.float32)

    return {
        "noise": full,
        "levels": np.float32(rng.integers(0, 4, (w, w)) / 3),  # ties everywhere
        "flat": np.full((w, w), 1.0, np.float32),
        "extremes": np.float32((np.arange(w)[None] // 3 + np.arange(w)[:, None]) % 2),  # the largest errors there are
        "holes": where(rng.random((w, w)) < 0.9),
        "half gone": where(rng.random((w, w)) < 0.5),  # more spans than are kept
        "single texels": where(rng.random((w, w)) < 0.03),
        "one texel": where((x == 0.25) & (y == 0.5)),
        "thin lines": where((np.arange(w)[None] + 2 * np.arange(w)[:, None]) % 7 == 0),
        "smooth": where((x - 0.5) ** 2 + (y - 0.5) ** 2 < 0.2, 0.5 + 0.4 * np.sin(9 * x) * np.cos(7 * y)),
        "empty": none,
    }


def same(a, b):
    return np.array_equal(a.view(np.uint32), b.view(np.uint32))


@pytest.mark.parametrize("w", [16, 33, 100, 256])
def test_tables_are_the_references(w, device, rng):
    from reflect_addon.gpu.srdm_build import build

    turns = {16: 60, 33: 18, 100: 5, 256: 2}[w]
    for name, depth in maps(w, rng).items():
        for n in (1, turns):
            for m in (2, 3, 8, 16, 64):
                assert same(build(depth, n, m), reference(depth, n, m)), (name, n, m)


def test_the_largest_map(device, rng):
    """Errors fill their 32 bits there."""
    from reflect_addon.gpu.srdm_build import build

    for name in ("extremes", "holes"):
        depth = maps(srdm.MAX_SIDE, rng)[name]
        assert same(build(depth, 1, 5), reference(depth, 1, 5)), name
    step = np.zeros((srdm.MAX_SIDE, srdm.MAX_SIDE), np.float32)
    step[:, 1:-1] = 1  # as far from the chord as can be, over the whole row
    assert same(build(step, 2, 3), reference(step, 2, 3))


def test_the_bunnys_tables(device, shared):
    from reflect_addon.gpu.srdm_build import build

    mesh = trimesh.load(shared / "models" / "stanford-bunny.obj", force="mesh")
    depth, _, _ = depth_map(mesh, 256)
    for m in (8, 16):
        assert same(build(depth, 60, m), reference(depth, 60, m)), m


def test_a_table_in_a_larger_texture(device, rng):
    """Several maps in one texture, several tables in one atlas, made again without a read-back; the rest stays."""
    from reflect_addon.gpu.counts import Counts
    from reflect_addon.gpu.srdm_build import Builder, upload
    from reflect_addon.gpu.upload import read_texture

    counts = Counts()
    w, n, m = 32, 4, 7
    first, second = maps(w, rng)["holes"], maps(w, rng)["smooth"]
    depth_buf = upload(np.block([[first, second], [second, first]]), counts)
    builder = Builder(w, n, m, counts)
    width, height = builder.size
    assert builder.size == srdm.packed(reference(first, n, m)).shape[1::-1]
    atlas = device.types.GPUTexture((width + 9, 2 * height + 5), format="RGBA32F")
    atlas.clear(format="FLOAT", value=(7, 7, 7, 7))
    for _ in range(2):
        builder.build(depth_buf, atlas, table_at=(3, 2))
        builder.build(depth_buf, atlas, depth_at=(w, 0), table_at=(3, 2 + height))
    assert counts.readbacks == 0
    got = read_texture(atlas, counts)
    for y, depth in ((2, first), (2 + height, second)):
        assert same(np.ascontiguousarray(got[y : y + height, 3 : 3 + width]), srdm.packed(reference(depth, n, m)))
        got[y : y + height, 3 : 3 + width] = 7
    assert np.all(got == 7)


def test_half_size_tables(device, rng):
    """The driver rounds q to halves: to one of the two beside it, so at most a whole step of halves below 1."""
    from reflect_addon.gpu.counts import Counts
    from reflect_addon.gpu.srdm_build import Builder, upload
    from reflect_addon.gpu.upload import read_texture

    counts = Counts()
    depth = maps(64, rng)["holes"]
    builder = Builder(64, 6, 8, counts, half=True)
    texture = builder.texture()
    builder.build(upload(depth, counts), texture)
    got, want = read_texture(texture, counts), srdm.packed(reference(depth, 6, 8))
    assert np.array_equal(got[..., 0::2], want[..., 0::2])
    assert np.abs(got[..., 1::2] - want[..., 1::2]).max() <= 2.0**-11


def test_a_texture_of_another_format_is_refused(device, rng):
    from reflect_addon.gpu.counts import Counts
    from reflect_addon.gpu.srdm_build import Builder, upload

    counts = Counts()
    half, full = Builder(16, 1, 2, counts, half=True), Builder(16, 1, 2, counts)
    with pytest.raises(ValueError, match="'table_img' is RGBA16F, the texture RGBA32F"):
        half.build(upload(maps(16, rng)["noise"], counts), full.texture())


def test_a_map_that_is_too_large_is_a_sentence(device):
    from reflect_addon.gpu.srdm_build import build

    with pytest.raises(ReflectError, match="1025 texels a side"):
        build(np.zeros((1025, 1025), np.float32), 1, 8)
