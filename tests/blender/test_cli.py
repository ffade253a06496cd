"""The command line end to end: real files, real processes' exit statuses, sentences instead of tracebacks."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    """A .blend with a mirror sphere over a lit plane and a camera 'Camera'."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    scene.world.light_settings.distance = 1
    bpy.ops.mesh.primitive_plane_add(size=8)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=12, location=(0, 0, 1.2))
    sphere = bpy.context.object
    sphere.name = "Ball"
    bpy.ops.object.shade_smooth()
    mirror = bpy.data.materials.new("Mirror")
    shader = mirror.node_tree.nodes["Principled BSDF"]
    shader.inputs["Metallic"].default_value, shader.inputs["Roughness"].default_value = 1.0, 0.0
    sphere.data.materials.append(mirror)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler = (0, -6, 2), (1.45, 0, 0)
    scene.camera = camera
    lamp = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    scene.collection.objects.link(lamp)
    path = tmp_path_factory.mktemp("cli") / "tiny.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def run(capfd, *arguments) -> tuple[int, str, str]:
    """(status, stdout, stderr) of the command line in this process."""
    from reflect_addon import cli

    capfd.readouterr()
    try:
        status = cli.main([str(a) for a in arguments])
    except SystemExit as end:
        status = end.code
    return status, *capfd.readouterr()


BAKE = ("--resolution", "16", "--set", "samples=1")


@pytest.mark.parametrize("backend", ["numpy", "gpu"])
def test_evaluate_and_report(tiny, tmp_path, capfd, backend):
    from reflect_addon.evaluation.rows import read_rows

    status, out, err = run(
        capfd, "evaluate", tiny, "--methods", "environment", "--size", "32x24", "--samples", 2, "--backend", backend,
        "--out", tmp_path, *BAKE,
    )  # fmt: skip
    assert status == 0, err
    assert out.strip() == str(tmp_path / "results.json"), "nothing but the result on standard output"
    (row,) = read_rows(tmp_path)
    assert row.method == "environment" and row.scene == "tiny" and row.size == "32x24"
    assert row.pixels > 20 and row.nonfinite == 0 and row.ms_vs_environment == 1
    assert 0 < row.hit_p50 < 1 and row.floor_rmse > 0 and row.flip < 0.5
    assert all((tmp_path / p).is_file() for p in row.pictures.values())
    status, out, err = run(capfd, "report", tmp_path, "--out", tmp_path / "page")
    assert status == 0 and "data:image/png" in Path(out.strip()).read_text(), err


def test_backends_agree(tiny, tmp_path, capfd):
    from reflect_addon.evaluation.rows import read_rows

    rows = []
    for backend in ("numpy", "gpu"):
        arguments = ("--methods", "environment", "--size", "64x48", "--samples", 4, "--backend", backend)
        assert run(capfd, "evaluate", tiny, *arguments, "--out", tmp_path / backend, *BAKE)[0] == 0
        rows += read_rows(tmp_path / backend)
    a, b = rows
    assert abs(a.pixels - b.pixels) <= 0.02 * a.pixels
    assert a.hit_p50 == pytest.approx(b.hit_p50, rel=0.05)
    assert a.counts["fetches_per_ray"] == pytest.approx(b.counts["fetches_per_ray"], rel=0.01)


def test_bake_speaks_json_and_analyse_sees_it(tiny, tmp_path, capfd):
    status, out, err = run(capfd, "bake", tiny, "--methods", "environment", "--json-progress", *BAKE)
    assert status == 0, err
    lines = [json.loads(line) for line in out.splitlines()]
    assert all("progress" in line for line in lines[:-1]) and len(lines) > 1
    assert (Path(lines[-1]["done"][0]) / "asset.json").is_file()
    status, out, err = run(capfd, "analyse", tiny, "--json")
    found = json.loads(out)
    assert status == 0 and [r["name"] for r in found["reflectors"]] == ["Ball"]
    assert {m["name"]: m["state"] for m in found["methods"]}["environment"] == "fresh"
    status, out, err = run(capfd, "shader", tiny, "--method", "environment")
    assert status == 0 and "void answer(" in out


@pytest.mark.parametrize("ending", ["png", "exr"])
def test_render(tiny, tmp_path, capfd, ending):
    picture = tmp_path / f"p.{ending}"
    status, out, err = run(
        capfd, "render", tiny, "--method", "environment", "--size", "32x24", "--samples", 1, "--out", picture, *BAKE
    )
    assert status == 0 and out.strip() == str(picture), err
    import bpy

    image = bpy.data.images.load(str(picture))
    assert tuple(image.size) == (32, 24)
    bpy.data.images.remove(image)


GOOD = ("--methods", "environment", "--size", "8x8")


@pytest.mark.parametrize(
    "arguments, words",
    [
        (("--camera", "Nobody", *GOOD), "Choose among: Camera"),
        (("--methods", "magic", "--size", "8x8"), "no method named 'magic'"),
        (("--methods", ",", "--size", "8x8"), "No method was named"),
        (("--scene", "Nowhere", *GOOD), "no scene named"),
    ],
)
def test_wrong_names_are_sentences(tiny, tmp_path, capfd, arguments, words):
    status, out, err = run(capfd, "evaluate", tiny, "--backend", "numpy", "--out", tmp_path, *arguments)
    assert status == 1 and words in err and "Traceback" not in err and out == ""
    assert not (tmp_path / "results.json").exists()


@pytest.mark.parametrize("size", ["0x0", "99999999x9", "12", "axb", "-1x5", "16384x16384"])
def test_wrong_sizes_are_wrong_usage(tiny, tmp_path, capfd, size):
    status, _, err = run(capfd, "evaluate", tiny, "--methods", "all", f"--size={size}", "--out", tmp_path)
    assert status == 2 and "240x180" in err


@pytest.mark.parametrize(
    "content, words",
    [(None, "no file"), (b"", "cut short"), (b"hello, this is no blend", "not a .blend"), (b"BLENDER17-01v0502" + b"\0" * 99, "")],
)
def test_bad_files_are_sentences(tmp_path, capfd, content, words):
    path = tmp_path / "bad.blend"
    if content is not None:
        path.write_bytes(content)
    status, out, err = run(capfd, "analyse", path)
    assert status == 1 and words in err and str(path) in err and "Traceback" not in err


def test_a_folder_that_cannot_be_written(tiny, tmp_path, capfd):
    (tmp_path / "taken").write_text("")
    status, _, err = run(capfd, "evaluate", tiny, *GOOD, "--out", tmp_path / "taken")
    assert status == 1 and "could not be written" in err and "--out" in err


def test_bugs_are_one_line_unless_asked(tiny, tmp_path, capfd, monkeypatch):
    from reflect_addon import verbs

    monkeypatch.setattr(verbs, "scene_of", lambda _: 1 / 0)
    status, _, err = run(capfd, "analyse", tiny)
    assert status == 1 and "ZeroDivisionError" in err and "--debug" in err and "Traceback" not in err
    assert "Traceback" in run(capfd, "analyse", tiny, "--debug")[2]


def test_statuses_of_a_real_process(tmp_path):
    def status(*arguments):
        return subprocess.run([sys.executable, "-m", "reflect_addon.cli", *arguments], cwd=ROOT, capture_output=True).returncode

    assert status("--help") == 0 and status("dance") == 2 and status("analyse", str(tmp_path / "no.blend")) == 1
