"""The asset of `virtual_objects`: pieces of any reflector, what it says of itself, and what makes it old."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from mesh_scenes import job, smooth_mirror
from virtual_scenes import among_things, ball, hollow

from reflect_addon.core.asset_files import load_asset, save_asset
from reflect_addon.core.kernel import record
from reflect_addon.core.methods import layered_distance, virtual_objects
from reflect_addon.core.remake import REFLECTOR

SETTINGS = {**virtual_objects.DEFAULTS, "map_texels": 32}


def bake(mirror, **more):
    return virtual_objects.bake(job(among_things(mirror, **more), SETTINGS))


def test_a_ball_is_one_piece_that_does_not_see_itself():
    asset = bake(ball())
    (piece,) = virtual_objects.parts_in(asset)
    assert not asset.options["sees_itself"] and virtual_objects.report(asset) == "Searched in one piece."
    assert np.linalg.norm(piece.center - [0, 0, 0.5]) < 0.5
    assert piece.start[3] == 0 and piece.block[3] == 1


def test_a_bowl_is_searched_on_both_sides():
    asset = bake(hollow())
    assert {piece.block[3] for piece in virtual_objects.parts_in(asset)} == {1.0, -1.0} and asset.options["sees_itself"]


def test_an_other_side_that_nobody_sees_is_left_out():
    """A ball with one triangle missing."""
    shape = trimesh.creation.icosphere(4, 0.5)
    shape.update_faces(np.arange(len(shape.faces)) > 0)
    assert {piece.block[3] for piece in virtual_objects.parts_in(bake(smooth_mirror(shape)))} == {1.0}


def test_a_torus_has_pieces_with_starts_of_their_own():
    pieces = virtual_objects.parts_in(bake(smooth_mirror(trimesh.creation.torus(0.5, 0.2))))
    assert 4 < len(pieces) <= virtual_objects.MOST and any(piece.start[3] == 2 for piece in pieces)
    for piece in pieces:  # the start leads to the piece
        start = piece.start[:3] / max(np.linalg.norm(piece.start[:3]), 1e-9)
        to = piece.ball[:3] - start * (piece.ball[:3] @ start)
        assert piece.start[3] == 0 or np.linalg.norm(to) <= piece.ball[3]


@pytest.mark.parametrize("shape", ["nothing", "point", "line", "triangle"])
def test_what_cannot_be_searched_falls_back(shape):
    """Bakes, says so, and its kernel answers."""
    corners = {"nothing": np.zeros((0, 3)), "point": np.zeros((3, 3)), "line": np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]]),
               "triangle": np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])}[shape]  # fmt: skip
    scene = among_things()
    mesh = replace(scene.meshes[0], positions=corners.astype("f"), triangles=np.arange(len(corners), dtype=np.int32).reshape(-1, 3),
                   corner_normals=np.zeros((len(corners) // 3, 3, 3), "f"), material_index=np.zeros(len(corners) // 3, np.int32))  # fmt: skip
    below = layered_distance.bake(job(scene, {**layered_distance.DEFAULTS, "resolution": 16, "sky_error": 0}))
    asset = virtual_objects.bake(job(replace(scene, meshes=(mesh, *scene.meshes[1:])), SETTINGS))
    assert bool(virtual_objects.parts_in(asset)) == (shape == "triangle") and ("alone" in virtual_objects.report(asset)) == (shape != "triangle")
    record(virtual_objects.trace, asset.joined(below))


def test_it_comes_back_from_disk(tmp_path):
    asset = bake(hollow())
    save_asset(asset, tmp_path / "asset")
    back = load_asset(tmp_path / "asset")
    assert back.options == asset.options and all(np.array_equal(back.images[name], asset.images[name]) for name in asset.images)


def test_what_makes_it_old():
    scene = among_things()
    mirror, torus, *_ = scene.instances
    inputs = virtual_objects.inputs(scene, (mirror,))
    moved = replace(torus, world_from_object=torus.world_from_object + np.eye(4)[:, [1, 2, 3, 0]])
    assert inputs == virtual_objects.inputs(replace(scene, instances=(mirror, moved, *scene.instances[2:])), (mirror,))
    assert inputs != virtual_objects.inputs(replace(scene, instances=scene.instances[:-1]), (mirror,))
    asset = bake(ball())
    assert virtual_objects.remark(asset, scene, mirror) == ""
    squeezed = replace(mirror, world_from_object=mirror.world_from_object @ np.diag([1, 1, 0.5, 1]))
    assert "squeezed" in virtual_objects.remark(asset, scene, squeezed)
    assert [part.kind for part in asset.parts].count("surface") == len(scene.instances) and asset.parts[0].kind == REFLECTOR
