"""Lets another process draw a job with EEVEE, on a copy of the open file (scene/eevee_draw.py)."""

import json
import time
from collections.abc import Callable
from pathlib import Path

import bpy

from ..core.errors import ReflectError
from ..scene.bake_job import save_copy
from ..scene.eevee_job import Job
from ..scene.worker import BakeState, Worker
from ..scene.worker_command import reflect_command

POLL = 0.2  # s between looks at the process


def draw_apart(job: Job, folder: Path, say: Callable[[float, str], object]) -> dict:
    """Saves a copy of the open file and lets another process draw into the folder; waits, and ends it when `say` raises. Returns what it told.

    Where groups of ours are drawn the driver keeps its shaders in a folder of that process alone: what they take to compile is then told of the
    first picture, whatever was drawn before, and the next ones find them there, as an artist's do. A process that crashes is started once more: EEVEE on a
    software device did, now and then, in its own threads, and the same job after it went well."""
    state = _drawn_apart(job, folder, say)
    if state.crashed:
        say(0.0, f"EEVEE is started once more: {state.message}")
        state = _drawn_apart(job, folder, say)
    if state.error is not None:
        raise ReflectError(state.error.message, "Leave eevee out of --methods, or run it where OpenGL works.") from state.error
    return json.loads((folder / "said.json").read_text())


def _drawn_apart(job: Job, folder: Path, say: Callable[[float, str], object]) -> BakeState:
    scratch = folder / "scratch"  # the worker's, which deletes it
    scratch.mkdir()
    blend = scratch / f"{Path(bpy.data.filepath).stem or 'unsaved'}.blend"
    (scratch / "job.json").write_text(json.dumps(job.plain()))
    arguments = ["--job", str(scratch / "job.json"), "--out", str(folder)]
    command, environment = reflect_command(blend, "draw-eevee", arguments)
    if job.groups:
        environment |= {"MESA_SHADER_CACHE_DIR": str(scratch)}
    save_copy(blend)
    worker = Worker(command, scratch, environment, "EEVEE")
    try:
        while (state := worker.poll()).running:
            say(state.fraction, state.message)
            time.sleep(POLL)
    except BaseException:
        worker.stop()
        raise
    return state
