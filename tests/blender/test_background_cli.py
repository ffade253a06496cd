"""render --background and --focus: a picture without Cycles, or one sentence that says why not and what to do."""

import bpy
import pytest
import scenes
from test_cli import run

SMALL = ("--set", "views=2", "--set", "view_texels=16", "--set", "samples=1", "--size", "32x24")


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """A box room with a mirror ball, its camera inside, and another camera outside the cell of both."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    made = scenes.sphere_in_box_room()
    made["camera"].name = "Inside"
    other = made["camera"].copy()
    other.name, other.location = "Outside", (1.5, 2.2, 2.8)
    bpy.context.scene.collection.objects.link(other)
    path = tmp_path_factory.mktemp("background") / "room.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_a_picture_without_cycles(room, tmp_path, capfd, monkeypatch):
    from reflect_addon.evaluation import render

    monkeypatch.setattr(render, "primary", None)
    found = []
    for focus in ("0", "0.5"):
        out = tmp_path / f"{focus}.png"
        more = ("--set", "depth=false", "--focus", focus, "--out", out)
        status, said, err = run(capfd, "render", room, "--method", "light_field", "--background", "--set", "cameras=true", *SMALL, *more)
        assert status == 0 and said.strip() == str(out), err
        found.append(out.read_bytes())
    assert found[0] != found[1], "the focus changes nothing"


@pytest.mark.parametrize(
    "options, words",
    [
        (("--method", "environment", "--background"), ("environment has no background", "light_field")),
        (("--method", "environment", "--focus", "2"), ("environment has no focus", "light_field")),
        (("--method", "light_field", "--background", *SMALL[:-2]), ("in no cell", "cameras=true")),
        (
            ("--method", "light_field", "--background", "--set", "cameras=true", "--camera", "Outside", *SMALL[:-2]),
            ("in no cell", "move the camera"),
        ),
    ],
)
def test_one_sentence_says_why_not(room, tmp_path, capfd, options, words):
    status, _, err = run(capfd, "render", room, *options, "--size", "32x24", "--out", tmp_path / "none.png")
    assert status == 1 and "Traceback" not in err
    assert all(word in err.splitlines()[-1] for word in words), err
    assert not (tmp_path / "none.png").exists()


@pytest.mark.parametrize("focus", ["-1", "near", "nan", "inf"])
def test_a_focus_is_a_distance(room, tmp_path, capfd, focus):
    status, _, err = run(capfd, "render", room, "--method", "light_field", f"--focus={focus}", "--size", "8x8", "--out", tmp_path / "a.png")
    assert status == 2 and "not a distance" in err


def test_an_asset_that_was_left_is_told_of(room, tmp_path, capfd):
    """Baked for a ball that then moves out of its cell: rendered with what there is, and said."""
    folder = tmp_path / "assets"
    status, _, err = run(capfd, "bake", room, "--methods", "light_field", *SMALL[:-2], "--out", folder)
    assert status == 0, err
    scene = bpy.context.scene
    next(o for o in scene.objects if o.name == "Mirror").location.x -= 1.5
    moved = tmp_path / "moved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(moved), copy=True)
    status, _, err = run(
        capfd, "render", moved, "--method", "light_field", "--assets", folder, "--samples", 1, "--size", "16x12", "--out", tmp_path / "b.png"
    )
    assert status == 0 and "Warning: Mirror has left its light field's cell" in err, err
