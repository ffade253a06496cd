"""core/moved_rows.py: rows that a kernel moves are those that a follower writes, and what moves together looks the same."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from baked_methods import SETTINGS, rays_of_all_kinds, same_answer, scene_of_everything
from mesh_scenes import job
from tolerances import FLOAT32
from tolerances_nodes import MOVED_ROWS, MOVED_ROWS_EDGES

from reflect_addon.core import methods, moved_rows
from reflect_addon.core.billboard_atlas import ROW, moved_row
from reflect_addon.core.depth_atlas import moved_map_row
from reflect_addon.core.kernel import record, record_function, run_numpy
from reflect_addon.core.kernel.run import evaluate
from reflect_addon.core.moved_rows import with_movers
from reflect_addon.core.rays import Rays
from reflect_addon.core.row_motion import FACES, FOLLOWS, MAP, motion_uniforms
from reflect_addon.core.spaces import STATUS_HIT

LIT = ("Torus", "Crate", "Needle")  # mirrors are Half and Block


@pytest.fixture(scope="module")
def assets():
    scene = scene_of_everything()
    return {n: m.bake(job(scene, {**m.DEFAULTS, **SETTINGS})) for n, m in ((n, methods.get(n)) for n in ("billboards", "depth_maps"))}


def motion(rng, size=1.2, turn=True):
    """Turned about an axis through the room's middle, moved and grown."""
    matrix = trimesh.transformations.random_rotation_matrix(rng.random(3)) if turn else np.eye(4)
    matrix[:3, :3] *= size
    matrix[:3, 3] = rng.uniform(-0.4, 0.4, 3)
    return matrix


def answer(asset, rays):
    return run_numpy(record(methods.get(asset.kind).trace, asset), asset, rays)


def placed(asset, moving, matrices):
    """The asset with motions of its own."""
    found, names = with_movers(asset, moving)
    uniforms = dict(found.uniforms)
    for number, name in enumerate(names):
        uniforms |= motion_uniforms(number, matrices.get(name, np.eye(4)), asset.uniforms["center"])
    return replace(found, uniforms=uniforms)


def table_moved(asset, matrices):
    """The asset with the table that a follower shows."""
    rows = asset.images["billboard_buf"].copy()
    for part in asset.parts:
        if part.row >= 0 and part.instance in matrices:
            move = moved_map_row if FOLLOWS[part.kind] == MAP else moved_row
            rows[part.row] = move(rows[part.row], matrices[part.instance], asset.uniforms["center"])
    return replace(asset, images={**asset.images, "billboard_buf": rows})


def test_nothing_moves_nothing_changes(assets):
    """What the asset has no row of, and flat things when the reflector moves, need no motion."""
    for asset in assets.values():
        assert with_movers(asset, ("Elsewhere",)) == (asset, ())
    flat = replace(assets["billboards"], parts=tuple(p for p in assets["billboards"].parts if FOLLOWS.get(p.kind) != FACES))
    own = next(p.instance for p in flat.parts if p.kind == "reflector")
    assert with_movers(flat, (own,)) == (flat, ())


@pytest.mark.parametrize("kind", ["billboards", "depth_maps"])
def test_at_rest_all_is_as_baked(assets, kind, rng):
    asset, rays = assets[kind], rays_of_all_kinds(rng, 3000)
    found = answer(placed(asset, {p.instance for p in asset.parts}, {}), rays)
    same = same_answer(found, answer(asset, rays), rays.origin, MOVED_ROWS, MOVED_ROWS)
    assert np.mean(~same) < MOVED_ROWS_EDGES


@pytest.mark.parametrize("kind", ["billboards", "depth_maps"])
def test_rows_move_as_a_follower_moves_them(assets, kind, rng):
    asset, rays = assets[kind], rays_of_all_kinds(rng, 3000)
    moving = [p.instance for p in asset.parts if p.instance in LIT and FOLLOWS[p.kind] != FACES]
    matrices = {name: motion(rng) for name in dict.fromkeys(moving)}
    assert matrices
    found, wanted = answer(placed(asset, matrices, matrices), rays), answer(table_moved(asset, matrices), rays)
    assert np.mean(~same_answer(found, wanted, rays.origin, MOVED_ROWS, MOVED_ROWS)) < MOVED_ROWS_EDGES
    moved = same_answer(found, answer(asset, rays), rays.origin, MOVED_ROWS, MOVED_ROWS)
    assert np.mean(~moved) > 0.01


@pytest.mark.parametrize("kind,turn", [("billboards", False), ("depth_maps", True)])
def test_what_moves_together_looks_the_same(assets, kind, turn, rng):
    """All stand-ins, mirrors among them, the reflector and the rays; the backdrop, which stays, of one colour."""
    asset, rays = assets[kind], rays_of_all_kinds(rng, 3000)
    grey = np.full_like(asset.images["radiance_tx"], 0.3)
    asset = replace(asset, images={**asset.images, "radiance_tx": grey})
    matrix = motion(rng, turn=turn)
    moved = Rays(
        (rays.origin @ matrix[:3, :3].T + matrix[:3, 3]).astype("f"), (rays.direction @ (matrix[:3, :3] / 1.2).T).astype("f")
    )  # fmt: skip
    names = {p.instance for p in asset.parts}
    found, wanted = answer(placed(asset, names, dict.fromkeys(names, matrix)), moved), answer(asset, rays)
    there = (wanted.position.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]).astype("f")
    met = wanted.status == STATUS_HIT
    same = np.abs(found.radiance - wanted.radiance).max(-1) < 1e-2 * np.maximum(wanted.radiance.max(-1), 0.1)
    same &= (np.abs(found.position - there).max(-1) < 1e-3) | ~met
    assert np.mean(~same) < 4 * MOVED_ROWS_EDGES, np.mean(~same)
    assert (found.status == wanted.status).mean() > 1 - 4 * MOVED_ROWS_EDGES


def test_a_volume_goes_along_and_faces_the_reflector(assets, rng):
    """Where both are now: its middle moves with the object, its normal points to the reflector's, its sides grow with it."""
    asset = assets["billboards"]
    part = next(p for p in asset.parts if p.instance == "Torus")
    own = next(p.instance for p in asset.parts if p.kind == "reflector")
    matrices = {"Torus": motion(rng), own: motion(rng, 1.0)}
    scene = placed(asset, matrices, matrices)

    def columns(k, scope, row):
        scope = moved_rows.in_motion(k, scope)
        rows = {name: k.fetch(scope.images["billboard_buf"], float(ROW[name]), row) for name in ("plane", "u", "v", "detail")}
        return {name: moved_rows.moved(k, scope, name, row, texel) for name, texel in rows.items()}

    program = record_function(columns, {"row": "float"}, scene.images, scene.uniforms, scene.options)
    found = {n: v[0].astype(np.float64) for n, v in evaluate(program, {"row": np.array([part.row])}, scene).items()}
    center = np.array(asset.uniforms["center"])
    stood, seer = (np.array(scene.uniforms[f"{name}{part.row}"]) for name in ("stands", "seer"))

    def now(name, point):
        return matrices[name][:3, :3] @ (point + center) + matrices[name][:3, 3] - center

    middle = now("Torus", stood)
    towards = now(own, seer) - middle
    assert np.allclose(found["plane"][:3], towards / np.linalg.norm(towards), atol=10 * FLOAT32)
    assert abs(found["plane"][:3] @ middle - found["plane"][3]) < 1e-5
    for name in ("u", "v"):
        assert abs(found[name][:3] @ middle + found[name][3]) < 1e-5
        before = asset.images["billboard_buf"][part.row, ROW[name], :3]
        assert np.isclose(np.linalg.norm(found[name][:3]) * 1.2, np.linalg.norm(before), rtol=1e-5)
    assert np.isclose(found["detail"][1] * 1.2, asset.images["billboard_buf"][part.row, ROW["detail"], 1], rtol=1e-5)


def test_what_is_deleted_is_met_by_no_ray(assets, rng):
    """Its driver says zeros."""
    for kind, asset in assets.items():
        found, names = with_movers(asset, LIT)
        zeros = {name: (0.0,) * 4 for number in range(len(names)) for name in (f"move{number}_{axis}" for axis in "xyz")}
        rays = rays_of_all_kinds(rng, 2000)
        gone = answer(replace(found, uniforms={**found.uniforms, **zeros}), rays)
        rows = asset.images["billboard_buf"].copy()
        for part in asset.parts:
            if part.instance in LIT:
                rows[part.row, [ROW["u"], ROW["v"]]] = 0, 0, 0, 2
                rows[part.row, ROW["ball"], 3] = 0
        wanted = answer(replace(asset, images={**asset.images, "billboard_buf": rows}), rays)
        assert np.isfinite(gone.radiance).all()
        assert np.mean(~same_answer(gone, wanted, rays.origin, MOVED_ROWS, MOVED_ROWS)) < MOVED_ROWS_EDGES, kind
