"""Bad machines and bad moments through the command line: no graphics, an old Blender, one without OSL, Ctrl-C and kill -9
in the middle, two at once."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from bad_input import BAKE, FRAME, TINY, TINY_ALL, VERBS, Result, ball, contents, empty_stage, good, reflect, save, sentence  # noqa: F401

from reflect_addon.core.asset_files import load_asset
from reflect_addon.core.bake_lock import BakeLock

ROOT = Path(__file__).resolve().parents[2]
# Minutes of work, in parts of less than a second (raytrace.PATHS_PER_RENDER); not under a bare sky, which takes one path a texel however many are asked for.
LONG = ("--methods", "environment", "--resolution", "256", "--set", "samples=2048")

RUNNING: list[subprocess.Popen] = []


@pytest.fixture(autouse=True)
def nothing_runs_on():
    """A test that fails leaves no process behind."""
    yield
    while RUNNING:
        RUNNING.pop().kill()


class Process:
    """The command line as a process of its own, with its own place for temporary files."""

    def __init__(self, home: Path, verb, *arguments, **environment):
        self.scratch = home / "scratch"
        self.scratch.mkdir(parents=True, exist_ok=True)
        places = dict.fromkeys(("TMPDIR", "REFLECT_TEMP"), str(self.scratch))
        self._err = (home / f"stderr-{verb}").open("w+")
        self._process = subprocess.Popen(
            [sys.executable, "-m", "reflect_addon.cli", verb, *map(str, arguments)], cwd=ROOT, text=True,
            stdout=subprocess.PIPE, stderr=self._err, env=os.environ | places | environment,
        )  # fmt: skip
        self.pid = self._process.pid
        RUNNING.append(self._process)

    def said(self) -> str:
        return Path(self._err.name).read_text(errors="replace")

    def wait_for_rays(self):
        """Until Cycles has rays to trace, of the first part or a later one. A bake says no more than its method's name meanwhile, so we look at the files."""
        end = time.monotonic() + 60
        while not list(self.scratch.glob("reflect-rays-*/directions*.exr")):
            assert self._process.poll() is None and time.monotonic() < end, self.said()
            time.sleep(0.02)
        return self

    def send(self, number):
        self._process.send_signal(number)
        return self

    def end(self) -> Result:
        try:
            out, _ = self._process.communicate(timeout=60)
        finally:
            self._process.kill()
        result = Result(self._process.returncode, out, self.said())
        assert "Traceback" not in result.err, result.err
        return result

    def left(self) -> list[str]:
        """Temporary files that are still there; Blender's own folder goes when it ends in order."""
        return [p.name for p in self.scratch.iterdir()]


# --- Blenders that cannot


def test_an_older_blender(reflect, good, tmp_path, monkeypatch):
    import reflect_addon

    monkeypatch.setattr(reflect_addon, "MINIMUM_BLENDER", (99, 1, 0))
    for verb in ("analyse", *VERBS):
        arguments = VERBS[verb](tmp_path / "out") if verb in VERBS else ()
        says = ("needs Blender 99.1 or newer; this is 5.2", "Update Blender")
        reflect.refuses(verb, good, *arguments, says=says, keeps=[tmp_path])


def test_a_python_without_blender(good, tmp_path):
    """Nothing else of Reflect is imported before that is known."""
    code = "import sys; sys.modules['bpy'] = None; from reflect_addon.cli import main; sys.exit(main(sys.argv[1:]))"
    for verb in ("render", "analyse"):
        arguments = VERBS[verb](tmp_path / "out") if verb in VERBS else ()
        command = [sys.executable, "-c", code, verb, good, *arguments]
        done = subprocess.run(list(map(str, command)), cwd=ROOT, capture_output=True, text=True, timeout=60)
        assert done.returncode == 1 and "has no Blender in it" in done.stderr and "./dev reflect" in done.stderr
        assert "Traceback" not in done.stderr and not done.stdout


@pytest.mark.parametrize("lacks", ["OSL", "oslquery", "OpenImageIO"])
def test_a_blender_without_osl(reflect, good, tmp_path, monkeypatch, lacks):
    """Debian's. What needs no rays works; the rest points at the preference."""
    from types import SimpleNamespace

    from reflect_addon.scene import ray_scene

    if lacks == "OSL":
        monkeypatch.setattr(ray_scene, "build_options", lambda: SimpleNamespace(cycles_osl=False))
    else:
        monkeypatch.setitem(sys.modules, lacks, None)
    for verb in ("bake", "render", "evaluate", "evaluate numpy"):
        says = ("This Blender (5.2", f"built without {'Cycles' if lacks == 'OSL' else 'the Python module'}", lacks, "Bake Worker")
        reflect.refuses(verb, good, *VERBS[verb](tmp_path / "out"), says=says, keeps=[tmp_path])
    assert "1 reflectors" in reflect.works("analyse", good).out


@pytest.mark.skipif(sys.platform != "linux", reason="EGL")
def test_no_usable_graphics(good, tmp_path):
    """gpu.init() of Blender 5.2 crashes without a driver; the person reads a sentence, and NumPy still works."""
    none = {"__EGL_VENDOR_LIBRARY_DIRS": str(tmp_path / "none"), "LIBGL_DRIVERS_PATH": str(tmp_path / "none")}
    before = contents(good.parent)
    runs = {verb: Process(tmp_path / verb, verb.split()[0], good, *VERBS[verb](tmp_path / verb / "out"), **none)
            for verb in ("render", "evaluate", "evaluate numpy")}  # fmt: skip
    for verb in ("render", "evaluate"):
        result = runs[verb].end()
        assert result.status == 1 and not result.out, result.err
        assert "No usable graphics device was found" in sentence(result) and "--backend numpy" in sentence(result)
        assert "traced" not in result.err, "it worked before it looked"
        assert not (tmp_path / verb / "out").exists() and not runs[verb].left()
    result = runs["evaluate numpy"].end()
    assert result.status == 0 and (tmp_path / "evaluate numpy" / "out" / "results.json").is_file(), result.err
    assert {k: v for k, v in contents(good.parent).items() if k in before} == before


# --- bad moments


@pytest.fixture(scope="module")
def baked(tmp_path_factory):
    """A folder with good.blend, which holds a ball and what is seen in it, and with all its assets."""
    from reflect_addon import cli

    home = tmp_path_factory.mktemp("baked") / "home"
    empty_stage()
    ball()
    ball("Neighbour", (1.8, -0.5, 1.2), 0.7).data.materials.clear()
    blend = save(home / "good.blend")
    assert cli.main(["bake", str(blend), *BAKE]) == 0
    return home


STOPS = {
    "bake SIGINT": (signal.SIGINT, ("--again", *LONG)),
    "bake SIGTERM": (signal.SIGTERM, ("--again", *LONG)),
    "render SIGINT": (signal.SIGINT, ("--out", "p.png", "--method", "environment", "--size", "512x512", "--samples", 2048)),
    "evaluate SIGINT": (signal.SIGINT, ("--out", "out", "--methods", "all", "--size", "512x512", "--samples", 2048, *TINY_ALL)),
}


@pytest.mark.skipif(os.name != "posix", reason="signals are POSIX")
def test_stopped_in_the_middle(baked, tmp_path):
    """Ends soon, in order, with a sentence; nothing of it is left and the earlier assets are whole."""
    runs = {}
    for stop, (_, arguments) in STOPS.items():
        home = shutil.copytree(baked, tmp_path / stop / "home")
        arguments = [tmp_path / stop / a if a in ("p.png", "out") else a for a in arguments]
        verb = stop.split()[0]
        if verb == "render":
            (tmp_path / stop / "p.png").write_text("an earlier picture")
            arguments += ["--assets", home / "reflect" / "Scene"]
        runs[stop] = Process(tmp_path / stop, verb, home / "good.blend", *arguments)
    for stop, run in runs.items():
        run.wait_for_rays().send(STOPS[stop][0])
    for stop, run in runs.items():
        sent = time.monotonic()
        result = run.end()
        assert result.status == 1 and not result.out, (stop, result)
        assert "was cancelled. Nothing was changed" in sentence(result) and time.monotonic() - sent < 30
        assert not run.left(), f"{stop}: temporary files stayed behind"
        places = {home: contents(home) for home in (baked, tmp_path / stop / "home")}
        then, now = ({str(Path(k).relative_to(h)): v for k, v in c.items()} for h, c in places.items())
        assert now == then, f"{stop}: the .blend and its assets are not as before"
    assert (tmp_path / "render SIGINT" / "p.png").read_text() == "an earlier picture"
    assert not (tmp_path / "evaluate SIGINT" / "out" / "results.json").exists()


@pytest.mark.skipif(os.name != "posix", reason="kill -9 is POSIX")
def test_killed_in_the_middle_and_two_at_once(reflect, baked, tmp_path, monkeypatch):
    """While one bakes, another is told who does; after kill -9 the earlier assets are whole, the next bake just works and
    clears away what the dead one left."""
    home = shutil.copytree(baked, tmp_path / "home")
    blend, folder = home / "good.blend", home / "reflect" / "Scene"
    before = contents(home)
    run = Process(tmp_path, "bake", blend, "--again", *LONG).wait_for_rays()
    for verb in ("bake", "render", "evaluate"):
        says = (str(folder), "is being baked already", f"process {run.pid}-", "Wait until")
        arguments = list(VERBS[verb](tmp_path / "out"))
        if verb != "bake":
            arguments = [a for a in arguments if a not in TINY_ALL]  # the defaults: assets beside the .blend
        else:
            arguments[1] = folder
        reflect.refuses(verb, blend, *arguments, says=says, keeps=[home])
    assert run.send(signal.SIGKILL).end().status == -signal.SIGKILL
    assert {k: v for k, v in contents(home).items() if not k.endswith(".baking")} == before
    assert any(name.startswith("reflect-rays-") for name in run.left())
    for path in folder.iterdir():
        assert not path.is_dir() or load_asset(path)
    monkeypatch.setenv("REFLECT_TEMP", str(run.scratch))
    reflect.works("bake", blend, *BAKE, "--again")
    assert not (folder / ".baking").exists() and not [n for n in run.left() if n.startswith("reflect-")]


def test_two_at_once_in_one_process(reflect, good, tmp_path):
    with BakeLock(tmp_path / "out"):
        result = reflect("bake", good, "--out", tmp_path / "out", *BAKE, "--json-progress")
    assert result.status == 1 and "is being baked already" in sentence(result)
    last = json.loads(result.out.splitlines()[-1])
    assert "is being baked already" in last["error"] and "Wait" in last["remedy"], "the window reads this line"
    assert not list(tmp_path.glob("out/*"))


# --- standard output


def test_only_results_on_standard_output(tmp_path):
    """In a pipe, where C keeps what Blender prints in its own buffer."""
    code = (
        "import ctypes, sys\nfrom reflect_addon.cli import own_output\nlibc = ctypes.CDLL(None)\nlibc.puts(b'before')\n"
        "with own_output() as results:\n    libc.puts(b'junk'); print('junk'); print('result', file=results)\nlibc.puts(b'after')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.stdout.split() == ["before", "result", "after"] and done.stderr.split() == ["junk", "junk"]


@pytest.mark.skipif(os.name != "posix", reason="pipes are POSIX")
def test_nobody_reads_the_results(good, tmp_path):
    """`reflect analyse FILE | head -0`"""
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "reflect_addon.cli", "analyse", str(good)]
    done = subprocess.run(command, cwd=ROOT, stdout=writing, stderr=subprocess.PIPE, text=True, timeout=60)
    os.close(writing)
    assert done.returncode == 1 and "Traceback" not in done.stderr and "Exception" not in done.stderr, done.stderr
