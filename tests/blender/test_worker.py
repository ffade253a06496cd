"""The bake worker: watched without waiting, cancelled, crashed, garbled; the user's file stays as it is."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from reflect_addon.core.bake_lock import BakeLock
from reflect_addon.core.errors import Cancelled, ReflectError

ROOT = Path(__file__).resolve().parents[2]
PRELUDE = "import json, os, signal, subprocess, sys, time\ndef say(**e): print(json.dumps(e), flush=True)\n"


def run(script: str):
    """A worker that runs the script, and its scratch folder."""
    from reflect_addon.scene.worker import Worker

    scratch = Path(tempfile.mkdtemp(prefix="reflect-test-"))
    return Worker([sys.executable, "-c", PRELUDE + script], scratch), scratch


def wait_for(worker, message, seconds=20.0):
    end = time.monotonic() + seconds
    while worker.poll().message != message:
        assert time.monotonic() < end and worker.state.running, worker.state
        time.sleep(0.01)


def is_running(pid: int) -> bool:
    """Not dead and not a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_progress_then_done():
    worker, scratch = run(
        "say(progress=0.25, message='one'); sys.stdin.read(); time.sleep(.3); say(progress=1e9, message='two')\n"
        "open(os.path.join(os.environ['TMPDIR'], 'x'), 'w'); say(done=['/a', '/b'])"
    )
    wait_for(worker, "one")
    assert worker.state.fraction == 0.25
    state = worker.wait(20)
    assert (state.fraction, state.folders, state.error, state.running) == (1.0, ("/a", "/b"), None, False)
    assert not scratch.exists()


@pytest.mark.alone
def test_poll_returns_at_once():
    worker, _ = run("say(progress=0, message='up'); time.sleep(60)")
    wait_for(worker, "up")
    start = time.perf_counter()
    for _ in range(200):
        worker.poll()
    assert time.perf_counter() - start < 0.5
    assert isinstance(worker.stop().error, Cancelled)


def test_an_error_keeps_its_words():
    state = run("say(error='Box has no faces.', remedy='Give it some.'); sys.exit(1)")[0].wait(20)
    assert (state.error.message, state.error.remedy) == ("Box has no faces.", "Give it some.")


@pytest.mark.parametrize(
    "script, words",
    [
        ("sys.stderr.write('out of memory\\n'); sys.exit(3)", "status 3: out of memory"),
        ("raise KeyError('teapot')", "status 1: KeyError: 'teapot'"),
        ("sys.exit(2)", "status 2."),
        ("say(done=3)", "without saying what it made"),
        ("import nonsense_module", "No module named 'nonsense_module'"),
    ],
)
def test_a_failure_is_one_sentence(script, words):
    error = run(script)[0].wait(20).error
    assert words in error.message and "\n" not in str(error) and error.remedy


@pytest.mark.skipif(os.name != "posix", reason="signals are POSIX")
def test_a_crash_names_the_signal():
    worker, scratch = run("say(progress=.5, message='half'); os.kill(os.getpid(), signal.SIGSEGV)")
    state = worker.wait(20)
    assert "signal 11" in state.error.message and state.fraction == 0.5 and not scratch.exists()


def test_garbage_is_ignored():
    worker, _ = run(
        "o = sys.stdout.buffer; o.write(bytes(range(256)) * 400 + b'\\n{\\n{\"progress\": \"x\"}\\n{\"progress\": NaN}\\n');"
        "o.write(b'[1]\\n{\"progress\": 0.5, \"message\": 7}\\n' + b'{' * 200000 + b'\\n{\"done\": []}\\n'); o.flush()\n"
        "sys.stderr.buffer.write(b'\\xff' * 500000)"
    )
    state = worker.wait(20)
    assert (state.fraction, state.folders, state.error) == (1.0, (), None)


@pytest.mark.alone
@pytest.mark.skipif(os.name != "posix", reason="process groups are POSIX")
def test_cancel_ends_the_whole_group(monkeypatch):
    from reflect_addon.scene import worker as module

    monkeypatch.setattr(module, "GRACE", 0.3)
    worker, scratch = run(
        "signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "child = subprocess.Popen([sys.executable, '-c', 'import signal, time; signal.signal(15, signal.SIG_IGN);"
        " print(1, flush=True); time.sleep(60)'], stdout=subprocess.PIPE); child.stdout.readline()\n"
        "say(progress=0, message=str(child.pid)); time.sleep(60)"
    )
    while not worker.poll().message.isdigit():
        time.sleep(0.01)
    child = int(worker.state.message)
    start = time.perf_counter()
    worker.cancel()
    assert time.perf_counter() - start < 0.1, "cancel waited"
    state = worker.wait(20)
    assert isinstance(state.error, Cancelled) and not scratch.exists()
    end = time.monotonic() + 5
    while is_running(child) and time.monotonic() < end:
        time.sleep(0.02)
    assert not is_running(child)


def test_leaving_python_ends_the_worker(tmp_path):
    """What happens when Blender quits in the middle of a bake."""
    code = (
        f"import sys, time; sys.path.insert(0, {str(ROOT)!r})\nimport bpy\nfrom reflect_addon.scene.worker import Worker\n"
        f"w = Worker([sys.executable, '-c', {PRELUDE + 'say(progress=0, message=str(os.getpid())); time.sleep(60)'!r}],"
        f" {str(tmp_path / 's')!r})\nwhile not w.poll().message.isdigit(): time.sleep(.01)\nprint('PID', w.state.message)"
    )
    (tmp_path / "s").mkdir()
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True).stdout
    assert not is_running(int(out.split("PID ")[1].split()[0])) and not (tmp_path / "s").exists()


def test_a_worker_that_cannot_start(tmp_path):
    from reflect_addon.scene.worker import Worker

    (tmp_path / "s").mkdir()
    with pytest.raises(ReflectError, match="could not be started"):
        Worker([str(tmp_path / "none")], tmp_path / "s")
    assert not (tmp_path / "s").exists()


# --- which executable


def command(preference="", **changes):
    from reflect_addon.scene import worker_command

    return worker_command.bake_command(Path("/c.blend"), ["environment"], Path("/o"), ["A"], [], preference)


def test_the_module_bakes_with_its_own_python():
    words, environment = command()
    assert words[:5] == [sys.executable, "-m", "reflect_addon.cli", "bake", "/c.blend"]
    assert environment["PYTHONPATH"] == str(ROOT) and "--json-progress" in words


def _executable_file(path: Path, text="") -> str:
    path.write_text(text)
    path.chmod(0o755)
    return str(path)


def test_a_preference_names_a_python_or_a_blender(tmp_path):
    assert command(_executable_file(tmp_path / "python3.13"))[0][1:3] == ["-m", "reflect_addon.cli"]
    blender = command(_executable_file(tmp_path / "blender"))[0]
    assert blender[1:5] == ["-b", "/c.blend", "--command", "reflect"]
    said = _executable_file(tmp_path / "mine", "#!/bin/sh\necho Blender 5.2.3 LTS\n")
    assert command(said)[0][1] == "-b"


def test_wrong_preferences_get_a_sentence(tmp_path):
    for path, words in [
        (str(tmp_path / "none"), "does not exist"),
        (_executable_file(tmp_path / "other", "#!/bin/sh\necho hello\n"), "neither"),
        (_executable_file(tmp_path / "broken", "not a program"), "what it is"),
    ]:
        with pytest.raises(ReflectError, match=words) as error:
            command(path)
        assert path in error.value.message and "preferences" in error.value.remedy


def test_a_blender_without_osl_points_at_the_preference(monkeypatch):
    from types import SimpleNamespace

    from reflect_addon.scene import worker_command

    app = SimpleNamespace(module=False, build_options=SimpleNamespace(cycles_osl=False), binary_path="/usr/bin/blender")
    monkeypatch.setattr(worker_command.bpy, "app", app)
    with pytest.raises(ReflectError, match="without OSL") as error:
        command()
    assert "preferences" in error.value.remedy


# --- the copy


def test_the_copy_leaves_the_file_alone(fresh_file, tmp_path, monkeypatch):
    """A dirty file with a relative texture: the worker sees the unsaved change and finds the texture; the file on disk,
    its name and its dirty state stay."""
    import bpy

    from reflect_addon.scene import bake_job

    image = bpy.data.images.new("painted", 2, 2)
    image.filepath_raw, image.file_format = str(tmp_path / "tex.png"), "PNG"
    image.save()
    bpy.data.images.remove(image)
    path = tmp_path / "user.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    image = bpy.data.images.load("//tex.png")
    image.use_fake_user = True
    bpy.ops.wm.save_mainfile()
    before = path.read_bytes()
    bpy.data.objects.new("Unsaved", None).use_fake_user = True
    dirty = bpy.data.is_dirty
    probe = (
        "import bpy, os, sys; bpy.ops.wm.open_mainfile(filepath=sys.argv[1])\n"
        "i = bpy.data.images['tex.png']; print(__import__('json').dumps({'done': ["
        "str('Unsaved' in bpy.data.objects), str(os.path.exists(bpy.path.abspath(i.filepath)))]}), flush=True)"
    )
    monkeypatch.setattr(bake_job, "bake_command", lambda blend, *_: ([sys.executable, "-c", probe, str(blend)], None))
    state = bake_job.start_bake(bpy.context.scene, ["environment"]).wait(60)
    assert state.folders == ("True", "True"), state
    assert bpy.data.filepath == str(path) and bpy.data.is_dirty == dirty and path.read_bytes() == before
    assert image.filepath == "//tex.png"


def test_no_room_for_the_copy(fresh_file, tmp_path, monkeypatch):
    import bpy

    from reflect_addon.scene import bake_job

    (tmp_path / "sub").mkdir()
    monkeypatch.setattr(bake_job.tempfile, "mkdtemp", lambda prefix: str(tmp_path / "sub"))
    real = bake_job.bake_command

    def spoil(blend, *rest):
        blend.mkdir()  # what cannot be overwritten
        return real(blend, *rest)

    monkeypatch.setattr(bake_job, "bake_command", spoil)
    with pytest.raises(ReflectError, match="No copy of the file"):
        bake_job.start_bake(bpy.context.scene, ["environment"])
    assert not (tmp_path / "sub").exists()


# --- one bake at a time


HOLDER = "import sys, time; sys.path.insert(0, {root!r})\nfrom pathlib import Path\nfrom reflect_addon.core.bake_lock import BakeLock\nwith BakeLock(Path({folder!r})): print('held', flush=True); time.sleep(60)"


def test_two_bakes_at_once(tmp_path):
    with BakeLock(tmp_path / "a"):
        with pytest.raises(ReflectError, match="being baked already"):
            BakeLock(tmp_path / "a").__enter__()
        with BakeLock(tmp_path / "b"):
            pass
    with BakeLock(tmp_path / "a"):
        pass
    assert list(tmp_path.iterdir()) == [], "a bake that made nothing left something"


def test_a_bake_is_one_at_a_time(tmp_path):
    from reflect_addon.core.snapshot import SceneSnapshot
    from reflect_addon.scene.bake import bake_assets

    with BakeLock(tmp_path / "a"), pytest.raises(ReflectError, match="being baked already"):
        bake_assets(SceneSnapshot("Scene", 1, (), (), ()), ["environment"], tmp_path / "a")


def test_a_killed_bake_is_taken_over(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER.format(root=str(ROOT), folder=str(tmp_path))], stdout=subprocess.PIPE
    )
    process.stdout.readline()
    with pytest.raises(ReflectError, match=str(process.pid)):
        BakeLock(tmp_path).__enter__()
    process.send_signal(signal.SIGKILL if os.name == "posix" else signal.SIGTERM)
    process.wait()
    with BakeLock(tmp_path):
        pass


def test_no_place_for_the_lock(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ReflectError, match="Nothing can be baked"):
        BakeLock(tmp_path / "file" / "a").__enter__()
