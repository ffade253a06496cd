"""What the tests of bad input share: the command line in this process, watched for everything that it may not leave
behind; small scenes; a disk that is full or read-only."""

import hashlib
import os
import subprocess
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import bpy
import pytest

from reflect_addon.evaluation import evaluate

# Small enough for many runs, and every method.
TINY = ("--resolution", "16", "--set", "samples=1", "--set", "texels=16")
TINY_ALL = (*TINY, "--set", "views=2", "--set", "view_texels=16", "--set", "map_texels=16",
            "--set", "surface_levels=1", "--set", "surface_samples=1", "--set", "surface_noise=0.0")  # for all methods together
BAKE = ("--methods", "all", *TINY_ALL)
FRAME = ("--size", "24x24", "--samples", "1")
# What bad input does to each verb that opens a scene; the output comes first.
VERBS = {
    "bake": lambda out: ("--out", out, *BAKE),
    "render": lambda out: ("--out", out / "picture.png", "--method", "billboards", *FRAME, *TINY),
    "evaluate": lambda out: ("--out", out, *FRAME, *BAKE),
    "evaluate numpy": lambda out: ("--out", out, *FRAME, *BAKE, "--backend", "numpy"),
    "shader": lambda out: ("--assets", out, "--method", "environment"),
}


class Result(NamedTuple):
    status: int
    out: str
    err: str


class CommandLine:
    """Runs verbs in this process and checks what holds for every run, well or badly ended."""

    def __init__(self, capfd, scratch: Path):
        self._capfd, self._scratch = capfd, scratch

    def __call__(self, verb, *arguments) -> Result:
        from reflect_addon import cli

        self._capfd.readouterr()
        try:
            status = cli.main([verb.split()[0], *map(str, arguments)])
        except SystemExit as end:
            status = end.code
        result = Result(status, *self._capfd.readouterr())
        assert "Traceback" not in result.err + result.out, result.err
        left = [p.name for p in self._scratch.iterdir() if not p.name.startswith("blender_")]  # Blender's, while it runs
        assert not left, "temporary files stayed behind"
        return result

    def works(self, verb, *arguments) -> Result:
        result = self(verb, *arguments)
        assert result.status == 0, result.err
        return result

    def refuses(self, verb, *arguments, says, status=1, keeps=()) -> Result:
        """Ends with the status and a last line that holds each of `says`; nothing on standard output; nothing below
        `keeps` was added, removed or changed."""
        before = contents(*keeps)
        result = self(verb, *arguments)
        last = sentence(result)
        assert result.status == status, result.err
        for words in [says] if isinstance(says, str) else says:
            assert words in last, f"{verb}: {words!r} is not in: {last}"
        assert f"{verb.split()[0]} failed: " not in last, f"an error that nobody thought of: {last}"
        assert not result.out, f"on standard output: {result.out}"
        after = contents(*keeps)
        assert after == before, f"changed: {sorted(set(after.items()) ^ set(before.items()))}"
        return result


def sentence(result: Result) -> str:
    """What the person reads: the message and its remedy."""
    lines = [line for line in result.err.splitlines() if line.startswith("reflect")]
    assert lines, f"nothing was said: {result.err}"
    return lines[-1]


def contents(*folders: Path) -> dict[str, str]:
    """Path -> checksum of every file and link, "" for a folder."""
    found = {}
    for folder in folders:
        for path in (folder, *sorted(folder.rglob("*"))):
            found[str(path)] = hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
    return found


@pytest.fixture
def reflect(capfd, tmp_path_factory, monkeypatch):
    """The command line with a scratch folder of its own for temporary files. `evaluate` takes its times once: they are not
    what bad input is about, and kernels in NumPy take seconds."""
    scratch = tmp_path_factory.mktemp("scratch")
    for name in ("TMPDIR", "REFLECT_TEMP"):
        monkeypatch.setenv(name, str(scratch))
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setattr(evaluate, "TIMED", {"turns": 1, "frames": 1})
    return CommandLine(capfd, scratch)


# --- scenes


def empty_stage(world=(0.4, 0.5, 0.6)):
    """A fresh file with a world, a lamp and a camera that looks at (0, 0, 1)."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return stage(world)


def stage(world=(0.4, 0.5, 0.6)):
    """The same for the file that is open."""
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (*world, 1)
    for name, data, place, turn in (
        ("Camera", bpy.data.cameras.new("Camera"), (0, -6, 2), (1.45, 0, 0)),
        ("Sun", bpy.data.lights.new("Sun", "SUN"), (0, 0, 5), (0.5, 0.3, 0)),
    ):
        obj = bpy.data.objects.new(name, data)
        scene.collection.objects.link(obj)
        obj.location, obj.rotation_euler = place, turn
    scene.camera = scene.objects["Camera"]
    return scene


def mirror():
    material = bpy.data.materials.new("Mirror")
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Metallic"].default_value, shader.inputs["Roughness"].default_value = 1.0, 0.0
    return material


def ball(name="Ball", place=(0, 0, 1.2), radius=1.0):
    """A mirror ball, made without operators: they depend on the mode that a file was saved in."""
    import bmesh

    mesh = bpy.data.meshes.new("Ball")
    form = bmesh.new()
    bmesh.ops.create_uvsphere(form, u_segments=16, v_segments=8, radius=radius)
    form.to_mesh(mesh)
    form.free()
    mesh.shade_smooth()
    mesh.materials.append(mirror())
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    obj.location = place
    return obj


def save(path: Path, **options) -> Path:
    """Saves what was built and closes it, so that the command line reads it from the disk."""
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), **options)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return path


@pytest.fixture
def good(tmp_path):
    """A .blend that works, in a folder of its own."""
    empty_stage()
    ball()
    return save(tmp_path / "home" / "good.blend")


# --- disks


@contextmanager
def disk(place: Path, options: str):
    """A tmpfs on the folder for the length of the block; yields a function that mounts it again with other options."""
    if os.name != "posix" or os.geteuid() != 0:
        pytest.skip("SKIPPED: disks of our own need root to mount a tmpfs")
    place.mkdir(exist_ok=True)
    if subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", place], capture_output=True).returncode:
        pytest.skip("SKIPPED: tmpfs cannot be mounted here")
    try:
        yield lambda again: subprocess.run(["mount", "-o", f"remount,{again}", place], check=True)
    finally:
        bpy.ops.wm.read_factory_settings(use_empty=True)  # no open file on it
        subprocess.run(["umount", place], check=True)
