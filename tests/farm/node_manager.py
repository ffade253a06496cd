"""The job type under a stand-in for Flamenco's Manager (manager.cjs), and its tasks run by local processes, which is what workers do with them."""

import json
import os
import shutil
import stat
import subprocess
import sys
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "flamenco" / "reflect_bake.js"
OLDEST_NODE = 20


def manager(*arguments) -> dict:
    """What manager.cjs prints. RuntimeError with its words where it throws."""
    if not shutil.which("node"):
        pytest.skip("SKIPPED: no node on PATH; the job type for Flamenco cannot be tried")
    version = subprocess.run(["node", "--version"], capture_output=True, text=True).stdout.strip()
    if int(version.lstrip("v").split(".")[0]) < OLDEST_NODE:
        pytest.skip(f"SKIPPED: node is {version}, and the stand-in for Flamenco's Manager needs {OLDEST_NODE}")
    run = subprocess.run(["node", Path(__file__).with_name("manager.cjs"), SCRIPT, *arguments], capture_output=True, text=True, timeout=60)
    if run.returncode:
        raise RuntimeError(run.stderr)
    return json.loads(run.stdout)


def compiled(settings: dict, folder: Path) -> dict:
    """{"settings", "tasks"} of the job with these settings."""
    given = folder / "settings.json"
    given.write_text(json.dumps(settings))
    return manager(given)


def run_tasks(tasks: list[dict], folder: Path, workers: int) -> list[str]:
    """Runs each task as soon as those that it waits for are done, so many at once; returns their names in the order of their ends. AssertionError with what a
    task said that failed."""
    blender = folder / "blender"
    blender.write_text(f'#!/bin/sh\nexec "{sys.executable}" "{Path(__file__).with_name("worker_blender.py")}" "$@"\n')
    blender.chmod(blender.stat().st_mode | stat.S_IXUSR)

    def run(task: dict) -> str:
        for command in task["commands"]:
            assert command["name"] == "exec"
            words = [word.replace("{blender}", str(blender)) for word in (command["parameters"]["exe"], *command["parameters"]["args"])]
            done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=500, env={**os.environ, "PYTHONPATH": str(ROOT)})
            assert done.returncode == 0, f"{task['name']}: {done.stderr[-2000:]}"
        return task["name"]

    ended, left, running = [], list(tasks), set()
    with ThreadPoolExecutor(workers) as pool:
        while left or running:
            ready = [task for task in left if set(task["dependencies"]) <= set(ended)]
            left = [task for task in left if task not in ready]
            running |= {pool.submit(run, task) for task in ready}
            assert running, f"these wait for each other: {[task['name'] for task in left]}"
            done, running = wait(running, return_when=FIRST_COMPLETED)
            ended += [one.result() for one in done]
    return ended
