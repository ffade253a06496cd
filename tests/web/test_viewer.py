"""The viewer page as a person uses it: opened as a file, with keys, wide and narrow, with no network."""

import json
import re

import bpy
import numpy as np
import pytest
from node_package import node

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def seen(exported, tmp_path_factory):
    """(folder of screenshots, what the page says)."""
    out = tmp_path_factory.mktemp("viewer")
    node("viewer/build.js")
    node("test/web/viewer.js", exported.folder, out, "billboards")
    return out, json.loads((out / "viewer.json").read_text())


def test_no_errors_and_no_network(seen):
    assert seen[1]["errors"] == [] and seen[1]["asked"] == [] and not seen[1]["error"]


def test_what_it_says(exported, seen):
    told = seen[1]
    assert told["name"] == "contact" and told["checked"] == "billboards"
    assert len(told["methods"]) == len(exported.methods) and all("B" in text for text in told["methods"])
    assert re.fullmatch(r"[1-9][\d.]* [KM]B", told["memory"])


def test_a_small_screen_does_not_scroll_sideways(seen):
    assert seen[1]["wide"] == 390


def test_pictures(seen):
    """Keys turn the view, the comparison shows something else, and none is empty."""
    around, turned, compare = (_pixels(seen[0] / f"{name}.png")[:, :800] for name in ("around", "turned", "compare"))
    for picture in (around, turned, compare):
        assert picture.std() > 0.1
    assert np.abs(around - turned).mean() > 0.02 and np.abs(around - compare).mean() > 0.02


def _pixels(path) -> np.ndarray:
    image = bpy.data.images.load(str(path))
    width, height = image.size
    out = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(out)
    bpy.data.images.remove(image)
    return out.reshape(height, width, 4)[..., :3]
