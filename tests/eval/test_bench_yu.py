"""evaluation/bench_yu*.py: complete rows from tiny bakes, exact counts, and a row for every target of the paper."""

import re
from pathlib import Path

import numpy as np
import pytest

from reflect_addon.core.light_field import Cell
from reflect_addon.core.rays import RayMap
from reflect_addon.evaluation import bench_yu, bench_yu_bake, bench_yu_rays, bench_yu_scene
from reflect_addon.evaluation import bench_yu_columns as room
from reflect_addon.evaluation.bench import Target

CLAIMS = {"I4-columns", "I4-columns-depth", "I4-flicker", "I4-bake", "I4-bake-one-path", "I4-peak"}
REPORTED = {"Y1-depth", "Y1-compressed", "Y2-compressed", "Y3-half", "Y4-mean", "Y4-depth"}


@pytest.fixture
def small(device, monkeypatch):
    for module, values in {
        bench_yu: {
            "PAPER": {"views": 4, "view_texels": 16, "samples": 1, "depth": "false"}, "FEW": {"views": 3, "view_texels": 16, "samples": 1},
            "SIZE": (48, 48), "LOOK": (32, 24), "JUDGED": (32, 24), "SMALL": (24, 18), "MOVED": range(1, 5), "SMOOTH": 2, "PATHS": 2, "TURNS": 1,
            "FRAMES": 1, "PASS": 1 << 14, "PASSES": 2, "ENVIRONMENT": {"resolution": 16, "samples": 1},
        },
        bench_yu_rays: {"RAYS": 20_000, "COUNTED": 4000, "VIEWS": 4, "TEXELS": 16},
        bench_yu_bake: {"TURNS": 1, "KINDS": {"I4-bake": (3, 16, 2), "I4-bake-one-path": (3, 16, 1)}},
        room: {"SCAN": 4},
    }.items():  # fmt: skip
        for name, value in values.items():
            monkeypatch.setattr(module, name, value)


def test_every_target_has_a_row(small, shared):
    rows = {row["id"]: Target(**row) for row in bench_yu.measure(lambda share, what: None)}
    wanted = set(re.findall(r"^\| (Y\d+) \|", (shared / "papers" / "targets.md").read_text(), re.M))
    assert len(wanted) == 6 and set(rows) == wanted | CLAIMS | REPORTED
    assert rows["Y4"].ours == 4 and rows["Y4"].holds
    assert rows["Y5"].ours == [0, 0] and rows["Y5"].holds
    assert len(rows["Y1"].ours) == len(rows["Y1-depth"].ours) == 4 and min(rows["Y1"].ours) > 0
    assert rows["Y3"].ours == 6 * (4 * 16) ** 2 / 2 / 2**20 == rows["Y3-half"].ours / 16
    assert 0.1 < rows["I4-peak"].ours < 2
    assert all(np.isfinite(row.ours).all() for row in rows.values())


def test_shapes_have_the_papers_faces(device):
    faces = {"sphere": 19800, "hippo": 51584, "skull": 60339}
    made = {"sphere": bench_yu_scene.bumpy(100, 100, 0.0, 1), "hippo": bench_yu_scene.bumpy(208, 125, 0.12, 3), "skull": bench_yu_scene.bumpy(267, 114, 0.06, 7)}
    for name, (points, quads) in made.items():
        triangles = sum(len(face) - 2 for face in quads)
        assert abs(triangles / faces[name] - 1) < 1e-3
        edges = {frozenset((a, b)) for face in quads for a, b in zip(face, (*face[1:], face[0]), strict=True)}
        assert len(points) - len(edges) + len(quads) == 2  # closed


def test_a_texel_that_was_not_traced_would_show(device):
    """Rays that start outside the cell read them: the row would say so."""
    from reflect_addon.core.methods import light_field
    from reflect_addon.gpu.fill import RayBundle

    cell = Cell(np.zeros(3), np.ones(3), bench_yu_rays.VIEWS, bench_yu_rays.TEXELS)
    rays = bench_yu_rays.through(Cell(np.zeros(3), np.full(3, 4.0), 4, 16), np.random.default_rng(2), 2000)
    found = RayBundle(rays).answer(bench_yu_rays.ones(cell), light_field.trace)
    assert (np.abs(found.radiance - 1).max(-1) > bench_yu_rays.ONE).mean() > 0.1


def test_tiles_keep_their_pixels_together():
    y, x = np.mgrid[:32, :40].astype(np.float32)
    place = np.stack([x, y, 0 * x], -1)
    covered = np.where((x > 5) & (y > 9), 0, -1).astype(np.int32)
    seen = RayMap(place, -place, place, covered, x, x, ("Mirror",))
    rays = bench_yu.tiles(seen, 1 << 13)
    rows = rays.origin.reshape(-1, bench_yu.BUNDLE, 3)
    assert (rays.origin == -rays.direction).all() and rows[..., 0].min() == 8 and rows[..., 1].min() == 12
    squares = rows.reshape(-1, bench_yu.TILE, bench_yu.BUNDLE // bench_yu.TILE, bench_yu.TILE, 3)
    assert (np.diff(squares[..., 0], axis=3) == 1).all() and (np.diff(squares[..., 1], axis=1) == 1).all()


def test_flicker_of_the_truth_is_1_and_noise_is_none(rng):
    """Two noisy copies of a picture that changes: their common part is what counts; a still picture does not flicker at all."""
    from types import SimpleNamespace

    from reflect_addon.core.look import Look

    mask, count = np.ones((40, 50), bool), 12
    still, wave = rng.random((2000, 3)) * 0.4 + 0.2, rng.random((2000, 3)) * 0.2

    def frames(amplitude):
        base = [still + amplitude * wave * np.sin(1.5 * t) for t in range(count)]
        return [SimpleNamespace(mask=mask, rays=b, truths=[SimpleNamespace(radiance=b + 0.02 * rng.normal(size=b.shape)) for _ in range(2)]) for b in base]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(room, "answer", lambda asset, rays: SimpleNamespace(radiance=rays))
        own, true = room.flicker(None, frames(1.0), Look())
        assert own == pytest.approx(true, rel=0.02)
        own, true = room.flicker(None, frames(0.0), Look())
        assert own == 0 and true < 0.01


def test_columns_is_asked_for(monkeypatch, tmp_path):
    from reflect_addon.core.errors import ReflectError

    monkeypatch.setattr(bench_yu_scene, "SAMPLES", Path(tmp_path))
    with pytest.raises(ReflectError, match="columns.blend"):
        bench_yu_scene.columns()
