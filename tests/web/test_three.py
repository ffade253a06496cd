"""What Chromium shows of an export by reflect-three against what `render` drew: the same scene, camera, assets and kernels in two programs."""

import json
import shutil

import numpy as np
import pytest
from node_package import Failed, drawn
from tolerances import WEB_BESIDE, WEB_FLIP, WEB_MOVED

from reflect_addon.core import methods as registry
from reflect_addon.evaluation.eye import flip
from reflect_addon.evaluation.png import write_png
from tools.exports.compared import compared

pytestmark = pytest.mark.slow

POSE = {"position": [3, -2, 5], "rotation": [0.4, 1.1, -0.7], "scale": 2.5}


@pytest.fixture(scope="module")
def browser(exported, tmp_path_factory):
    """(folder of what was drawn, what the page says)."""
    out = tmp_path_factory.mktemp("drawn")
    return out, drawn(exported.folder, out, exported.methods)


@pytest.mark.parametrize("method", registry.gathering())
def test_as_render_shows_it(exported, browser, method):
    out, told = browser
    pair = compared(exported.folder, out, method, exported.mask)
    write_png(out / f"{method}.png", pair.sheet())
    # Numbers can agree on a black picture: this one has a bright mirror, and shows more than the picture behind.
    assert pair.drawn[exported.mask].mean() > 0.2 and pair.drawn[exported.mask].std() > 0.05
    assert told["drawn"][method]["shown"] == method and told["drawn"][method]["error"] == 0
    assert pair.beside() < WEB_BESIDE
    assert pair.flip() <= WEB_FLIP, f"look at {out / f'{method}.png'}"


def test_nothing_is_said(browser):
    assert browser[1]["said"] == []


def test_methods_differ(exported, browser):
    """Each shows its own answer: no two are the same picture."""
    pictures = [compared(exported.folder, browser[0], method, exported.mask).drawn[exported.mask] for method in exported.methods]
    for k, one in enumerate(pictures):
        assert all(np.abs(one - other).mean() > 1e-4 for other in pictures[:k])


def test_environment_meanwhile(browser):
    """Shown before the method's own first byte is asked for; then nothing is empty, and bytes count up to what was said."""
    for name, one in browser[1]["drawn"].items():
        steps = [step for step in one["progress"] if step["method"] == name]
        assert steps[0]["shown"] == (None if name == "environment" else "environment") and steps[-1]["shown"] == name
        assert [s["loaded"] for s in steps] == sorted(s["loaded"] for s in steps) and steps[-1]["loaded"] == steps[-1]["total"] == one["size"]["download"]


def test_moved_as_a_whole(exported, browser, tmp_path):
    drawn(exported.folder, tmp_path, ("distance_map",), pose=POSE)
    still, moved = (compared(exported.folder, where, "distance_map", exported.mask) for where in (browser[0], tmp_path))
    assert flip(moved.drawn, still.drawn, exported.mask)[0] < WEB_MOVED


def test_a_picture_of_another_shape(upright, tmp_path):
    """The camera of glTF has the render settings' shape; the picture has its own."""
    drawn(upright.folder, tmp_path, upright.methods)
    assert compared(upright.folder, tmp_path, "environment", upright.mask).flip() <= WEB_FLIP


def test_a_life(browser):
    """The later of two wishes counts, three's own materials come back, and nothing stays on the graphics card."""
    life = browser[1]["life"]
    assert life["answers"] == [False, True] and life["shown"] == browser[1]["methods"][-1]
    assert life["ordinary"] and life["error"] == 0 and life["most"] > 1
    # Three keeps a table of its own for all materials of its kind.
    assert life["left"]["geometries"] == 0 and life["left"]["textures"] <= 1


@pytest.mark.parametrize("plain", (False, True), ids=("compressed on the card", "decoded in the page"))
def test_blocks(compressed, tmp_path, plain):
    """A light field of DXT1, on a graphics card that reads it and on one that does not."""
    told = drawn(compressed.folder, tmp_path, compressed.methods, plain=plain)
    assert told["drawn"]["light_field"]["error"] == 0 and told["said"] == []
    assert compared(compressed.folder, tmp_path, "light_field", compressed.mask).flip() <= WEB_FLIP


def test_a_changed_file_is_refused(exported, tmp_path):
    folder = tmp_path / "export"
    shutil.copytree(exported.folder, folder)
    manifest = json.loads((folder / "reflect.json").read_text())
    image = folder / manifest["images"][manifest["reflectors"][0]["methods"]["environment"]["samplers"]["asset_radiance_tx"]]["file"]
    data = bytearray(image.read_bytes())
    data[-1] ^= 1
    image.write_bytes(data)
    with pytest.raises(Failed, match=rf"{image.name}: sha256 is not the manifest's, so the file was changed or damaged\."):
        drawn(folder, tmp_path / "out", ("environment",))
