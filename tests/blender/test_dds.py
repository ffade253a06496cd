"""Our .dds files read by a decoder that is not ours, and as an image of shader nodes."""

import numpy as np
import pytest
from tolerances import BC1_TEXEL, HALF

from reflect_addon.core import bc1, dds


@pytest.mark.parametrize("shape", [(4, 8, 8), (3, 5, 8), (1, 1, 8)])
def test_openimageio_reads_what_we_write(fresh_file, tmp_path, rng, shape):
    fresh_file.utils.expose_bundled_modules()
    import OpenImageIO

    blocks = rng.integers(0, 256, shape, dtype=np.uint8)
    path = tmp_path / "a.dds"
    path.write_bytes(dds.header(shape) + dds.body(blocks).tobytes())
    found = OpenImageIO.ImageBuf(str(path)).get_pixels(OpenImageIO.FLOAT)
    assert np.abs(found[::-1, :, :3] - bc1.decode(blocks)).max() < BC1_TEXEL


def test_nodes_get_the_texels(fresh_file, rng):
    from reflect_addon.scene.node_images import images_from

    blocks = bc1.encode(rng.random((12, 20, 3), np.float32))
    image = images_from("group", {"light_bc1": blocks})["light_bc1"].image
    assert tuple(image.size) == (20, 12) and image.use_half_precision
    pixels = np.array(image.pixels[:], np.float32).reshape(12, 20, 4)
    np.testing.assert_allclose(pixels[..., :3], bc1.decode(blocks), rtol=HALF, atol=1e-7)
    assert (pixels[..., 3] == 1).all()
