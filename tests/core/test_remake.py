"""core/remake.py: every single kind of change in a scene of several reflectors gives exactly the stand-ins to make again."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from mesh_scenes import job, snapshot

from reflect_addon.core.asset import Asset, Part
from reflect_addon.core.methods import billboards
from reflect_addon.core.remake import RULES, is_rigid, part_of, parts_of, remake_set

FLAT, ROUND, MIRRORS = ("Floor", "Crate"), ("Torus", "Cone", "Rock"), ("Mirror", "Second", "Third")


def at(shape, *place):
    return shape.apply_translation(place)


@pytest.fixture(scope="module")
def scene():
    """Three mirror balls, a floor and a crate (flat), a torus, a cone and a rock (volumes)."""
    ball = lambda *place: at(trimesh.creation.icosphere(2, 0.4), *place)  # noqa: E731
    found = snapshot(
        ball(0, 0, 0.5), Second=ball(2, 0, 0.5), Third=ball(0, 2, 0.5),
        Floor=at(trimesh.creation.box((8, 8, 0.01)), 0, 0, 0),
        Crate=at(trimesh.creation.box((0.5, 0.6, 0.7)), -1.5, 1, 0.35),
        Torus=at(trimesh.creation.torus(0.4, 0.15), 1, 1, 0.5),
        Cone=at(trimesh.creation.cone(0.3, 0.8, sections=128), -1, -1, 0.1),
        Rock=at(trimesh.creation.icosphere(3, 0.3), 1, -1.5, 0.3),
    )  # fmt: skip
    instances = tuple(replace(i, is_reflector=i.name in MIRRORS) for i in found.instances)
    return replace(found, instances=instances, light_hash="day", geometry_hash="g")


@pytest.fixture(scope="module")
def assets(scene):
    """By reflector, as the method's own bake writes them."""
    settings = {**billboards.DEFAULTS, "resolution": 4, "samples": 1, "texels": 4, "sky_error": 0}
    return {r.name: billboards.bake(replace(job(scene, settings), reflector=r)) for r in scene.reflectors()}


def change(scene, name, matrix=None, mesh=None):
    """The scene with one instance placed or shaped anew."""
    index = next(k for k, i in enumerate(scene.instances) if i.name == name)
    instance = scene.instances[index]
    meshes = scene.meshes
    if matrix is not None:
        instance = replace(instance, world_from_object=matrix @ instance.world_from_object)
    if mesh is not None:
        meshes = tuple(mesh(m) if k == instance.mesh else m for k, m in enumerate(meshes))
    return replace(scene, meshes=meshes, instances=(*scene.instances[:index], instance, *scene.instances[index + 1 :]))


def turn(rng):
    matrix = trimesh.transformations.random_rotation_matrix(rng.random(3))
    matrix[:3, 3] = rng.uniform(-0.3, 0.3, 3)
    return matrix


def bent(mesh):
    return replace(mesh, positions=(mesh.positions * np.float32(1.1) + np.sin(mesh.positions)).astype("f"))


def squeezed():
    return np.diag([1.0, 1.0, 0.6, 1.0])


def names(parts):
    return {p.instance for p in parts}


def sets(assets, scene):
    """{reflector: (names re-made, names moved, names gone)}"""
    return {r: tuple(map(names, (m.remade, m.moved, m.gone))) for r, m in ((r, remake_set(a, scene)) for r, a in assets.items())}


def others(reflector):
    """All volumes that a reflector sees: the other mirrors too."""
    return set(ROUND) | set(MIRRORS) - {reflector}


NOTHING = (set(), set(), set())


def test_a_bake_remembers_what_its_rows_stand_for(assets, scene):
    for reflector, asset in assets.items():
        own, *rows = asset.parts
        assert (own.instance, own.kind, own.row) == (reflector, "reflector", -1)
        assert [p.row for p in rows] == list(range(len(asset.images["billboard_buf"]))) and asset.light_hash == "day"
        assert names(p for p in rows if p.kind in {"volume", "mirror"}) == others(reflector)
        assert names(p for p in rows if p.kind == "flat") == set(FLAT)
        for part in rows:
            np.testing.assert_array_equal(part.matrix(), scene.named()[part.instance].world_from_object)


def test_nothing_changed(assets, scene):
    """Nor does another frame, the camera (which is not in a snapshot at all), or the meshes' order in memory."""
    same = replace(scene, frame=7, geometry_hash="other", meshes=tuple(replace(m) for m in scene.meshes))
    assert all(found == NOTHING for found in sets(assets, same).values())


@pytest.mark.parametrize("name", ROUND)
def test_a_volume_that_moves_is_made_again_for_every_reflector(assets, scene, rng, name):
    assert sets(assets, change(scene, name, turn(rng))) == {r: ({name}, set(), set()) for r in MIRRORS}


@pytest.mark.parametrize("name", FLAT)
def test_flat_things_that_move_take_their_quads_along(assets, scene, rng, name):
    assert sets(assets, change(scene, name, turn(rng))) == {r: (set(), {name}, set()) for r in MIRRORS}
    grown = change(scene, name, np.diag([1.5, 1.5, 1.5, 1.0]))
    assert sets(assets, grown) == {r: (set(), {name}, set()) for r in MIRRORS}


@pytest.mark.parametrize("name", MIRRORS)
@pytest.mark.parametrize("how", ["moves", "deforms"])
def test_a_reflector(assets, scene, rng, name, how):
    """All its volumes; of the other reflectors' only the quad that stands for it."""
    changed = change(scene, name, turn(rng)) if how == "moves" else change(scene, name, mesh=bent)
    wanted = {r: (others(r) if r == name else {name}, set(), set()) for r in MIRRORS}
    assert sets(assets, changed) == wanted


@pytest.mark.parametrize("name", [*FLAT, *ROUND])
@pytest.mark.parametrize("how", ["bent", "squeezed", "mirrored"])
def test_what_deforms_is_made_again(assets, scene, name, how):
    matrix = {"squeezed": squeezed(), "mirrored": np.diag([-1.0, 1, 1, 1])}.get(how)
    changed = change(scene, name, matrix, bent if how == "bent" else None)
    assert sets(assets, changed) == {r: ({name}, set(), set()) for r in MIRRORS}


def test_light_makes_everything_again(assets, scene):
    found = sets(assets, replace(scene, light_hash="night"))
    assert found == {r: (others(r) | set(FLAT), set(), set()) for r in MIRRORS}


@pytest.mark.parametrize("name", [FLAT[0], ROUND[0], MIRRORS[1]])
def test_what_is_hidden_is_gone(assets, scene, name):
    hidden = replace(scene, instances=tuple(i for i in scene.instances if i.name != name))
    assert sets(assets, hidden) == {r: NOTHING if r == name else (set(), set(), {name}) for r in MIRRORS}


def test_two_changes_at_once_are_the_union(assets, scene, rng):
    changed = change(change(change(scene, "Floor", turn(rng)), "Torus", turn(rng)), "Second", turn(rng))
    found = sets(assets, changed)
    assert found["Mirror"] == ({"Torus", "Second"}, {"Floor"}, set())
    assert found["Second"] == (others("Second"), {"Floor"}, set())


def test_a_rounding_is_no_motion(assets, scene):
    tiny = np.eye(4)
    tiny[0, 3] = 1e-8
    assert all(found == NOTHING for found in sets(assets, change(scene, "Torus", tiny)).values())


@pytest.mark.parametrize("kind", ["map", "surface"])
def test_maps_are_only_placed_anew(scene, rng, kind):
    asset = Asset("depth_maps", "Mirror", {}, parts=parts_of(scene, scene.instances[0], [("Torus", kind)]), light_hash="day")
    assert remake_set(asset, change(scene, "Torus", turn(rng))).moved == asset.parts[1:]
    for nothing in (scene, change(scene, "Mirror", turn(rng)), change(scene, "Mirror", mesh=bent)):
        assert remake_set(asset, nothing) == type(remake_set(asset, scene))()
    assert remake_set(asset, change(scene, "Torus", mesh=bent)).remade == asset.parts[1:]


@pytest.mark.parametrize("kind", ["flat_mirror", "mirror_map"])
def test_mirrors_whose_normals_are_the_worlds_are_made_again_when_they_turn(scene, rng, kind):
    """But not when the reflector that shows them moves: they stay where their object is."""
    asset = Asset("depth_maps", "Mirror", {}, parts=parts_of(scene, scene.instances[0], [("Second", kind)]), light_hash="day")
    for changed in (change(scene, "Second", turn(rng)), change(scene, "Second", mesh=bent)):
        assert remake_set(asset, changed).remade == asset.parts[1:]
    for nothing in (scene, change(scene, "Mirror", turn(rng)), change(scene, "Mirror", mesh=bent)):
        assert remake_set(asset, nothing) == type(remake_set(asset, scene))()


def test_impossible_parts_do_no_harm(assets, scene):
    """Whatever asset.json may say within its rules: a place of zeros, a kind of another version."""
    asset = assets["Mirror"]
    own, first, *rest = asset.parts
    odd = replace(asset, parts=(own, replace(first, world_from_object=(0.0,) * 16), *(replace(p, kind="cloud") for p in rest)))
    found = remake_set(odd, scene)
    assert [p.row for p in found.remade] == [first.row] and not found.moved and not found.gone


def test_an_asset_without_parts_knows_nothing(scene):
    found = remake_set(Asset("billboards", "Mirror", {}), scene)
    assert not (found.remade or found.moved or found.gone)


def test_rigid_motions(rng):
    for _ in range(20):
        matrix = turn(rng)
        assert is_rigid(matrix) and is_rigid(matrix @ np.diag([3, 3, 3, 1.0])) and is_rigid(matrix @ np.diag([1e-3] * 3 + [1]))
        assert not is_rigid(matrix @ squeezed()) and not is_rigid(matrix @ np.diag([-1.0, 1, 1, 1]))
    assert not is_rigid(np.zeros((4, 4)))


def test_parts_are_exact(scene):
    part = part_of(scene, scene.instances[4], "flat", 3)
    assert isinstance(part, Part) and part.kind in RULES and len(part.world_from_object) == 16
