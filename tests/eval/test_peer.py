"""EEVEE's own picture as a row: what is asked for, kept, said and refused. EEVEE itself draws only in the slow tests."""

import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from blender_dump import dump, dump_saved
from tolerances import PEER_FURNACE, PEER_PIXELS

from reflect_addon import cli
from reflect_addon.core.errors import Cancelled, ReflectError
from reflect_addon.evaluation import eevee_apart, peer, peer_places
from reflect_addon.evaluation.report import report
from reflect_addon.evaluation.rows import read_rows
from reflect_addon.scene import peer_materials
from reflect_addon.scene.eevee_job import Groups, Job, Probe
from reflect_addon.scene.exr import write_exr
from sample_blends import scene_parts as parts

DEVICE = "llvmpipe (SOFTWARE)"
SIZE = "32x24"


@pytest.fixture
def tiny(fresh_file, tmp_path):
    """A red mirror ball and a glass one under a white world, saved."""
    scene = parts.prepare(bpy.context.scene, "tiny")
    parts.set_world(scene, (1, 1, 1))
    parts.sphere("Mirror ball", 1.0, parts.mirror(colour=(0.9, 0.3, 0.2)), 48)
    glass = bpy.data.materials.new("Glass")
    shader = glass.node_tree.nodes["Principled BSDF"]
    shader.inputs["Transmission Weight"].default_value, shader.inputs["Roughness"].default_value = 1.0, 0.1
    parts.sphere("Glass ball", 0.3, glass, 24, location=(1.2, -1, 0))
    parts.camera((0, -5, 0.8), (0.2, 0, 0), lens=50)
    path = tmp_path / "tiny.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


class Draws:
    """Stands in for the process that draws: grey pictures, as files."""

    def __init__(self):
        self.jobs = []

    def __call__(self, job, folder, say=None):
        self.jobs.append(job)
        for number in range(len(job.settings)):
            value = np.full((job.size[1], job.size[0], 3), 0.25 * (number + 1), np.float32)
            write_multilayer(folder / f"picture{number}.exr", value)
        time = {"compile": 2.0, "seconds": 1.5, "busy": 2.5, "sample": 0.1}
        return {"replaced": ["Glass"], "times": [time] * len(job.settings), "set_up": 3.0, "groups": [], "device": DEVICE}


def write_multilayer(path, value):
    write_exr(path, value)
    names = {f"Glossy Direct.{c}": value[..., i] for i, c in enumerate("RGB")}
    FILES[str(path)] = names


FILES: dict[str, dict] = {}


@pytest.fixture
def drawn(monkeypatch):
    """evaluate() with the stand-in; yields it."""
    draws = Draws()
    monkeypatch.setattr("reflect_addon.evaluation.evaluate.draw_apart", draws)
    monkeypatch.setattr(peer, "read_exr", lambda path: FILES.pop(str(path)))
    return draws


def run(capfd, *arguments):
    capfd.readouterr()
    status = cli.main([str(a) for a in arguments])
    return status, *capfd.readouterr()


def evaluate(capfd, tiny, out, methods="eevee", *more):
    return run(capfd, "evaluate", tiny, "--methods", methods, "--size", SIZE, "--samples", 2, "--out", out,
               "--backend", "numpy", *more)  # fmt: skip


def test_a_row_for_each_setting_with_nothing_made_up(tiny, drawn, tmp_path, capfd):
    status, _, err = evaluate(capfd, tiny, tmp_path)
    assert status == 0, err
    rows = read_rows(tmp_path)
    assert [(r.settings["screen_tracing"], r.settings["sphere_probe"]) for r in rows] == [(True, True), (True, False), (False, True)]
    assert rows[0].rmse > rows[1].rmse > rows[2].rmse > 0, "grey 0.25 is further than 0.5 from a white world"
    for row in rows:
        assert (row.method, row.backend, row.device) == ("eevee", "EEVEE", DEVICE)
        assert row.pixels > 100 and row.floor_rmse is not None and row.flip > 0 and row.ssim < 1 and row.nonfinite == 0
        missing = ("hit_p50", "hit_p95", "angle_p50", "angle_p95", "false_hit", "missed_hit", "ms", "bytes", "bake_s")
        assert all(getattr(row, name) is None for name in missing)
        assert row.counts["frame_s"] == 1.5 and row.counts["frame_cpu_s"] == 2.5 and row.counts["compile_s"] == 2.0
        assert any("no hit points" in n for n in row.notes) and any("Glass" in n for n in row.notes)
        assert not any("volume" in n for n in row.notes), "the scene is open"
        assert set(row.pictures) == {"frame", "truth", "answer", "difference"}
        assert all((tmp_path / p).is_file() for p in row.pictures.values())
    assert rows[0].pictures["answer"] != rows[1].pictures["answer"]


def test_beside_the_methods_in_table_strip_and_plots(tiny, drawn, tmp_path, capfd):
    bake = ("--resolution", 16, "--set", "samples=1")
    status, _, err = evaluate(capfd, tiny, tmp_path, "environment,eevee", *bake)
    assert status == 0, err
    html = report([tmp_path], tmp_path / "page").read_text()
    assert html.count("<section class='scene'>") == 1, "one frame, although the backends differ"
    assert "<th>eevee, tracing + spheres " in html and "<h3>eevee, tracing " in html and "<h3>eevee, spheres " in html
    assert html.count("Not in this plot") == 2 and "a peer and no method of ours" in html
    assert html.count("eevee, tracing + spheres: difference") == 1
    assert "eevee" not in html.partition("<svg")[2].partition("</svg>")[0]


def test_pictures_are_kept_and_damaged_ones_drawn_again(tiny, drawn, tmp_path, capfd):
    assert [evaluate(capfd, tiny, tmp_path)[0] for _ in range(2)] == [0, 0] and len(drawn.jobs) == 1
    first = read_rows(tmp_path)
    (kept,) = (tmp_path / "truth").glob("eevee-*.npz")
    kept.write_bytes(kept.read_bytes()[:100])
    assert evaluate(capfd, tiny, tmp_path)[0] == 0 and len(drawn.jobs) == 2
    assert read_rows(tmp_path) == first


def test_the_key_knows_every_input():
    camera = SimpleNamespace(world_from_camera=np.eye(4), clip_from_camera=np.eye(4))
    ray_map = SimpleNamespace(covered=lambda: np.ones((2, 2), bool))
    less = SimpleNamespace(covered=lambda: np.eye(2, dtype=bool))
    moved = SimpleNamespace(world_from_camera=2 * np.eye(4), clip_from_camera=np.eye(4))
    probes = (Probe("SPHERE", (0, 0, 0), 1, 2),)
    job = Job("S", "C", 1, (2, 2), 4, 256, ("M",), (), (), probes, peer.SETTINGS, (Groups("box_proxy", "folder"),))
    base = (job, camera, ray_map, "hash", "values", "5.2")
    others = (replace(job, samples=5), moved, less, "other", "changed", "5.3")
    keys = [peer.key_of(*base)] + [peer.key_of(*base[:i], other, *base[i + 1 :]) for i, other in enumerate(others)]
    assert len(set(keys)) == 7 and keys[0] == peer.key_of(*base)
    assert Job.from_plain(json.loads(json.dumps(job.plain()))) == job


def test_eevees_own_settings_are_part_of_the_key(tiny):
    scene, before = bpy.context.scene, peer.eevee_values(bpy.context.scene)
    for owner, name, value in (
        (scene.eevee, "fast_gi_distance", 1.0),
        (scene.world, "use_sun_shadow", not scene.world.use_sun_shadow),
        (bpy.data.materials["Glass"], "surface_render_method", "BLENDED"),
    ):
        setattr(owner, name, value)
        assert before != (before := peer.eevee_values(scene))


def test_probes_sit_in_the_reflectors_that_fill_most_pixels(tiny, drawn, tmp_path, capfd, monkeypatch):
    monkeypatch.setattr(peer_places, "MOST_SPHERES", 1)
    assert evaluate(capfd, tiny, tmp_path)[0] == 0
    (job,) = drawn.jobs
    assert job.hidden == ("Mirror ball",) and set(job.materials) == {"Mirror", "Glass"} and job.marked == ()
    (probe,) = job.probes
    assert np.allclose(probe.centre, 0, atol=1e-3) and probe.influence == probe.reach >= np.hypot(1.5, 1.3)


def test_no_reflector_pixel_needs_no_drawing(tiny, drawn, tmp_path, capfd):
    bpy.data.objects["Mirror ball"].location = bpy.data.objects["Glass ball"].location = (0, 90, 90)
    bpy.ops.wm.save_mainfile()
    status, _, err = evaluate(capfd, tiny, tmp_path, "environment,eevee", "--resolution", 16, "--set", "samples=1")
    assert status == 0 and drawn.jobs == [], err
    assert [(r.pixels, r.rmse, r.flip) for r in read_rows(tmp_path)] == [(0, None, None)] * 4
    html = report([tmp_path], tmp_path / "page").read_text()
    assert "0 reflector pixels" in html and "no reflector pixel to judge" in html


@pytest.mark.parametrize(
    "words",
    [
        ("bake", "--methods", "eevee"),
        ("bake", "--methods", "all,eevee"),
        ("render", "--method", "eevee", "--size", "8x8", "--out", "p.png"),
        ("shader", "--method", "eevee"),
    ],
)
def test_only_evaluate_knows_it(tiny, tmp_path, capfd, words, monkeypatch):
    monkeypatch.chdir(tmp_path)
    verb, *rest = words
    status, out, err = run(capfd, verb, tiny, *rest)
    assert status == 1 and "only evaluate" in err and "environment" in err and "Traceback" not in err and out == ""


def test_all_leaves_the_peer_out_and_repeats_are_one():
    from reflect_addon.asked import methods_of
    from reflect_addon.core import methods as registry

    assert methods_of("all", peers=("eevee",)) == registry.names()
    assert methods_of("all, eevee,box_proxy,eevee", peers=("eevee",)) == (*registry.names(), "eevee")


def test_a_process_that_fails_or_is_cancelled_leaves_nothing(tiny, tmp_path):
    """The job's camera does not exist, so that the process ends before it draws."""
    folder = tmp_path / "pictures"
    folder.mkdir()
    job = Job("tiny", "Nobody", 1, (8, 8), 1, 256, (), (), (), (), peer.SETTINGS)
    with pytest.raises(ReflectError, match="Nobody") as caught:
        eevee_apart.draw_apart(job, folder, lambda share, text: None)
    assert "Leave eevee out" in caught.value.remedy

    def stop(share, text):
        raise Cancelled("The evaluation")

    with pytest.raises(Cancelled):
        eevee_apart.draw_apart(job, folder, stop)
    assert list(folder.iterdir()) == []


@pytest.mark.skipif(os.name == "nt", reason="signals end processes elsewhere")
@pytest.mark.parametrize(("crashes", "goes_well"), ((1, True), (2, False)))
def test_a_process_that_crashes_is_started_once_more(tiny, tmp_path, monkeypatch, crashes, goes_well):
    job = Job("tiny", "Camera", 1, (8, 8), 1, 256, (), (), (), (), peer.SETTINGS)
    said, started = [], []

    def command(_blend, _verb, _arguments):
        started.append(1)
        ends = "import os; os.kill(os.getpid(), 11)" if len(started) <= crashes else f"open({str(tmp_path / 'said.json')!r}, 'w').write('{{}}'); print('{{\"done\": []}}')"
        return [sys.executable, "-c", ends], dict(os.environ)

    monkeypatch.setattr(eevee_apart, "reflect_command", command)
    if goes_well:
        assert eevee_apart.draw_apart(job, tmp_path, lambda share, text: said.append(text)) == {}
    else:
        with pytest.raises(ReflectError, match="signal 11"):
            eevee_apart.draw_apart(job, tmp_path, lambda share, text: said.append(text))
    assert len(started) == 2 and any("once more" in text and "signal 11" in text for text in said)


# --- in this process, without drawing


def test_materials_lose_what_turns_the_ray_and_keep_their_look(tiny):
    mirror, glass = bpy.data.materials["Mirror"], bpy.data.materials["Glass"]
    tree = mirror.node_tree
    shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    bump, noise = tree.nodes.new("ShaderNodeBump"), tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(bump.outputs[0], shader.inputs["Normal"])
    tree.links.new(noise.outputs[0], shader.inputs["Roughness"])
    assert peer_materials.straighten(("Mirror", "Glass"), ()) == ["Glass"]
    assert not shader.inputs["Normal"].is_linked and not shader.inputs["Roughness"].is_linked
    assert shader.inputs["Roughness"].default_value == 0 and shader.inputs["Base Color"].default_value[1] == pytest.approx(0.3)
    used = glass.node_tree.get_output_node("EEVEE").inputs["Surface"].links[0].from_node
    assert used.type == "BSDF_GLOSSY" and used.inputs["Roughness"].default_value == 0


def test_what_was_marked_by_hand_becomes_a_mirror_all_over(tiny):
    ball, bare = bpy.data.objects["Mirror ball"], parts.sphere("Bare", 1.0, bpy.data.materials["Mirror"], 12)
    bare.data.materials.clear()
    shared = ball.data.materials[0]
    assert peer_materials.straighten((), ("Mirror ball", "Bare")) == ["all of Mirror ball", "all of Bare"]
    assert ball.material_slots[0].material.name == bare.material_slots[0].material.name == "Reflect mirror"
    assert ball.data.materials[0] == shared, "other objects with this mesh keep it"


# --- EEVEE itself


@pytest.mark.slow
def test_eevee_reflects_a_white_world_white_and_changes_nothing(tiny, tmp_path, capfd):
    """A furnace: under a world of radiance 1 a mirror shows 1 but for the other ball, whatever its tint; glass too, as it is
    replaced."""
    before, saved, live = tiny.read_bytes(), dump_saved(tiny), dump()
    status, _, err = evaluate(capfd, tiny, tmp_path)
    assert status == 0, err
    assert dump() == live and tiny.read_bytes() == before and dump_saved(tiny) == saved
    with_probe, without, _ = read_rows(tmp_path)
    assert "Glass" in str(with_probe.notes) and with_probe.device and with_probe.counts["probes"] == 2
    assert without.median_relative < PEER_FURNACE
    files = {p.name.startswith("eevee-"): p for p in (tmp_path / "truth").iterdir()}
    with np.load(files[True]) as stored, np.load(files[False]) as truth:
        sees_world = truth["radiance"].min(-1) > 0.999
        wrong = np.abs(stored["radiance1"][sees_world] - 1).max(-1) > PEER_FURNACE
    assert sees_world.mean() > 0.9
    assert wrong.mean() < PEER_PIXELS, f"{wrong.sum()} of {len(wrong)} pixels"
    assert Path(tmp_path / with_probe.pictures["answer"]).is_file()
