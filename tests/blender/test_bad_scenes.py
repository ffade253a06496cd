"""Bad scenes through the command line: nothing to mirror, nothing to look through, names that nobody expects."""

import json
from pathlib import Path

import bpy
import pytest
from bad_input import BAKE, FRAME, TINY, TINY_ALL, VERBS, ball, contents, empty_stage, good, mirror, reflect, save, sentence  # noqa: F401

from reflect_addon.evaluation.rows import read_rows


def no_reflector():
    bpy.ops.mesh.primitive_cube_add()


def no_faces():
    mesh = bpy.data.meshes.new("Bare")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
    mesh.materials.append(mirror())
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Bare", mesh))


def no_scale():
    ball("Flat").scale = (0, 1, 1)


def no_number():
    ball("Lost").data.vertices[0].co.x = float("nan")
    for vertex in bpy.data.objects["Lost"].data.vertices:
        vertex.co.x = float("nan")


def too_far():
    ball("Star").location = (1e12, 0, 0)


# what the scene holds -> words that the sentence must have for the verbs that need a reflector
NOTHING_TO_MIRROR = {
    "empty": (lambda: None, ()),
    "no reflector": (no_reflector, ()),
    "no faces": (no_faces, ("Bare is left out: it has no faces.",)),
    "no scale": (no_scale, ("Flat is left out: its scale is 0.",)),
    "no number": (no_number, ("Lost is left out: its faces have no area.",)),
    "too far": (too_far, ("Star is left out: it reaches beyond",)),
}


@pytest.mark.parametrize("case", NOTHING_TO_MIRROR)
def test_nothing_to_mirror(reflect, tmp_path, case):
    build, words = NOTHING_TO_MIRROR[case]
    empty_stage()
    build()
    blend = save(tmp_path / "bad.blend")
    for verb in ("bake", "render", "evaluate", "evaluate numpy"):
        says = ("The scene 'Scene' has no reflector.", *words, "mark it as a reflector")
        reflect.refuses(verb, blend, *VERBS[verb](tmp_path / "out"), says=says, keeps=[tmp_path])
    reflect.refuses("shader", blend, *VERBS["shader"](tmp_path / "out"), says=("No asset of environment", "reflect bake"))
    found = reflect.works("analyse", blend).out
    assert "No reflector" in found and all(w in found for w in words)


def gone():
    bpy.data.objects.remove(bpy.data.objects["Camera"])


def flattened():
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.scale = (0, 0, 0)
    bpy.data.objects["Camera"].parent = parent


def panoramic():
    bpy.data.cameras["Camera"].type = "PANO"


def a_lamp():
    bpy.context.scene.camera = bpy.data.objects["Sun"]


NO_CAMERA = {
    "gone": (gone, ("The scene Scene has no camera", "Add a camera")),
    "flattened": (flattened, ("The camera Camera has scale 0", "Reset its transform")),
    "panoramic": (panoramic, ("The camera Camera is pano", "Choose Perspective")),
    "a lamp": (a_lamp, ("Sun is not a camera", "Name a camera")),
}


@pytest.mark.parametrize("case", NO_CAMERA)
def test_nothing_to_look_through(reflect, tmp_path, case):
    build, says = NO_CAMERA[case]
    empty_stage()
    ball()
    build()
    blend = save(tmp_path / "bad.blend")
    for verb in ("render", "evaluate", "evaluate numpy"):
        reflect.refuses(verb, blend, *VERBS[verb](tmp_path / "out"), says=says, keeps=[tmp_path])
    assert "1 reflectors" in reflect.works("analyse", blend).out
    reflect.works("bake", blend, *VERBS["bake"](tmp_path / "out"))


LONG = "Ein sehr langer Name, länger als jeder Dateiname sein darf: " + "ü" * 90
NAMES = ["球 🪩 ", LONG, "Ball", "ball", "a/b\\c:*?\"<>|", "../../etc", "con", "-x", "Red, blue", "two\nlines", " "]


def test_names_that_nobody_expects(reflect, tmp_path):
    """Every name gets assets of its own, all are found again, and the files lie where they should."""
    scene = empty_stage()
    scene.name = "../a/b: ü"
    for number, name in enumerate(NAMES):
        obj = ball(name, (number * 0.5 - 2.5, 0, 1.2), 0.3)
        assert obj.name == name, "Blender itself takes the name"
    bpy.data.objects["Camera"].name = "Kamera 照相机/" + "x" * 100
    blend = save(tmp_path / "in" / "räum '1' \"2\"\n3 $(x) & 照.blend")
    before = blend.read_bytes()
    made = reflect.works("bake", blend, "--methods", "environment", *TINY[:4]).out
    assert made.count("asset.json") == 0 and len(list((tmp_path / "in").glob("reflect/*/*/asset.json"))) == len(NAMES)
    found = json.loads(reflect.works("analyse", blend, "--json").out)
    assert sorted(r["name"] for r in found["reflectors"]) == sorted(NAMES)
    assert {m["name"]: m["state"] for m in found["methods"]}["environment"] == "fresh"
    for backend in ("numpy", "gpu"):
        out = tmp_path / "out" / backend
        reflect.works("evaluate", blend, "--out", out, "--methods", "environment", "--backend", backend, *FRAME, *TINY[:4])
        (row,) = read_rows(out)
        assert row.pixels > 20 and row.nonfinite == 0 and not any("No asset" in n for n in row.notes)
        assert all((out / p).is_file() for p in row.pictures.values())
    page = Path(reflect.works("report", out, "--out", tmp_path / "page").out.strip())
    assert "data:image/png" in page.read_text() and "is missing" not in page.read_text()
    reflect.works("render", blend, "--out", tmp_path / "out" / "Bild ü\n.png", "--method", "environment", *FRAME, *TINY[:4])
    assert "void answer(" in reflect.works("shader", blend, "--method", "environment").out
    assert blend.read_bytes() == before
    assert {p.name for p in tmp_path.iterdir()} == {"in", "out", "page"}, "nothing climbed out of its folder"


def test_objects_are_chosen_by_any_name(reflect, tmp_path):
    empty_stage()
    for number, name in enumerate(("Red, blue", "-x", "Ball")):
        ball(name, (number, 0, 1), 0.3)
    blend = save(tmp_path / "a.blend")
    arguments = ("--methods", "environment", *TINY[:4], "--object=Red, blue", "--object=-x")
    assert len(reflect.works("bake", blend, *arguments).out.splitlines()) == 2
    says = ("'Nobody' is not a reflector", "Reflectors are: -x, Ball, Red, blue")
    reflect.refuses("bake", blend, "--methods", "environment", "--objects", "Ball,Nobody", says=says, keeps=[tmp_path])


def test_a_picture_of_one_pixel_and_frames_out_of_range(reflect, good, tmp_path):
    for backend in ("numpy", "gpu"):
        out = tmp_path / backend
        arguments = ("--size", "1x1", "--samples", 1, "--frame", 99999, "--backend", backend)
        reflect.works("evaluate", good, "--out", out, *BAKE, *arguments)
        for row in read_rows(out):
            assert (row.pixels, row.size, row.frame, row.nonfinite) == (1, "1x1", 99999, 0)
    reflect.works("render", good, "--out", tmp_path / "p.exr", "--method", "billboards", "--size", "1x1", "--samples", 1, *TINY)
    for frame in ("9999999", "1.5", "now", "1e3"):
        for verb in ("render", "evaluate"):
            arguments = (*VERBS[verb](tmp_path / "new"), f"--frame={frame}")
            result = reflect(verb, good, *arguments)
            assert result.status == 2 and "1048574" in result.err and not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    "setting, says",
    [
        ("texel=16", ("no setting 'texel'", "There are: ", " surface_triangles, texels")),
        ("texels=17", ("texels cannot be 17", "power of two")),
        ("texels=-16", ("texels cannot be -16", "whole number")),
        ("samples=0", ("samples cannot be 0", "whole number")),
        ("resolution=100", ("resolution cannot be 100", "power of two")),
        ("resolution=16384", ("resolution cannot be 16384", "power of two from 4 to 8192")),
        ("resolution=1e300", ("resolution cannot be 1e+300", "whole number")),
        ("samples=many", ("samples cannot be 'many'", "whole number")),
        ("samples=NaN", ("samples cannot be nan", "whole number")),
    ],
)
def test_settings_without_sense(reflect, good, tmp_path, setting, says):
    for verb in ("bake", "render", "evaluate"):
        arguments = [a for a in VERBS[verb](tmp_path / "out") if a not in TINY_ALL]
        reflect.refuses(verb, good, *arguments, "--set", setting, says=says, keeps=[tmp_path])


def test_a_file_saved_in_edit_mode(reflect, tmp_path):
    """Blender fills the mesh of an edited object without modifiers only on request."""
    empty_stage()
    bpy.context.view_layer.objects.active = ball()
    bpy.ops.object.mode_set(mode="EDIT")
    blend = save(tmp_path / "edit.blend")
    assert "Ball: " in reflect.works("analyse", blend).out and bpy.context.mode == "EDIT_MESH"
    reflect.works("evaluate", blend, *VERBS["evaluate"](tmp_path / "out"))
    assert all(r.pixels > 50 and r.nonfinite == 0 for r in read_rows(tmp_path / "out"))


def test_linked_from_a_library(reflect, tmp_path):
    """Objects and their collection belong to another file, which stays as it is; without that file a sentence names it."""
    scene = empty_stage()
    group = bpy.data.collections.new("Things")
    obj = ball("Linked Ball")
    scene.collection.objects.unlink(obj)
    group.objects.link(obj)
    group.use_fake_user = True
    library = save(tmp_path / "library.blend")
    scene = empty_stage()
    with bpy.data.libraries.load(str(library), link=True) as (_, into):
        into.collections = ["Things"]
    scene.collection.children.link(bpy.data.collections["Things"])
    blend = save(tmp_path / "user.blend")
    before = contents(tmp_path)
    assert "Linked Ball" in reflect.works("analyse", blend).out
    for verb in ("bake", "render", "evaluate", "evaluate numpy"):
        reflect.works(verb, blend, *VERBS[verb](tmp_path / "out" / verb))
    assert all(r.pixels > 50 and r.nonfinite == 0 for r in read_rows(tmp_path / "out" / "evaluate"))
    assert {k: v for k, v in contents(tmp_path).items() if k in before} == before
    library.rename(tmp_path / "elsewhere.blend")
    bpy.ops.wm.read_factory_settings(use_empty=True)  # else the file counts as open
    for verb in ("bake", "render", "evaluate"):
        result = reflect.refuses(verb, blend, *VERBS[verb](tmp_path / "new"), says="has no reflector", keeps=[tmp_path])
        assert str(library) in result.err and "is missing" in result.err


def test_clipping_planes_hold_for_both_backends(reflect, tmp_path):
    """What the camera's clipping planes cut away is in neither backend's rays, whether it mirrors or hides."""
    empty_stage()
    ball("Far", (0, 40, 1.2), 8)
    ball("Near", (0, -5.5, 1.9), 0.2).data.materials.clear()
    bpy.data.objects["Camera"].data.clip_start, bpy.data.objects["Camera"].data.clip_end = 2, 30
    blend = save(tmp_path / "clipped.blend")
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    for clip_end, far_is_seen in ((30, False), (100, True)):
        bpy.data.objects["Camera"].data.clip_end = clip_end
        count = {}
        for backend in ("numpy", "gpu"):
            out = tmp_path / f"{clip_end} {backend}"
            arguments = ("--methods", "environment", *FRAME, *TINY[:4], "--backend", backend)
            reflect.works("evaluate", blend, "--out", out, *arguments)
            count[backend] = read_rows(out)[0].pixels
        assert count["gpu"] == count["numpy"] and (count["gpu"] > 20) == far_is_seen, count
