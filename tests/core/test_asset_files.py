"""Assets on disk: what is saved comes back equal; a failure costs nothing (what is wrong there: test_asset_damage.py)."""

import dataclasses
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from reflect_addon.core import asset_files
from reflect_addon.core.asset import Asset, Part
from reflect_addon.core.asset_files import asset_folder, is_fresh, load_asset, save_asset
from reflect_addon.core.asset_places import file_name
from reflect_addon.core.errors import ReflectError

ROOT = Path(__file__).resolve().parents[2]


MATRIX = tuple(float(np.float32(k / 7)) for k in range(16))


def example(value: float = 1.0, side: int = 5) -> Asset:
    base = np.arange(side * 3 * 4, dtype=np.float32).reshape(side, 3, 4)
    return Asset(
        kind="billboards",
        reflector="Suzanne",
        images={"radiance_tx": (base * value).astype(np.float16), "quads_buf": base + value},
        uniforms={"scale": 2.0 * value, "centre": (0.1, -1e9, 3.0)},
        options={"count": 7, "shared": True, "mode": "flat", "share": 0.5},
        settings={"resolution": 128, "sizes": (1, 2), "nested": {"a": None}},
        requires=("environment",),
        inputs_hash="ab" * 32,
        source="trace",
        bake_seconds=1.25,
        parts=(Part("Suzanne", "reflector", -1, MATRIX, "ef" * 20), Part("Täfel/2", "flat", 0, MATRIX[::-1], "")),
        light_hash="cd" * 32,
        items={"shape": {"Suzanne": "0123456789ab", "Täfel/2": "ff"}, "world": {"": "ab"}},
        balls={"Suzanne": (0.1, -2.0, 3e9, 0.5)},
    )


def assert_equal(a: Asset, b: Asset):
    assert dataclasses.replace(a, images={}) == dataclasses.replace(b, images={})
    assert a.images.keys() == b.images.keys()
    for name in a.images:
        assert a.images[name].dtype == b.images[name].dtype
        np.testing.assert_array_equal(a.images[name], b.images[name])


def edit(folder: Path, change):
    """Applies change(document) to asset.json; with the checksums as they are."""
    path = folder / "asset.json"
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))


def test_round_trip(tmp_path):
    folder = save_asset(example(), tmp_path / "a" / "billboards-Suzanne")
    assert_equal(load_asset(folder), example())
    assert sorted(p.name.partition("-")[0] for p in folder.iterdir()) == ["asset.json", "quads_buf", "radiance_tx"]
    assert [p.name for p in folder.parent.iterdir()] == ["billboards-Suzanne"], "a temporary folder stayed behind"


@settings(max_examples=30, deadline=None, derandomize=True)
@given(
    image=hnp.arrays(np.float32, st.tuples(st.integers(1, 9), st.integers(1, 9), st.just(4))),
    reflector=st.text(max_size=20),
    uniform=st.floats(-1e30, 1e30),
)
def test_any_values_round_trip(image, reflector, uniform):
    with tempfile.TemporaryDirectory() as scratch, np.errstate(over="ignore"):
        asset = Asset("environment", reflector, {"a_buf": image, "b_tx": image.astype(np.float16)}, {"u": uniform})
        assert_equal(load_asset(save_asset(asset, Path(scratch) / "x")), asset)


def test_an_asset_from_before_there_were_parts_loads(tmp_path):
    folder = save_asset(example(), tmp_path / "a")
    edit(folder, lambda d: [d.pop(name) for name in ("parts", "light_hash", "items", "balls")])
    assert_equal(load_asset(folder), dataclasses.replace(example(), parts=(), light_hash="", items={}, balls={}))


def test_numpy_reads_the_files(tmp_path):
    folder = save_asset(example(), tmp_path / "a")
    table = json.loads((folder / "asset.json").read_text())["arrays"]
    for name, entry in table.items():
        array = np.load(folder / entry["file"], allow_pickle=False)
        np.testing.assert_array_equal(array, example().images[name])
        assert (array.dtype.name, list(array.shape)) == (entry["dtype"], entry["shape"])


def test_replacing_leaves_only_the_new_files(tmp_path):
    folder = save_asset(example(1.0), tmp_path / "a")
    (folder / "note.txt").write_text("the user's own")
    save_asset(example(2.0), folder)
    assert_equal(load_asset(folder), example(2.0))
    assert len(list(folder.iterdir())) == 4 and (folder / "note.txt").exists()


@pytest.mark.parametrize(
    "wrong",
    [
        {"images": {"radiance": np.zeros((2, 2, 4), np.float16)}},
        {"images": {"radiance_tx": np.zeros((2, 2, 4), np.float32)}},
        {"images": {"radiance_tx": np.zeros((2, 2, 3), np.float16)}},
        {"images": {"../radiance_tx": np.zeros((2, 2, 4), np.float16)}},
        {"uniforms": {"scale": float("nan")}},
        {"uniforms": {"scale": (1.0,) * 5}},
        {"options": {"count": [1, 2]}},
        {"settings": {"thing": object()}},
        {"kind": "../environment"},
        {"parts": (Part("a", "flat", 0, MATRIX[:15], ""),)},
        {"parts": (Part("a", "flat", -2, MATRIX, ""),)},
        {"parts": (Part("a", "flat", 0, (float("inf"),) * 16, ""),)},
        {"light_hash": 3},
        {"items": {"shape": {"a": "no hash"}}},
        {"balls": {"a": (0.0, 0.0, float("nan"), 1.0)}},
    ],
)
def test_an_asset_against_the_rules_is_not_written(tmp_path, wrong):
    with pytest.raises(ValueError):
        save_asset(dataclasses.replace(example(), **wrong), tmp_path / "a")
    assert list(tmp_path.iterdir()) == []


def test_freshness():
    assert is_fresh(example(), "ab" * 32)
    assert not is_fresh(example(), "cd" * 32)
    assert not is_fresh(dataclasses.replace(example(), inputs_hash=""), "")


# --- failures while writing


WRITER = """
import sys
sys.path[:0] = [{root!r}, {tests!r}]
from test_asset_files import example
from reflect_addon.core.asset_files import save_asset
print("ready", flush=True)
k = 2
while True:
    save_asset(example(float(k % 5 + 1), side=400), {folder!r})
    k += 1
"""


@pytest.mark.skipif(os.name != "posix", reason="kill -9 is POSIX")
def test_kill_9_leaves_a_whole_asset(tmp_path, rng):
    folder = save_asset(example(1.0, side=400), tmp_path / "a")
    script = WRITER.format(root=str(ROOT), tests=str(Path(__file__).parent), folder=str(folder))
    for _ in range(8):
        process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE)
        process.stdout.readline()
        time.sleep(rng.uniform(0.0, 0.2))
        process.kill()
        process.wait()
        loaded = load_asset(folder)
        assert_equal(loaded, example(loaded.uniforms["scale"] / 2.0, side=400))
    save_asset(example(1.0), folder)
    assert [p.name for p in tmp_path.iterdir()] == ["a"], "a dead writer's temporary folder stayed behind"
    assert len(list(folder.iterdir())) == 3


@pytest.mark.parametrize("step", ["mkdir", "write", "fsync", "replace"])
@pytest.mark.parametrize("earlier", [False, True])
def test_a_failing_disk_leaves_the_earlier_asset(tmp_path, monkeypatch, step, earlier):
    folder = tmp_path / "a"
    if earlier:
        save_asset(example(1.0), folder)

    def fail(*_args, **_kwargs):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        match step:
            case "mkdir":
                patch.setattr(Path, "mkdir", fail)
            case "write":
                patch.setattr(asset_files, "_write", fail)
            case "fsync":
                patch.setattr(os, "fsync", fail)
            case "replace":
                patch.setattr(os, "replace", fail)
                patch.setattr(os, "rename", fail)
        with pytest.raises(ReflectError, match="No space left"):
            save_asset(example(2.0), folder)
    assert [p.name for p in tmp_path.iterdir()] == (["a"] if earlier else [])
    if earlier:
        assert_equal(load_asset(folder), example(1.0))


def test_a_full_disk(tmp_path):
    """A real one: 1 MB of tmpfs."""
    if os.name != "posix" or os.geteuid() != 0:
        pytest.skip("SKIPPED: a full disk needs root to mount a tmpfs of 1 MB")
    place = tmp_path / "disk"
    place.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", place], capture_output=True).returncode:
        pytest.skip("SKIPPED: tmpfs cannot be mounted here")
    try:
        folder = save_asset(example(1.0), place / "a")
        with pytest.raises(ReflectError, match="No space left"):
            save_asset(dataclasses.replace(example(), images={"a_buf": np.ones((512, 512, 4), np.float32)}), folder)
        assert_equal(load_asset(folder), example(1.0))
        assert [p.name for p in place.iterdir()] == ["a"]
    finally:
        subprocess.run(["umount", place], check=True)


def test_a_folder_without_permission(tmp_path):
    """A file stands where a folder should be: refused for root too, unlike permission bits."""
    (tmp_path / "reflect").write_text("")
    with pytest.raises(ReflectError, match="could not be written"):
        save_asset(example(), tmp_path / "reflect" / "a")


def test_another_running_process_keeps_its_temporary_folder(tmp_path):
    from reflect_addon.core.processes import signature

    host = signature().partition("-")[2]
    running = tmp_path / f".reflect-{os.getppid()}-{host}-00"
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    left = tmp_path / f".reflect-{dead.pid}-{host}-00"
    elsewhere = tmp_path / f".reflect-{dead.pid}-{host}x-00"
    old = tmp_path / f".reflect-{dead.pid}-{host}x-01"
    for path in (running, left, elsewhere, old):
        path.mkdir()
    os.utime(old, (0, 0))
    save_asset(example(), tmp_path / "a")
    assert {p.name for p in tmp_path.iterdir()} == {"a", running.name, elsewhere.name}


# --- names


def test_folders_lie_beside_the_file(tmp_path):
    blend = tmp_path / "house.blend"
    assert asset_folder(blend, "Scene", "box_proxy", "Ball.001") == tmp_path / "reflect/Scene/box_proxy-Ball.001"
    assert asset_folder(blend, "Scene", "environment", "").name == "environment-all"
    assert asset_folder(None, "Scene", "environment", "", tmp_path) == tmp_path / "unsaved/Scene/environment-all"


NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=63) | st.sampled_from(
    ["Con", "nul", "LPT1.txt", "..", ".", "a/b", "a\\b", "A.", "A ", "all", "All", "cube", "Cube", "CUBE", "x" * 255]
)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(a=NAMES, b=NAMES)
def test_names_are_safe_and_differ(a, b):
    for name in (file_name(a), file_name(b)):
        assert name.isascii() and not set(name) & set('<>:"/\\|?*') and name.isprintable() and len(name) <= 80
        assert name not in (".", "..") and name[-1] not in ". " and name.partition(".")[0].lower() not in ("con", "nul")
    assert a == b or file_name(a).lower() != file_name(b).lower()
