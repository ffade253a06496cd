"""What Godot shows of an export by reflect-godot against what `render` drew: the same scene, camera, assets and kernels in two programs."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from godot_program import PROJECT, godot
from sample_exports import Exported, exported
from tolerances import GODOT_BESIDE, GODOT_FLIP, WEB_MOVED

from reflect_addon.core import methods as registry
from reflect_addon.evaluation.eye import flip
from reflect_addon.evaluation.png import write_png
from tools.exports.compared import compared, read_png
from tools.exports.measured import RAYS

pytestmark = pytest.mark.slow

POSE = "3,-2,5,0.4,1.1,-0.7,2.5"  # place, turned about x, y and z, scaled


def draw(export: Exported, out: Path, *words) -> None:
    """Godot's pictures by each method, and sheets beside them."""
    out.mkdir(parents=True, exist_ok=True)
    godot("--", "--export", export.folder, "--method", ",".join(export.methods), "--rays", RAYS, "--out", out, *words)
    for method in export.methods:
        write_png(out / f"sheet_{method}.png", pair_of(export, out, method).sheet())


def pair_of(export: Exported, out: Path, method: str):
    return compared(export.folder, out, method, export.mask)


@pytest.fixture(scope="module")
def drawn(contact, tmp_path_factory) -> Path:
    """The folder of what was drawn."""
    out = tmp_path_factory.mktemp("drawn")
    draw(contact, out)
    return out


@pytest.mark.parametrize("method", (*registry.gathering(), registry.AUTO))
def test_as_render_shows_it(contact, drawn, method):
    pair = pair_of(contact, drawn, method)
    # Numbers can agree on a black picture: this one has a bright mirror, and shows more than the picture behind.
    assert pair.drawn[contact.mask].mean() > 0.2 and pair.drawn[contact.mask].std() > 0.05
    assert pair.beside() < GODOT_BESIDE
    assert pair.flip() <= GODOT_FLIP, f"look at {drawn / f'sheet_{method}.png'}"


def test_methods_differ(contact, drawn):
    """Each shows its own answer: no two are the same picture."""
    pictures = [pair_of(contact, drawn, method).drawn[contact.mask] for method in registry.gathering()]
    for k, one in enumerate(pictures):
        assert all(np.abs(one - other).mean() > 1e-4 for other in pictures[:k])


@pytest.mark.parametrize("name", ["columns", "teapots"])
def test_other_samples(name, tmp_path, drawable):
    made = exported(tmp_path / name, name, (*registry.gathering()[:1], registry.AUTO))
    draw(made, tmp_path / "drawn")
    for method in made.methods:
        pair = pair_of(made, tmp_path / "drawn", method)
        assert pair.beside() < GODOT_BESIDE and pair.flip() <= GODOT_FLIP, method


def test_moved_as_a_whole(contact, drawn, tmp_path):
    draw(contact, tmp_path, "--pose", POSE)
    for method in contact.methods:
        still, moved = (pair_of(contact, where, method) for where in (drawn, tmp_path))
        assert flip(moved.drawn, still.drawn, contact.mask)[0] < WEB_MOVED, method


def test_a_picture_of_another_shape(tmp_path, drawable):
    """A lens that is shifted and fitted to the picture's height, which glTF does not know."""
    lens = {"sensor_fit": "VERTICAL", "shift_x": 0.1, "shift_y": -0.05}
    made = exported(tmp_path / "upright", "contact", registry.gathering()[:1], (240, 320), lens)
    draw(made, tmp_path / "drawn")
    assert pair_of(made, tmp_path / "drawn", made.methods[0]).flip() <= GODOT_FLIP


def test_a_parallel_view(tmp_path, drawable):
    made = exported(tmp_path / "parallel", "contact", registry.gathering()[:1], lens={"type": "ORTHO", "ortho_scale": 4.0})
    draw(made, tmp_path / "drawn")
    assert pair_of(made, tmp_path / "drawn", made.methods[0]).flip() <= GODOT_FLIP


def test_blocks(tmp_path, drawable):
    """A light field of DXT1."""
    made = exported(tmp_path / "blocks", "contact", ("light_field",), compressed=True, views=4, view_texels=32)
    draw(made, tmp_path / "drawn")
    assert pair_of(made, tmp_path / "drawn", "light_field").flip() <= GODOT_FLIP


def test_an_imported_scene_needs_nothing_else(contact, drawn, tmp_path):
    """The importer's file in a project that has neither add-on nor export mirrors as the viewer does."""
    project, bare, method = Path(shutil.copytree(PROJECT, tmp_path / "project")), tmp_path / "bare", contact.methods[0]
    godot("--headless", "-s", "addons/reflect/import.gd", "--", contact.folder, method, "res://made.scn", project=project)
    bare.mkdir()
    shutil.copy(project / "made.scn", bare)
    (bare / "project.godot").write_text('config_version=5\n[rendering]\nrenderer/rendering_method="gl_compatibility"\n')
    picture = json.loads((contact.folder / "reflect.json").read_text())["pictures"][0]
    (bare / "picture.json").write_text(json.dumps(picture))
    godot("-s", Path(__file__).with_name("shot.gd"), project=bare)
    own, viewers = read_png(bare / "made.png"), pair_of(contact, drawn, method).drawn
    # The viewer sends seven rays a pixel and shows Cycles' noise behind what mirrors in part.
    assert flip(own, viewers, contact.mask)[0] < GODOT_FLIP
