"""Bad assets, bad disks and bad places through the command line: what was there before is still there, and whole."""

import json
import os
import shutil

import pytest
from bad_input import BAKE, FRAME, TINY, VERBS, ball, contents, disk, empty_stage, good, reflect, save  # noqa: F401

from reflect_addon.core import methods as registry
from reflect_addon.core.asset_files import load_asset
from reflect_addon.evaluation.rows import read_rows

ENVIRONMENT = ("--methods", "environment", *TINY[:4])


@pytest.fixture(scope="module")
def baked(tmp_path_factory):
    """A folder with good.blend and the environment of its ball, to be copied."""
    from reflect_addon import cli

    home = tmp_path_factory.mktemp("baked") / "home"
    empty_stage()
    ball()
    assert cli.main(["bake", str(save(home / "good.blend", compress=False)), *ENVIRONMENT]) == 0
    return home


@pytest.fixture
def home(baked, tmp_path):
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    return shutil.copytree(baked, tmp_path / "home")


def asset_of(home):
    return home / "reflect" / "Scene" / "environment-Ball"


def image_of(home):
    return next(asset_of(home).glob("*.npy"))


def edit(home, **values):
    path = asset_of(home) / "asset.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | values))


DAMAGE = {
    "image missing": (lambda h: image_of(h).unlink(), "is missing"),
    "image truncated": (lambda h: os.truncate(image_of(h), 500), "is cut short"),
    "image foreign": (lambda h: image_of(h).write_bytes(b"GIF89a" * 9999), "is too large"),
    "json truncated": (lambda h: os.truncate(asset_of(h) / "asset.json", 300), "not valid JSON"),
    "json empty": (lambda h: (asset_of(h) / "asset.json").write_text(""), "not valid JSON"),
    "json foreign": (lambda h: (asset_of(h) / "asset.json").write_text('{"asset": {"version": "2.0"}}'), "not a Reflect asset"),
    "newer format": (lambda h: edit(h, format=2), "made by a newer Reflect"),
    "without images": (lambda h: edit(h, arrays={}), "lacks what environment needs"),
    "without numbers": (lambda h: edit(h, uniforms={}), "lacks what environment needs"),
    "other kind": (lambda h: edit(h, kind="billboards"), "is an asset of billboards"),
    "unknown kind": (lambda h: edit(h, kind="magic"), "is an asset of magic"),
}


@pytest.mark.parametrize("case", DAMAGE)
def test_a_damaged_asset(reflect, home, tmp_path, case):
    """Whoever only reads says which file and what to do; whoever may bake makes it good."""
    spoil, words = DAMAGE[case]
    spoil(home)
    blend, folder = home / "good.blend", home / "reflect" / "Scene"
    says = (words, "environment-Ball", "ake again" if case == "newer format" else "ake")
    reflect.refuses("shader", blend, "--method", "environment", says=says, keeps=[home])
    arguments = ("--method", "environment", *FRAME, "--out", tmp_path / "p.png", "--assets", folder)
    reflect.refuses("render", blend, *arguments, says=says, keeps=[tmp_path])
    found = reflect.works("analyse", blend).out
    assert "environment: unreadable" in found and words in found
    before = blend.read_bytes()
    reflect.works("bake", blend, *ENVIRONMENT)
    assert load_asset(asset_of(home)).kind == "environment" and blend.read_bytes() == before
    reflect.works("render", blend, *arguments)


# What box_proxy's assets had before boxes could be turned and open, and what could stand there instead.
OLDER = {
    "axes and rims missing": (("box_x", "box_y", "box_z", "box_rim_low", "box_rim_high"), {}, {}),
    "rims missing": (("box_rim_low", "box_rim_high"), {}, {"turned": True, "open": True}),
    "another type": ((), {"box_low": [1.0, 2.0, 3.0, 4.0]}, {"turned": True, "open": True}),
}


@pytest.mark.parametrize("case", OLDER)
def test_an_asset_from_before_its_method_changed(reflect, home, tmp_path, case):
    """Whole, and of a format that is read, but not what the kernel asks for: the same sentence, and baked again."""
    missing, uniforms, options = OLDER[case]
    blend, folder = home / "good.blend", home / "reflect" / "Scene"
    bake = ("--methods", "box_proxy", *TINY[:4])
    reflect.works("bake", blend, *bake)
    path = folder / "box_proxy-Ball" / "asset.json"
    now = json.loads(path.read_text())
    kept = {k: v for k, v in now["uniforms"].items() if k not in missing}
    older = json.dumps(now | {"uniforms": kept | uniforms, "options": options})
    path.write_text(older)
    says = ("box_proxy-Ball lacks what box_proxy needs", "Bake it again.")
    reflect.refuses("shader", blend, "--method", "box_proxy", says=says, keeps=[home])
    arguments = ("--method", "box_proxy", *FRAME, "--out", tmp_path / "p.png", "--assets", folder)
    reflect.refuses("render", blend, *arguments, says=says, keeps=[tmp_path])
    assert "box_proxy: unreadable" in reflect.works("analyse", blend).out
    out = tmp_path / "out"  # where evaluate keeps what it bakes with settings of its own
    reflect.works("evaluate", blend, *bake, "--out", out, *FRAME, "--backend", "numpy")
    reflect.works("bake", blend, *bake)
    for made in (path, next(out.rglob("box_proxy-Ball/asset.json"))):
        again = json.loads(made.read_text())
        assert (again["uniforms"], again["options"]) == (now["uniforms"], now["options"])


def test_no_asset_at_all(reflect, home, tmp_path):
    blend = home / "good.blend"
    for missing in (tmp_path / "nowhere", home):
        says = ("has no environment asset of Ball", "reflect bake")
        arguments = ("--method", "environment", *FRAME, "--out", tmp_path / "p.png", "--assets", missing)
        reflect.refuses("render", blend, *arguments, says=says, keeps=[tmp_path])
        says = ("No asset of environment was found", "reflect bake")
        reflect.refuses("shader", blend, "--method", "environment", "--assets", missing, says=says, keeps=[tmp_path])


def test_results_that_are_none(reflect, home, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    for content, words in [(None, "There is no"), ("", "not valid JSON"), ('{"format": 1}', '"rows"'), ("[1]", '"rows"'),
                           ('{"format": 2, "rows": []}', "format 2"), ('{"format": 1, "rows": []}', "no rows"),
                           ('{"format": 1, "rows": [{"scene": 3}]}', "row 1")]:  # fmt: skip
        if content is not None:
            (out / "results.json").write_text(content)
        reflect.refuses("report", out, "--out", tmp_path / "page", says=(words, str(out)), keeps=[tmp_path])


# --- disks


def test_a_full_disk(reflect, home, tmp_path):
    """1 MB: too little for what each verb writes, enough for an earlier small asset, which stays."""
    place = tmp_path / "disk"
    blend = home / "good.blend"
    with disk(place, "size=1m"):
        earlier = shutil.copytree(asset_of(home), place / "environment-Ball")
        large = ("--methods", "environment", "--resolution", 256, "--set", "samples=1")
        says = ("could not be written", str(place), "No space left", "ake room")
        reflect.refuses("bake", blend, *large, "--out", place, "--again", says=says, keeps=[tmp_path])
        assert load_asset(earlier).settings["resolution"] == 16
        arguments = ("--method", "environment", "--assets", place, "--size", "400x400", "--samples", 1, "--out", place / "p.exr")
        (place / "p.exr").write_text("an earlier picture")
        says = ("could not be written", str(place), "Free some disk space")
        reflect.refuses("render", blend, *arguments, says=says, keeps=[tmp_path])
        arguments = ("--methods", "environment", *TINY[:4], "--size", "300x300", "--samples", 1, "--backend", "numpy")
        reflect.refuses("evaluate", blend, *arguments, "--out", place, says=says, keeps=[tmp_path])
        with (place / "filler").open("wb") as filler:
            try:
                while filler.write(bytes(1 << 12)):
                    filler.flush()
            except OSError:
                pass
        for verb in ("bake", "render", "evaluate"):
            reflect.refuses(verb, blend, *VERBS[verb](place), says=says, keeps=[tmp_path])


def test_a_full_temporary_folder(reflect, home, tmp_path, monkeypatch):
    place = tmp_path / "disk"
    with disk(place, "size=300k") as remount:
        monkeypatch.setenv("REFLECT_TEMP", str(place))
        large = ("--methods", "environment", "--resolution", 128, "--set", "samples=1", "--out", tmp_path / "new")
        says = ("could not be written", str(place), "TMPDIR")  # the rays
        reflect.refuses("bake", home / "good.blend", *large, says=says, keeps=[tmp_path])
        remount("size=120k")  # the rays have room, what Cycles makes of them has none
        small = (*ENVIRONMENT, "--out", tmp_path / "new")
        reflect.refuses("bake", home / "good.blend", *small, says=(str(place), "TMPDIR"), keeps=[tmp_path])


def test_a_read_only_disk(reflect, baked, tmp_path):
    """Analysing needs no writing; evaluating and drawing put their assets into the output."""
    place = tmp_path / "disk"
    with disk(place, "size=4m") as remount:
        shutil.copytree(baked, place / "home")
        shutil.rmtree(place / "home" / "reflect")
        remount("ro")
        blend = place / "home" / "good.blend"
        assert "not baked" in reflect.works("analyse", blend).out
        says = (str(place / "home" / "reflect"), "Read-only file system", "--out")
        reflect.refuses("bake", blend, *ENVIRONMENT, says=says, keeps=[tmp_path])
        reflect.refuses("shader", blend, "--method", "environment", says="No asset of environment", keeps=[tmp_path])
        for verb in ("bake", "render", "evaluate", "evaluate numpy"):
            says = ("could not be written", str(place / "out"), "Read-only file system", "--out")
            reflect.refuses(verb, blend, *VERBS[verb](place / "out"), says=says, keeps=[tmp_path])
            out = tmp_path / "out" / verb
            reflect.works(verb, blend, *VERBS[verb](out))
            assert list(out.rglob("billboards-Ball/asset.json")), "the assets are in the output"
        rows = read_rows(tmp_path / "out" / "evaluate")
        assert len(rows) == len(registry.names()) and all(r.nonfinite == 0 for r in rows)


@pytest.mark.skipif(os.name != "posix", reason="permissions are POSIX")
def test_no_permission(good, tmp_path):
    """As another user, for whom permissions count even when root runs the tests."""
    import subprocess
    import sys
    from pathlib import Path

    if os.geteuid() != 0:
        pytest.skip("SKIPPED: becoming another user needs root")
    probe = (
        "import os, sys\n"
        f"sys.path.insert(0, {str(Path(__file__).resolve().parents[2])!r})\n"
        "from reflect_addon.core.safe_write import check_folder, check_writable, write_whole\n"
        "from reflect_addon.core.bake_lock import BakeLock\nfrom reflect_addon.core.errors import ReflectError\n"
        "from pathlib import Path\nplace = Path(sys.argv[1])\n"
        "os.setgroups([]); os.setgid(65534); os.setuid(65534)\n"
        "for do in (lambda: check_folder(place / 'a' / 'b'), lambda: check_writable(place / 'p.png'),\n"
        "           lambda: write_whole(place / 'p.png', b'x'), lambda: BakeLock(place / 'c').__enter__()):\n"
        "    try: do()\n"
        "    except ReflectError as error: print(error)\n"
    )
    place = tmp_path / "theirs"
    place.mkdir(mode=0o755)
    done = subprocess.run([sys.executable, "-c", probe, place], capture_output=True, text=True, timeout=60)
    assert done.stdout.count("Permission denied") == 4 and not list(place.iterdir()), done.stderr + done.stdout


# --- places


def test_outputs_that_are_something_else(reflect, home, tmp_path):
    """A folder where a file is to be, a file where a folder is to be: known before any work, and left alone."""
    blend = home / "good.blend"
    (tmp_path / "file").write_text("a file")
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "folder.png" / "kept").write_text("the user's")
    for verb in ("bake", "evaluate", "evaluate numpy"):
        for out in (tmp_path / "file", tmp_path / "file" / "below"):
            says = ("could not be written", str(out), "--out")
            result = reflect.refuses(verb, blend, *VERBS[verb](out), says=says, keeps=[tmp_path])
            assert "%" not in result.err, "it worked before it looked"
    arguments = ("--method", "environment", *FRAME)
    says = ("is a folder", "folder.png", "--out")
    reflect.refuses("render", blend, *arguments, "--out", tmp_path / "folder.png", says=says, keeps=[tmp_path])
    says = ("could not be written", "file/p.png", "--out")
    reflect.refuses("render", blend, *arguments, "--out", tmp_path / "file" / "p.png", says=says, keeps=[tmp_path])
    result = reflect("render", blend, *arguments, "--out", tmp_path / "p.jpg")
    assert result.status == 2 and ".png or .exr" in result.err


def test_an_existing_picture_is_replaced_whole(reflect, home, tmp_path):
    for name in ("p.png", "p.exr"):
        (tmp_path / name).write_text("old")
        reflect.works("render", home / "good.blend", "--method", "environment", *FRAME, *TINY[:4], "--out", tmp_path / name)
        assert (tmp_path / name).stat().st_size > 100
    assert {p.name for p in tmp_path.iterdir()} == {"home", "p.png", "p.exr", "assets"}
