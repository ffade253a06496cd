"""BC1 blocks: what must be exact is, what is not stays within what 4 bits a texel cost; the code for HDR; .dds files."""

import numpy as np
import pytest
import tolerances
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from reflect_addon.core import bc1, dds, hdr_code
from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import evaluate, record_function

LEVELS = np.array([31, 63, 31])
COLOURS = hnp.arrays(np.float32, 3, elements=st.floats(0, 1, width=32))


def psnr(image, found):
    return -10 * np.log10(np.mean((image - found) ** 2))


def picture(rng, side=128):
    """Soft gradients, edges and a little noise: what a view of a room is made of."""
    y, x = np.mgrid[:side, :side] / side
    soft = np.stack([x * y, 0.3 + 0.4 * np.sin(5 * x + 3 * y), 1 - y], -1)
    walls = np.where((np.hypot(x - 0.4, y - 0.6) < 0.25)[..., None], [0.9, 0.5, 0.1], soft)
    return np.clip(walls + rng.normal(0, 0.01, (side, side, 3)), 0, 1).astype(np.float32)


def read_by_the_book(block):
    """(4, 4, 3): one block by its definition, bit by bit."""
    first, second = int(block[0]) | int(block[1]) << 8, int(block[2]) | int(block[3]) << 8
    a, b = (np.array([c >> 11, c >> 5 & 63, c & 31]) / LEVELS for c in (first, second))
    table = [a, b, (2 * a + b) / 3, (a + 2 * b) / 3] if first > second else [a, b, (a + b) / 2, 0 * a]
    bits = int.from_bytes(bytes(block[4:]), "little")
    return np.array([table[bits >> 2 * n & 3] for n in range(16)]).reshape(4, 4, 3)


def test_decode_is_the_definition(rng):
    blocks = rng.integers(0, 256, (7, 9, 8), dtype=np.uint8)
    blocks[:2, :, 2:4] = blocks[:2, :, :2]  # equal colours
    found = bc1.decode(blocks)
    assert found.shape == (28, 36, 3) and found.dtype == np.float32
    for row, column in np.ndindex(7, 9):
        part = found[4 * row : 4 * row + 4, 4 * column : 4 * column + 4]
        np.testing.assert_allclose(part, read_by_the_book(blocks[row, column]), atol=tolerances.FLOAT32)


def test_single_texels_are_those_of_the_whole(rng):
    blocks = rng.integers(0, 256, (3, 5, 8), dtype=np.uint8)
    x, y = rng.integers(0, 20, 99), rng.integers(0, 12, 99)
    np.testing.assert_array_equal(bc1.texels(blocks, x, y), bc1.decode(blocks)[y, x])
    assert bc1.texels(blocks, np.array(3), y).shape == (99, 3), "all rays in one column"


@settings(max_examples=100, deadline=None, derandomize=True)
@given(colour=COLOURS)
def test_a_constant_block_is_within_a_third_of_a_step(colour):
    found = bc1.decode(bc1.encode(np.broadcast_to(colour, (4, 4, 3))))
    assert (np.abs(found - colour) <= 0.5 / (3 * LEVELS) + tolerances.FLOAT32).all()
    assert (found == found[0, 0]).all()


@settings(max_examples=100, deadline=None, derandomize=True)
@given(first=COLOURS, second=COLOURS, mask=hnp.arrays(bool, (4, 4)))
def test_two_representable_colours_are_exact(first, second, mask):
    first, second = np.rint(first * LEVELS) / LEVELS, np.rint(second * LEVELS) / LEVELS
    block = np.where(mask[..., None], first, second)
    np.testing.assert_allclose(bc1.decode(bc1.encode(block)), block, atol=tolerances.FLOAT32)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(image=hnp.arrays(np.float32, (8, 4, 3), elements=st.floats(-2, 3, width=32)))
def test_any_values_give_blocks_of_four_colours(image):
    blocks = bc1.encode(image)
    first, second = (blocks[..., i].astype(int) | blocks[..., i + 1].astype(int) << 8 for i in (0, 2))
    assert (first >= second).all() and (blocks[first == second, 4:] == 0).all(), "never the black of the other kind"
    inside = np.clip(image, 0, 1)
    off = (bc1.decode(blocks) - inside).reshape(2, 4, 4, 3)
    spread = inside.reshape(2, 4, 4, 3) - inside.reshape(2, 16, 3).mean(1)[:, None, None]
    rounding = 16 * ((0.5 / (3 * LEVELS)) ** 2).sum() + tolerances.FLOAT32
    assert ((off**2).sum((1, 2, 3)) <= (spread**2).sum((1, 2, 3)) + rounding).all(), "worse than the texels' mean"


def test_gradients_and_a_picture(rng):
    """A grey ramp across a block has colours of its own at 5:6:5 bits; a picture is as good as encoders make it."""
    ramp = np.broadcast_to(np.linspace(0.2, 0.8, 4)[:, None], (4, 4, 3)).astype(np.float32)
    for block in (ramp, ramp.swapaxes(0, 1), 1 - ramp):
        assert np.abs(bc1.decode(bc1.encode(block)) - block).max() < tolerances.BC1_RAMP
    image = picture(rng)
    assert psnr(image, bc1.decode(bc1.encode(image))) > tolerances.BC1_PSNR


def test_pieces_do_not_show(rng, monkeypatch):
    image = picture(rng, 64)
    whole = bc1.encode(image)
    monkeypatch.setattr(bc1, "_CHUNK", 40)
    np.testing.assert_array_equal(bc1.encode(image), whole)
    np.testing.assert_array_equal(bc1.encode(image[:4, :8]), whole[:1, :2])


@pytest.mark.parametrize("shape", [(5, 4, 3), (4, 6, 3), (4, 4, 4), (0, 4, 3), (4, 4)])
def test_no_whole_blocks(shape):
    with pytest.raises(ValueError, match="whole blocks"):
        bc1.encode(np.zeros(shape, np.float32))


def test_a_larger_image_repeats_its_edges(rng):
    blocks = rng.integers(0, 256, (3, 5, 8), dtype=np.uint8)
    wide = bc1.decode(bc1.extended(blocks, 4, 8))
    np.testing.assert_array_equal(wide, np.pad(bc1.decode(blocks), ((0, 4), (0, 12), (0, 0)), "edge"))


# --- .dds


def test_a_file_is_its_blocks_turned(rng):
    blocks = rng.integers(0, 256, (3, 5, 8), dtype=np.uint8)
    data = dds.header(blocks.shape) + dds.body(blocks).tobytes()
    assert len(data) == dds.HEADER_BYTES + blocks.size and data[84:88] == b"DXT1"
    np.testing.assert_array_equal(dds.blocks(data, blocks.shape), blocks)
    upright = bc1.decode(np.frombuffer(data[128:], np.uint8).reshape(blocks.shape))
    np.testing.assert_array_equal(upright, bc1.decode(blocks)[::-1])


@pytest.mark.parametrize("wrong", ["short", "long", "magic", "format", "other shape", "empty"])
def test_what_is_no_such_file(rng, wrong):
    blocks = rng.integers(0, 256, (3, 5, 8), dtype=np.uint8)
    data, shape = bytearray(dds.header(blocks.shape) + dds.body(blocks).tobytes()), blocks.shape
    match wrong:
        case "short":
            data = data[:-1]
        case "long":
            data += b"\0"
        case "magic":
            data[0] = 0
        case "format":
            data[87] = ord("5")
        case "other shape":
            shape = (5, 3, 8)
        case "empty":
            data = b""
    assert dds.blocks(data, shape) is None


# --- the code for HDR


@settings(max_examples=200, deadline=None, derandomize=True)
@given(radiance=hnp.arrays(np.float32, (4, 4, 3), elements=st.floats(0, 7e4, width=32) | st.floats(0, 1, width=32)))
def test_the_code_keeps_every_radiance(radiance):
    uniforms = hdr_code.curve(radiance)
    code = hdr_code.encode(radiance, uniforms)
    assert code.min() >= 0 and code.max() <= 1 and all(np.isfinite(v) and v > 0 for v in uniforms.values())
    back = hdr_code.decode(np, uniforms, code)
    np.testing.assert_allclose(back, radiance, rtol=tolerances.HDR_CODE, atol=max(tolerances.HDR_CODE * uniforms["code_base"], 1e-20))
    assert (back[radiance == 0] == 0).all()


def test_a_sun_survives_its_blocks(rng):
    radiance = picture(rng)
    radiance[64:68, 32:36] = 7e4
    blocks, uniforms = hdr_code.compress(radiance)
    back = hdr_code.decode(np, uniforms, bc1.decode(blocks))
    assert back.max() == pytest.approx(7e4, rel=1e-3)
    away = np.ones((128, 128), bool)
    away[64:68, 32:36] = False
    assert np.median(np.abs(back - radiance)[away] / radiance[away].clip(0.01)) < tolerances.BC1_HDR_MEDIAN


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, -3.0])
def test_what_is_no_light_is_black(rng, bad):
    radiance = picture(rng, 16)
    radiance[4:8, 4:8] = bad
    uniforms = hdr_code.curve(radiance)
    assert (hdr_code.encode(radiance, uniforms)[4:8, 4:8] == 0).all()
    dark = np.full((4, 4, 3), bad, np.float32)
    blocks, uniforms = hdr_code.compress(dark)
    assert (hdr_code.decode(np, uniforms, bc1.decode(blocks)) == 0).all()


def test_a_kernel_decodes_as_numpy_does(rng):
    radiance = picture(rng, 32) * 50
    blocks, uniforms = hdr_code.compress(radiance)
    asset = Asset("a", "", {"light_bc1": blocks}, uniforms)

    def kernel(k, scope, at):
        return {"radiance": hdr_code.decode(k, scope.uniforms, k.fetch(scope.images["light_bc1"], at).xyz)}

    program = record_function(kernel, {"at": "vec2"}, images=("light_bc1",), uniforms=uniforms)
    y, x = np.mgrid[:32, :32]
    found = evaluate(program, {"at": np.stack([x, y], -1).reshape(-1, 2)}, asset)["radiance"].reshape(32, 32, 3)
    np.testing.assert_allclose(found, hdr_code.decode(np, uniforms, bc1.decode(blocks)), rtol=tolerances.FLOAT32)
    assert asset.bytes() == 32 * 32 // 2
