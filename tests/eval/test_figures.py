"""`./dev figures`: one figure, tiny, from the command to the page; and what its strips are cut and put together with."""

import re

import numpy as np
import pytest

from sample_blends import scene_parts as parts
from tools.figures import __main__ as command
from tools.figures.sheet import Panel, draw
from tools.figures.studio import Studio, busiest, magnified


def test_one_figure_from_the_command_to_the_page(fresh_file, device, tmp_path, capsys):
    assert command.main(["2", "--out", str(tmp_path), "--size", "48x36", "--samples", "1", "--texels", "32"]) == 0
    page = tmp_path / "index.html"
    assert str(page) in capsys.readouterr().out
    text = page.read_text()
    files = re.findall(r"<img src='([^']+)'", text)
    assert files and all((tmp_path / name).read_bytes().startswith(b"\x89PNG") for name in files)
    assert "billboards, both" in text and "Fig 2" in text


def test_an_unknown_figure_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        command.main(["4", "--out", str(tmp_path)])
    assert stopped.value.code == 2 and "there are: 1," in capsys.readouterr().err


def test_the_truths_rays_in_the_frame_are_cycles_own_picture(fresh_file, device, tmp_path):
    """A tinted metal ball under a smooth world: reflectance by resolve, radiance by trace, against the renderer's frame."""

    def build():
        scene = parts.start("ball")
        parts.set_world(scene, (0.3, 0.5, 0.8))
        parts.sphere("Ball", 0.5, parts.mirror(colour=(0.9, 0.6, 0.3)), 64)
        parts.box("Floor", (4, 4, 0.1), (0, 0, -0.6), parts.material("Floor", (0.0, 0.0, 0.0), emission=0.0))
        parts.camera((0.0, -2.5, 0.4), (0, 0, 0), lens=40)
        return scene

    with Studio((48, 36), 1, 64, tmp_path) as studio:
        shot = studio.shot(build)
        ours, own = shot.linear(shot.truth)[shot.mask], shot.frame.combined[shot.mask]
        inner = np.abs(ours - own).max(-1)
        assert np.quantile(inner, 0.9) < 0.01, "all but the outline, where the frame's rays pass"
        half = shot.linear(shot.truth, half_distance=1.0)[shot.mask]
        assert half.max() < 1e-6, "the sky is too far away to be seen through attenuation, the floor is black"


def test_the_busiest_window_is_found(rng):
    marked = rng.random((20, 30)) < 0.2
    x, y, w, h = busiest(marked, (7, 5))
    counts = [marked[j : j + 5, i : i + 7].sum() for j in range(16) for i in range(24)]
    assert (w, h) == (7, 5) and marked[y : y + h, x : x + w].sum() == max(counts)


def test_a_window_is_magnified_in_whole_squares(rng):
    picture = rng.random((10, 10, 3))
    large = magnified(picture, (2, 3, 4, 2), (16, 8))
    assert large.shape == (8, 16, 3)
    assert np.array_equal(large[::4, ::4], picture[3:5, 2:6][::-1])


def test_a_sheet_is_the_same_each_time_and_has_room_for_plots():
    panels = [Panel("a", np.zeros((8, 8, 3))), Panel("b", lambda axes: axes.plot([0, 1]), "a line")]
    first = draw([panels, [None, panels[0]]], (40, 30), "words")
    assert first == draw([panels, [None, panels[0]]], (40, 30), "words")
