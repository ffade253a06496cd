"""core/outlines.py: the lines are where the stand-ins are that the kernels look up."""

from dataclasses import replace

import mesh_scenes as meshes
import numpy as np
import pytest
import trimesh

from reflect_addon.core import methods, spaces
from reflect_addon.core.asset import Asset
from reflect_addon.core.billboard_atlas import hidden_row
from reflect_addon.core.depth_choice import views_for
from reflect_addon.core.light_field import cell_of
from reflect_addon.core.methods import billboards, box_proxy, depth_maps, environment, light_field, sphere_proxy
from reflect_addon.core.outlines import of_table

SMALL = {"resolution": 16, "texels": 16, "samples": 1, "turns": 6, "points": 4, "maps": 2, "views": 2, "view_texels": 16}


def job(scene, method, required=None):
    return meshes.job(scene, {**method.DEFAULTS, **{k: v for k, v in SMALL.items() if k in method.DEFAULTS}}, required)


@pytest.fixture(scope="module")
def near():
    """A mirror ball above a floor, a crate and a ball beside it."""
    return meshes.snapshot(
        trimesh.creation.icosphere(2, 0.5), Floor=trimesh.creation.box((4, 4, 0.01)).apply_translation([0, 0, -1]),
        Crate=trimesh.creation.box((0.5, 0.6, 0.7)).apply_translation([1.2, 0.3, 0]), Round=trimesh.creation.icosphere(2, 0.3).apply_translation([-1, 0.5, 0.2]),
    )  # fmt: skip


@pytest.fixture(scope="module")
def room():
    """A mirror ball in a closed room."""
    walls = trimesh.creation.box((4, 5, 3)).apply_translation([0.4, 0.1, 0.2])
    walls.invert()
    return meshes.snapshot(trimesh.creation.icosphere(2, 0.5), Room=walls)


def ends(found):
    return found.lines.reshape(-1, 3)


def same_points(a, b, tolerance):
    """Every point of each has one of the other beside it."""
    distance = np.linalg.norm(np.asarray(a)[:, None] - np.asarray(b)[None], axis=-1)
    return distance.min(0).max() < tolerance and distance.min(1).max() < tolerance


def corners(quad):
    u, v = quad.half_u * np.array(quad.u), quad.half_v * np.array(quad.v)
    return [quad.center + a * u + b * v for a in (-1, 1) for b in (-1, 1)]


def test_quads_lie_where_they_were_fitted(near):
    asked = job(near, billboards)
    asset = billboards.bake(asked)
    quads, _ = billboards.quads_for(asked)
    found = billboards.outlines(asset)
    assert not asset.options["ground"] and len(found.lines) == 4 * len(quads) >= 12
    assert same_points(ends(found), [corner for quad in quads for corner in corners(quad)], 1e-4)
    assert np.allclose(found.points, [asset.uniforms["center"]])


def test_a_hidden_quad_is_not_outlined(near):
    asset = billboards.bake(job(near, billboards))
    table = asset.images["billboard_buf"].copy()
    table[0] = hidden_row(table[0])
    assert len(of_table(replace(asset, images={"billboard_buf": table})).lines) == len(of_table(asset).lines) - 4


def test_depth_maps_show_their_cameras(near):
    asked = job(near, depth_maps)
    taken = []

    def choose(job, volumes):
        taken.extend(views_for(job, volumes))
        return list(taken)

    asset = depth_maps.bake(asked, choose)
    found = depth_maps.outlines(asset)
    assert taken and same_points(found.points, [asset.uniforms["center"], *(v.camera.eye for v in taken)], 1e-3)
    for view in taken:
        seen = view.camera.project(ends(found))
        at = np.abs(np.abs(seen[:, :2]) - 1).max(-1) < 1e-2
        depths = seen[at, 2]
        assert same_points(np.unique(np.round(depths, 3))[:, None], np.array([[view.camera.hither], [view.camera.yon]]), 5e-3)


def test_the_box_is_the_room(room):
    base = environment.bake(job(room, environment))
    asset = box_proxy.bake(job(room, box_proxy, {"environment": base})).joined(base)
    low, high = room.bounds([room.named()["Room"]])
    found = box_proxy.outlines(asset)
    wanted = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    assert len(found.lines) == 12 and same_points(ends(found), wanted, 0.05)
    assert np.allclose(found.points, [base.uniforms["center"]])
    ball = sphere_proxy.bake(job(room, sphere_proxy, {"environment": base})).joined(base)
    away = np.linalg.norm(ends(sphere_proxy.outlines(ball)) - base.uniforms["center"], axis=-1)
    assert np.allclose(away, ball.uniforms["sphere_radius"])


def test_what_is_open_ends_at_its_rim():
    uniforms = {f"box_{n}": tuple(v) for n, v in zip("xyz", np.eye(3))}
    uniforms |= {"box_low": (-1, -1, -1), "box_high": (1, 1, spaces.FAR), "box_rim_low": (-2 * spaces.FAR,) * 3, "box_rim_high": (2 * spaces.FAR, 2 * spaces.FAR, 0.7)}
    asset = Asset("box_proxy", "", {}, {**uniforms, "center": (0, 0, 5)}, {"walls": True})
    assert ends(box_proxy.outlines(asset)).max(0).tolist() == [1, 1, 5.7]


def test_a_cell_holds_its_reflector_and_has_its_slabs(room):
    asset = light_field.bake(job(room, light_field))
    cell, found = cell_of(asset), light_field.outlines(asset)
    assert len(found.lines) == 12 + 4 * len(cell.slabs)
    box = ends(found)[:24]
    assert np.allclose(box.min(0), cell.center - cell.half) and np.allclose(box.max(0), cell.center + cell.half)
    assert np.allclose(np.abs(ends(found)[24:] - cell.center).max(0), [cell.side(1)[1], cell.side(2)[1], cell.side(0)[1]], rtol=1e-6)


def test_who_gathers_has_outlines():
    assert all(hasattr(methods.get(name), "outlines") for name in methods.gathering())


