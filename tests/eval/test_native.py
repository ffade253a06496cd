"""Methods as node groups in EEVEE: what is asked of the process that draws, read back, counted, said and refused; one tiny real frame."""


import bpy
import mesh_scenes
import numpy as np
import pytest
import trimesh
from tolerances_nodes import NATIVE_HALF, NATIVE_NORMALS, NATIVE_RADIANCE

from reflect_addon import cli
from reflect_addon.core import cubemap
from reflect_addon.core.asset import Asset
from reflect_addon.core.methods import box_proxy, environment
from reflect_addon.core.rays import Hits, RayMap
from reflect_addon.core.spaces import FAR, STATUS_HIT, STATUS_NONE
from reflect_addon.evaluation import native, peer, peer_places
from reflect_addon.evaluation.backends import NumpyBackend
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.evaluation.rows import read_rows, set_up_of
from reflect_addon.gpu.device import ensure
from reflect_addon.scene import eevee_draw, native_draw, node_uniforms
from reflect_addon.scene.camera import camera_of
from reflect_addon.scene.eevee_job import Groups, Job
from reflect_addon.scene.exr import read_exr
from reflect_addon.scene.native_draw import FLAGS, MOST, RADIANCE, WAY
from reflect_addon.scene.raymap_numpy import numpy_ray_map
from sample_blends import scene_parts as parts

SIDE = 4.0  # m, of the room


@pytest.fixture
def room(fresh_file, tmp_path):
    """A mirror ball and a mirror panel in a turned closed room, saved."""
    scene = parts.prepare(bpy.context.scene, "room")
    parts.set_world(scene, (0.2, 0.2, 0.2))
    walls = parts.material("Walls", (0.7, 0.5, 0.3))
    walls.node_tree.nodes["Principled BSDF"].inputs["Emission Color"].default_value = (0.7, 0.5, 0.3, 1)
    walls.node_tree.nodes["Principled BSDF"].inputs["Emission Strength"].default_value = 1.0
    box = parts.box("Room", (SIDE, SIDE, 3.0), (0, 0, 1.5), walls)
    box.rotation_euler.z = 0.3
    parts.sphere("Ball", 0.4, parts.mirror(), 32, location=(0.5, 0.2, 1.0))
    bpy.ops.mesh.primitive_plane_add(size=1.0, location=(0, 1.6, 1.2), rotation=(np.pi / 2, 0, 0))
    bpy.context.object.name = "Panel"
    bpy.context.object.data.materials.append(bpy.data.materials["Mirror"])
    parts.camera((0, -1.5, 1.3), (0.2, 1.0, 1.1), lens=24)
    path = tmp_path / "room.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def run(capfd, *arguments):
    capfd.readouterr()
    status = cli.main([str(a) for a in arguments])
    return status, *capfd.readouterr()


# --- where probes stand


def test_a_room_gets_a_box_and_a_mirror_its_plane(room):
    scene = bpy.context.scene
    with open_frame(scene, None) as snapshot:
        view = camera_of(scene, None, 32, 24)
        reflectors = [i.object_name for i in snapshot.reflectors()]
        assert reflectors == ["Ball", "Panel"]
        box = peer_places.room(snapshot, reflectors)
        assert np.allclose(box.centre, (0, 0, 1.5), atol=0.02) and np.allclose(sorted(box.half), (1.5, 2, 2), atol=0.02)
        assert abs(abs(box.axes[0][0]) - np.cos(0.3)) < 0.01, "turned as the room is"
        (plane,) = peer_places.planes(snapshot, view, np.array([5, 9]))
        before = np.array(plane.centre) - (0, 1.6, 1.2)
        assert np.allclose(plane.half[:2], 0.5, atol=1e-6) and before @ plane.axes[2] == pytest.approx(peer_places.BEFORE * snapshot.diagonal(), rel=1e-3)
        assert np.allclose(np.abs(plane.axes[2]), (0, 1, 0), atol=1e-6) and before[1] < 0, "on the side of the camera"
        assert np.linalg.det(np.array(plane.axes)) == pytest.approx(1)
        assert peer_places.planes(snapshot, view, np.array([5, 0])) == [], "a mirror that no pixel sees"
        probes, names = peer_places.spheres(snapshot, np.array([5, 9]))
        assert names == ["Panel", "Ball"] and [p.influence == p.reach for p in probes] == [True, False]
    bpy.data.objects["Room"].scale.z = 0.0
    bpy.context.view_layer.update()
    with open_frame(scene, None) as snapshot:
        assert peer_places.room(snapshot, reflectors) is None, "a floor alone is no room"


# --- read back and counted


def test_outputs_become_answers():
    directions = np.tile(np.float32((0, 0, 1)), (1, 3, 1))
    ray_map = RayMap(np.ones((1, 3, 3), np.float32), directions, directions, np.array([[0, 0, -1]]), *np.zeros((2, 1, 3), np.float32), ("a",))
    channels = {f"{RADIANCE}.{c}": np.full((1, 3), 0.5, np.float32) for c in "RGB"}
    channels |= {f"{WAY}.{c}": np.array([v], np.float32) for c, v in (("R", (0, 0, 9)), ("G", (0.5, 0, 9)), ("B", (0.25, MOST, 9)))}
    channels |= {f"{FLAGS}.{c}": np.array([v], np.float32) for c, v in (("R", (0.5, 1, 9)), ("G", (1, 0, 9)))}
    answer, missing = native.answer_in(channels, ray_map, diagonal=8.0)
    assert missing == 1 and answer.status.tolist() == [STATUS_HIT, STATUS_NONE] and answer.coverage.tolist() == [0.5, 0]
    assert answer.position[0].tolist() == [1, 5, 3] and answer.position[1][2] > FAR / 2


# --- said and refused


def test_methods_that_draw_say_that_they_have_no_group(room, tmp_path, capfd):
    words = ("render", room, "--method", "recursive", "--backend", "eevee", "--size", "8x8", "--out", tmp_path / "p.png")
    status, _, err = run(capfd, *words)
    assert status == 1 and "no node group" in err and "box_proxy" in err and not (tmp_path / "p.png").exists()
    words = ("render", room, "--method", "light_field", "--backend", "eevee", "--background", "--size", "8x8", "--out", tmp_path / "p.png")
    status, _, err = run(capfd, *words)
    assert status == 1 and "--background" in err


# --- EEVEE itself, as small as it can be: one frame of one sample, in this process


def test_a_mirror_shows_what_its_kernel_answers(fresh_file, tmp_path, monkeypatch):
    """A plane with the group of a box and a cube map of a ball's surroundings, against NumPy on the ray map's rays; then the slot is as before."""
    scene = parts.prepare(bpy.context.scene, "tiny")
    bpy.ops.mesh.primitive_plane_add(size=4.0)
    plane = bpy.context.object
    plane.data.materials.append(parts.mirror())
    parts.camera((0, -3, 2), (0, 0, 0), lens=30)
    ball = trimesh.creation.icosphere(2, 0.5)
    around = mesh_scenes.snapshot(ball, Room=trimesh.creation.box((6, 5, 3)))
    cube = environment.bake(mesh_scenes.job(around, {**environment.DEFAULTS, "resolution": 16, "samples": 1}))
    asset = box_proxy.bake(mesh_scenes.job(around, {}, {"environment": cube})).joined(cube)
    monkeypatch.setattr(native_draw, "load_assets", lambda *_: {"": asset})
    with open_frame(scene, None) as snapshot:
        ray_map = numpy_ray_map(snapshot, camera_of(scene, None, 16, 12))
        expected = NumpyBackend(snapshot, {"": asset}, None, None, ray_map).answer()
    job = Job(scene.name, "Camera", 1, (16, 12), 1, 512, (), (), (), (), (), (), snapshot.diagonal())
    material = plane.material_slots[0].material
    eevee_draw.settings(scene, job)
    group = native_draw.Native(Groups("box_proxy", ""), snapshot)
    group.put(scene, job.diagonal)
    eevee_draw.draw(scene, 1, tmp_path / "group.exr")
    eevee_draw.draw(scene, 3, tmp_path / "more.exr")
    counts = group.counts()
    group.take_away()
    assert group.error is None and counts["nodes"] > 10 and counts["look_ups"] > 0 and counts["groups"] == 1
    answer, missing = native.answer_in(read_exr(tmp_path / "group.exr"), ray_map, snapshot.diagonal())
    assert len(answer.radiance) > 50 and missing == 0
    off = np.abs(answer.radiance - expected.radiance).max(-1)
    assert np.percentile(off, 95) < NATIVE_RADIANCE, off
    more, _ = native.answer_in(read_exr(tmp_path / "more.exr"), ray_map, snapshot.diagonal())
    assert np.allclose(more.radiance, answer.radiance, atol=NATIVE_RADIANCE), "what is judged by one sample stands for frames of any number"
    away = np.linalg.norm(expected.position - ray_map.rays().origin, axis=-1)
    reach = np.linalg.norm(answer.position - expected.position, axis=-1)[away < FAR / 2] / away[away < FAR / 2]
    assert np.percentile(reach, 95) < NATIVE_HALF
    slot = plane.material_slots[0]
    assert slot.link == "DATA" and slot.material == material and not bpy.data.node_groups
    monkeypatch.setattr(node_uniforms, "MOST_BYTES", 1024)
    group = native_draw.Native(Groups("box_proxy", ""), snapshot)
    group.put(scene, job.diagonal)
    (note,) = group.notes
    assert slot.material == material and note.startswith(f"{plane.name} is not drawn: its shader would need")


def test_what_is_judged_has_the_normals_of_the_snapshot(fresh_file, tmp_path, monkeypatch):
    """A subdivided turned cube under light that is a straight function of the direction: EEVEE's coarse normals, and those that the GPU gives such
    meshes once it is in use, would show."""
    ensure()
    scene = parts.prepare(bpy.context.scene, "tiny")
    bpy.ops.mesh.primitive_cube_add(size=2.0, rotation=(0.3, 0.5, 0.7))
    bpy.ops.object.shade_smooth()
    cube = bpy.context.object
    cube.data.materials.append(parts.mirror())
    subdivision = cube.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels = subdivision.render_levels = 2
    parts.camera((0, -3, 1), (0, 0, 0), lens=35)
    rays = cubemap.bundle(np.zeros(3), 16)
    light = Hits(np.float32(1.0 + 0.9 * rays.direction), 5 * rays.direction, rays.direction, np.zeros(len(rays), int), np.ones(len(rays), bool))
    image, uniforms = cubemap.assemble(np.zeros(3), 16, light)
    asset = Asset("environment", "", {"radiance_tx": image}, uniforms | {"center": (0.0, 0.0, 0.0)})
    monkeypatch.setattr(native_draw, "load_assets", lambda *_: {"": asset})
    with open_frame(scene, None) as snapshot:
        ray_map = numpy_ray_map(snapshot, camera_of(scene, None, 24, 18))
        expected = NumpyBackend(snapshot, {"": asset}, None, None, ray_map).answer()
    job = Job(scene.name, "Camera", 1, (24, 18), 1, 512, (), (), (), (), (), (), snapshot.diagonal())
    eevee_draw.settings(scene, job)
    group = native_draw.Native(Groups("environment", ""), snapshot)
    group.put(scene, job.diagonal)
    eevee_draw.draw(scene, 1, tmp_path / "group.exr")
    answer, missing = native.answer_in(read_exr(tmp_path / "group.exr"), ray_map, snapshot.diagonal())
    assert len(answer.radiance) > 100 and missing == 0
    assert np.percentile(np.abs(answer.radiance - expected.radiance).max(-1), 95) < NATIVE_NORMALS


@pytest.mark.slow
def test_evaluate_judges_groups_in_a_process_of_their_own(room, tmp_path, capfd, monkeypatch):
    """And EEVEE's room-shaped and plane probes beside them."""
    monkeypatch.setattr(peer, "SAMPLES", 1)
    words = ("evaluate", room, "--methods", "environment,recursive,eevee", "--backend", "eevee", "--size", "32x24", "--samples", "1", "--out", tmp_path)
    status, _, err = run(capfd, *words, "--resolution", "32", "--set", "samples=1")
    assert status == 0, err
    ours, none, *theirs = read_rows(tmp_path)
    assert ours.backend == "EEVEE" and ours.rmse is not None and ours.hit_p50 is not None and ours.ms > 0 and ours.ms_vs_environment == 1
    assert ours.counts["nodes"] > 10 and ours.counts["look_ups"] > 0 and ours.counts["images"] <= 4 and ours.bytes > 32 * 32
    assert ours.counts["traced_frame_s"] > 0 and {"answer", "hit_error"} <= set(ours.pictures)
    assert none.rmse is None and "no node group" in none.notes[0]
    assert [set_up_of(row.settings) for row in theirs] == [
        "tracing + spheres", "tracing", "spheres", "tracing + box", "box", "tracing + box + planes",
    ]  # fmt: skip
    assert theirs[-1].flip < theirs[1].flip, "a plane probe shows what screen tracing alone does not"
