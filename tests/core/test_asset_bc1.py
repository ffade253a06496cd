"""Block-compressed images on disk: .dds files that come back equal, and every way in which one can be wrong."""

import json
import os

import numpy as np
import pytest
from spoiled_assets import refuses

from reflect_addon.core import dds
from reflect_addon.core.asset import Asset
from reflect_addon.core.asset_files import load_asset, save_asset


def blocks(seed=1, shape=(3, 5, 8)):
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)


@pytest.fixture
def folder(tmp_path):
    images = {"light_bc1": blocks(), "depth_tx": np.ones((2, 3, 4), np.float16)}
    return save_asset(Asset("light_field", "Ball", images), tmp_path / "a")


def file_of(folder):
    return next(folder.glob("light_bc1-*.dds"))


def edit(folder, **values):
    path = folder / "asset.json"
    document = json.loads(path.read_text())
    document["arrays"]["light_bc1"].update(values)
    path.write_text(json.dumps(document))


def forge(folder, change):
    """Changes the file's bytes and its checksum with them."""
    import hashlib

    data = bytearray(file_of(folder).read_bytes())
    data = change(data) or data
    file_of(folder).write_bytes(data)
    edit(folder, sha256=hashlib.sha256(data).hexdigest())


def test_round_trip(folder):
    loaded = load_asset(folder)
    np.testing.assert_array_equal(loaded.images["light_bc1"], blocks())
    assert loaded.images["light_bc1"].flags.writeable and loaded.bytes() == 3 * 5 * 8 + 2 * 3 * 8
    assert file_of(folder).read_bytes() == dds.header((3, 5, 8)) + dds.body(blocks()).tobytes()


def test_replacing_leaves_only_the_new_file(folder):
    save_asset(Asset("light_field", "Ball", {"light_bc1": blocks(2)}), folder)
    assert len(list(folder.iterdir())) == 2
    np.testing.assert_array_equal(load_asset(folder).images["light_bc1"], blocks(2))


@pytest.mark.parametrize(
    "image",
    [
        blocks().astype(np.float16),
        blocks()[..., :4],
        blocks()[0],
        blocks(shape=(0, 4, 8)),
        np.zeros((4097, 1, 8), np.uint8),
    ],
)
def test_what_are_no_blocks_is_not_written(tmp_path, image):
    with pytest.raises(ValueError, match="light_bc1"):
        save_asset(Asset("light_field", "", {"light_bc1": image}), tmp_path / "a")
    assert list(tmp_path.iterdir()) == []


def _swap(at, value):
    return lambda data: data.__setitem__(at, value)


WRONG = {
    "missing": (lambda f: file_of(f).unlink(), "missing"),
    "truncated": (lambda f: os.truncate(file_of(f), 150), "cut short"),
    "cut by a block": (lambda f: forge(f, lambda d: d[:-8]), "values"),
    "a block too many": (lambda f: forge(f, lambda d: d + bytes(8)), "values"),
    "much longer": (lambda f: os.truncate(file_of(f), 5000), "too large"),
    "flipped bit": (lambda f: file_of(f).write_bytes(file_of(f).read_bytes()[:-1] + b"\x55"), "checksum"),
    "foreign": (lambda f: forge(f, lambda d: b"GIF89a" * 41), "values"),
    "magic": (lambda f: forge(f, _swap(0, 0)), "values"),
    "another width": (lambda f: forge(f, _swap(16, 24)), "values"),
    "another format": (lambda f: forge(f, _swap(87, ord("5"))), "values"),
    "another shape": (lambda f: edit(f, shape=[5, 3, 8]), "values"),
    "large shape": (lambda f: edit(f, shape=[4096, 4096, 8]), "cut short"),
    "too large a shape": (lambda f: edit(f, shape=[4097, 4, 8]), "4096"),
    "texels for blocks": (lambda f: edit(f, shape=[12, 20, 4]), "channels"),
    "another type": (lambda f: edit(f, dtype="float16"), "type"),
    "an .npy": (lambda f: edit(f, file="light_bc1-0123456789ab.npy"), "inside the folder"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_files_get_a_sentence(folder, case):
    spoil, words = WRONG[case]
    spoil(folder)
    refuses(folder, words)
