"""Node groups whose stand-ins follow their objects: by drivers that any Blender evaluates, to where NumPy's motions put them."""

from dataclasses import replace

import bpy
import numpy as np
import pytest
import tolerances
import tolerances_nodes
import trimesh
from baked_methods import SETTINGS, rays_of_all_kinds, same_answer, scene_of_everything, turned
from blender_dump import dump
from mathutils import Matrix
from mesh_scenes import job, snapshot
from native_scene import ball, principled, snapshot_of
from node_bench import run_nodes

from reflect_addon.core import methods
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.moved_rows import with_movers
from reflect_addon.core.rays import Answer
from reflect_addon.core.row_motion import motion_uniforms
from reflect_addon.scene import properties
from reflect_addon.scene.kernel_nodes import emit_nodes
from reflect_addon.scene.native_follow import following, may_move, moving_objects
from reflect_addon.scene.native_materials import remove_from_materials, use_in_materials
from reflect_addon.scene.node_report import groups_of

RAYS = 1024
OUTPUTS = {"radiance": 3, "coverage": 1, "status": 1}


def baked(kind: str, scene):
    method = methods.get(kind)
    return method.bake(job(scene, {**method.DEFAULTS, **SETTINGS}))


def lit_scene():
    """A crate and a torus before a mirror ball: no mirrors in mirrors, a small shader."""
    crate, torus = trimesh.creation.box((0.9, 0.8, 0.7)), trimesh.creation.torus(0.5, 0.2)
    return snapshot(trimesh.creation.icosphere(2, 0.5), Crate=turned(crate, [-1.5, 1.0, -0.2]), Torus=turned(torus, [1.4, 0.3, 0.2]))


@pytest.fixture(scope="module")
def billboards():
    return baked("billboards", lit_scene())


def placed(asset, *moving: str) -> None:
    """Empties of the parts' names where those were; `moving` children of one that goes up, turns and grows until frame 11."""
    scene = bpy.context.scene
    carrier = empty("Carrier")
    for frame in (1, 11):
        scene.frame_set(frame)
        carrier.location, carrier.rotation_euler = (0, 0, 0.03 * (frame - 1)), (0, 0, 0.05 * (frame - 1))
        carrier.scale = (1 + 0.01 * (frame - 1),) * 3
        for path in ("location", "rotation_euler", "scale"):
            carrier.keyframe_insert(path, frame=frame)
    scene.frame_set(1)
    for name in dict.fromkeys(p.instance for p in asset.parts):
        obj = empty(name)
        obj.parent = carrier if name in moving else None
        obj.matrix_basis = Matrix(next(p for p in asset.parts if p.instance == name).matrix().tolist())
    bpy.context.view_layer.update()


def empty(name: str):
    obj = bpy.data.objects.new(name, None)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def shown_by(*trees) -> None:
    """A thing of the scene whose material uses the groups: others are not evaluated."""
    thing = ball("Shows", principled("Shows"))
    for tree in trees:
        thing.material_slots[0].material.node_tree.nodes.new("ShaderNodeGroup").node_tree = tree


def at_frame(asset, follower, names: tuple[str, ...]):
    """The follower's asset with motions as the objects are now."""
    uniforms = dict(follower.uniforms)
    for number, name in enumerate(names):
        baked = next(p for p in asset.parts if p.instance == name).matrix()
        now = np.array(bpy.data.objects[name].matrix_world, np.float64)
        uniforms |= motion_uniforms(number, now @ np.linalg.inv(baked), asset.uniforms["center"])
    return replace(follower, uniforms=uniforms)


def test_drivers_say_the_motion_without_scripts(fresh_file, billboards):
    """Simple expressions alone, whose values are those that NumPy is given, on every frame."""
    placed(billboards, "Crate", "Torus")
    follower, driven = following(bpy.context.scene, billboards, "Test")
    _, names = with_movers(billboards, moving_objects(bpy.context.scene))
    assert set(names) == {"Crate", "Torus"}
    trees = set(driven.values())
    drivers = [d for tree in trees for d in tree.animation_data.drivers]
    assert len(drivers) == 12 * len(trees) == 24
    assert all(d.driver.is_simple_expression and d.driver.is_valid for d in drivers)
    shown_by(*trees)
    for frame in (1, 7, 11):
        bpy.context.scene.frame_set(frame)
        wanted = at_frame(billboards, follower, names).uniforms
        for uniform, tree in driven.items():
            evaluated = tree.evaluated_get(bpy.context.evaluated_depsgraph_get())
            by_label = {n.label: n for n in evaluated.nodes if n.label}
            found = [*(s.default_value for s in by_label[uniform].inputs), by_label[f"{uniform} w"].outputs[0].default_value]
            assert np.allclose(found, wanted[uniform], atol=1e-5), (frame, uniform)


def test_what_stays_has_no_drivers(fresh_file, billboards):
    """And its nodes are what they were: the asset itself is emitted."""
    placed(billboards)
    assert following(bpy.context.scene, billboards, "Test") == (billboards, {})
    environment = replace(billboards, parts=())
    assert following(bpy.context.scene, environment, "Test") == (environment, {})


def test_what_may_move(fresh_file):
    """Animated by itself or by its parents; constrained; driven; not what has another property animated, nor what stands."""
    still, keyed, child, tied, driven, other = (empty(n) for n in ("still", "keyed", "child", "tied", "driven", "other"))
    keyed.keyframe_insert("location", frame=1)
    child.parent = keyed
    tied.constraints.new("COPY_LOCATION").target = keyed
    driven.driver_add("rotation_euler", 2).driver.expression = "frame"
    other.keyframe_insert("hide_render", frame=1)
    assert [may_move(o) for o in (still, keyed, child, tied, driven, other)] == [False, True, True, True, True, False]
    tied.constraints[0].mute = True
    assert not may_move(tied)


@pytest.mark.parametrize(
    "kind,scene,engine",
    [("billboards", lit_scene, "CYCLES"),
     *(pytest.param(*case, "BLENDER_EEVEE", marks=pytest.mark.slow)
       for case in (("billboards", lit_scene), ("billboards", scene_of_everything), ("depth_maps", scene_of_everything)))],
)  # fmt: skip
def test_nodes_show_them_where_numpy_does(kind, scene, engine, fresh_file, tmp_path):
    """On a frame that was not baked, driven by objects alone; with a mirror among them in the slow ones."""
    asset = baked(kind, scene())
    placed(asset, "Crate", "Torus", "Half")
    follower, driven = following(bpy.context.scene, asset, "Test")
    _, names = with_movers(asset, moving_objects(bpy.context.scene))
    program = record(methods.get(kind).trace, follower)
    tree = emit_nodes(program, follower, "Test", tuple(OUTPUTS), driven=driven)
    bpy.context.scene.frame_set(9)
    rays = rays_of_all_kinds(np.random.default_rng(5), RAYS)
    given = {"origin": rays.origin, "direction": rays.direction, "width": np.zeros(RAYS), "spread": np.zeros(RAYS)}
    found = run_nodes(fresh_file, tmp_path, {"n": (tree, OUTPUTS)}, given, engine)["n"]
    wanted = run_numpy(program, at_frame(asset, follower, names), rays)
    still = run_numpy(program, follower, rays)
    bounds = tolerances_nodes.EEVEE_HALF_RELATIVE, tolerances.KERNEL_DISTANCE_RELATIVE
    answer = Answer(position=wanted.position, **found)
    odd = ~same_answer(answer, wanted, rays.origin, *bounds)
    assert odd.mean() < tolerances_nodes.MOVED_ROWS_EDGES, odd.mean()
    assert (np.abs(still.radiance - wanted.radiance).max(-1) > 0.01).mean() > 0.02, "the move is seen at all"


def test_removed_they_leave_no_trace(fresh_file, billboards):
    """Objects that drivers name are as they were; a group that nobody shows goes with its drivers."""
    properties.register()
    try:
        placed(billboards, "Crate", "Torus")
        ball("Ball", principled("Metal", Metallic=1.0))
        scene = bpy.context.scene
        before = dump()
        snapshot = snapshot_of(scene)
        assets = {r.name: billboards for r in snapshot.reflectors()}
        done = use_in_materials(scene, snapshot, assets, "billboards")
        assert done.materials == 1
        shown = bpy.data.objects["Ball"].material_slots[0].material
        assert sum("follows" in g.name for g in groups_of(shown.node_tree)) == 2
        assert remove_from_materials(scene.objects).materials == 1
        after = dump()
        assert [k for k in before.keys() | after.keys() if before.get(k) != after.get(k)] == []
    finally:
        properties.unregister()
