"""A process that bakes, watched without waiting: progress from its JSON lines, cancel, and what went wrong in a sentence.

The lines on its standard output (cli.py, --json-progress), one JSON object each:
    {"progress": 0.42, "message": "teapot: capturing"}      fraction of the whole bake, what it is doing
    {"done": ["/path/to/asset", ...]}                       the folders it wrote
    {"said": ["...", ...]}                                  sentences that the user should read
    {"error": "...", "remedy": "..."}                       a ReflectError
Everything else there is ignored (Blender and its add-ons print too); standard error is kept for the case of a crash.
"""

import atexit
import json
import math
import os
import shutil
import signal
import subprocess
import threading
import time
from collections import deque
from dataclasses import dataclass, replace
from pathlib import Path

from ..core.errors import Cancelled, ReflectError

GRACE = 3.0  # s between asking a worker to end and ending it
MAX_LINE = 65536  # bytes: a longer line is garbage, read in pieces so that it cannot fill the memory
KEPT_LINES = 40  # last lines of standard error


@dataclass(frozen=True)
class BakeState:
    """What is known of a bake now."""

    fraction: float = 0.0  # 0..1
    message: str = "Starting the bake worker"
    running: bool = True
    folders: tuple[str, ...] = ()  # the assets that were written, once it is done
    said: tuple[str, ...] = ()  # sentences beside them
    error: ReflectError | None = None  # why it ended without being done; Cancelled when the user stopped it
    crashed: bool = False  # a signal ended it that nobody asked for


class Worker:
    """Starts `command` in a process group of its own. `scratch`, a folder, is removed when the worker has ended; its
    temporary files go there too, so that a kill leaves nothing. `work` is its name in sentences. ReflectError when it
    cannot be started."""

    def __init__(
        self, command: list[str], scratch: Path, environment: dict[str, str] | None = None, work: str = "bake"
    ):
        self.state = BakeState(message=f"Starting the {work} worker")
        self._work = work
        self._progress = (0.0, self.state.message)  # the last line's, set by the reading thread
        self._scratch = Path(scratch)
        self._asked_to_end = None  # time.monotonic() of cancel()
        self._reported: dict[str, object] = {}  # "done" and "error" lines
        self._stderr: deque[str] = deque(maxlen=KEPT_LINES)
        places = dict.fromkeys(("TMPDIR", "TEMP", "TMP", "REFLECT_TEMP"), str(scratch))
        windows = os.name == "nt"
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                env=(os.environ if environment is None else environment) | places,
                cwd=scratch,
                start_new_session=not windows,
                creationflags=subprocess.CREATE_NEW_PROCESS_GROUP | subprocess.CREATE_NO_WINDOW if windows else 0,
            )
        except (OSError, ValueError) as error:
            shutil.rmtree(scratch, ignore_errors=True)
            raise ReflectError(
                f"The {work} worker {command[0]} could not be started: {getattr(error, 'strerror', None) or error}.",
                "Name a working Blender 5.2 or Python with bpy in Reflect's preferences.",
            ) from error
        self._name = command[0]
        self._readers = [
            threading.Thread(target=target, args=(stream,), daemon=True)
            for target, stream in ((self._read_progress, self._process.stdout), (self._read_stderr, self._process.stderr))
        ]
        for reader in self._readers:
            reader.start()
        atexit.register(self.stop)  # when Blender quits in the middle of a bake

    def poll(self) -> BakeState:
        """The state now; returns at once. Call it until `running` is False: that is what escalates a cancel."""
        if not self.state.running:
            return self.state
        code = self._process.poll()
        fraction, message = self._progress
        if code is None:
            self.state = replace(self.state, fraction=fraction, message=message)
            if self._asked_to_end is not None and time.monotonic() - self._asked_to_end > GRACE:
                self._end(force=True)
            return self.state
        for reader in self._readers:
            reader.join(1.0)  # the pipes are at their end ...
        if any(reader.is_alive() for reader in self._readers):
            self._end(force=True)  # ... unless a process that the worker left behind holds them open
        error = self._error(code)
        folders = self._reported["done"] if error is None else []
        self.state = replace(
            self.state,
            running=False,
            fraction=1.0 if error is None else fraction,
            message="Done" if error is None else str(error),
            folders=tuple(map(str, folders)),
            said=tuple(map(str, said)) if isinstance(said := self._reported.get("said"), list) else (),
            error=error,
            crashed=code < 0 and error is not None and not isinstance(error, Cancelled),
        )
        shutil.rmtree(self._scratch, ignore_errors=True)
        atexit.unregister(self.stop)
        return self.state

    def cancel(self) -> None:
        """Asks the worker to end; returns at once. poll() ends it by force after GRACE seconds."""
        if self.state.running and self._asked_to_end is None:
            self._asked_to_end = time.monotonic()
            self._end(force=False)

    def stop(self) -> BakeState:
        """Cancels and waits for the end (a few seconds at most): for leaving Blender, unregister and tests."""
        self.cancel()
        self._process_wait(GRACE)
        self._end(force=True)
        self._process_wait(GRACE)
        return self.poll()

    def wait(self, timeout: float | None = None) -> BakeState:
        """Waits for the end: for background use only. TimeoutError when it takes longer than `timeout` seconds."""
        end = None if timeout is None else time.monotonic() + timeout
        while self.poll().running:
            if end is not None and time.monotonic() > end:
                raise TimeoutError(f"the {self._work} worker still runs after {timeout} s")
            time.sleep(0.05)
        return self.state

    def _process_wait(self, seconds: float) -> None:
        try:
            self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            pass  # the caller goes on to force

    def _end(self, force: bool) -> None:
        """Ends the worker's whole process group. Nothing to end is no error."""
        if os.name == "nt":
            if self._process.poll() is None:
                subprocess.run(["taskkill", "/T", "/F", "/PID", str(self._process.pid)], capture_output=True, check=False)
            return
        try:
            os.killpg(self._process.pid, signal.SIGKILL if force else signal.SIGTERM)
        except (ProcessLookupError, PermissionError):  # PermissionError: macOS, for a group of zombies
            pass

    def _read_progress(self, stream) -> None:
        for line in iter(lambda: stream.readline(MAX_LINE), b""):
            event = _event(line)
            if "progress" in event:
                self._progress = (event["progress"], str(event.get("message", self._progress[1]))[:200])
            self._reported.update({key: event[key] for key in ("done", "said", "error", "remedy") if key in event})
        stream.close()

    def _read_stderr(self, stream) -> None:
        for line in iter(lambda: stream.readline(MAX_LINE), b""):
            text = line.decode(errors="replace").strip()
            if text:
                self._stderr.append(text[:300])
        stream.close()

    def _error(self, code: int) -> ReflectError | None:
        if self._asked_to_end is not None:
            return Cancelled(f"The {self._work}")
        if code == 0 and isinstance(self._reported.get("done"), list):
            return None
        if "error" in self._reported:
            return ReflectError(str(self._reported["error"]), str(self._reported.get("remedy", "")))
        how = f"was ended by signal {-code}" if code < 0 else f"ended with status {code}"
        if code == 0:
            how = "ended without saying what it made"
        last = next((line for line in reversed(self._stderr) if not line.startswith(("Blender quit", "^"))), "")
        if "No module named 'bpy'" in last:
            return ReflectError(f"{self._name} has no bpy.", "Name a Blender 5.2 or a Python with bpy 5.2 in the preferences.")
        return ReflectError(
            f"The {self._work} worker {self._name} {how}" + (f": {last.rstrip('.')}." if last else "."),
            "The .blend and earlier assets are unharmed; try fewer samples or a smaller resolution, or another worker.",
        )


def _event(line: bytes) -> dict:
    """The JSON object of a line, its progress a number in 0..1; {} for any other line."""
    if not line.lstrip().startswith(b"{"):
        return {}
    try:
        event = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    progress = event.pop("progress", None)
    if isinstance(progress, int | float) and math.isfinite(progress):
        event["progress"] = min(max(float(progress), 0.0), 1.0)
    return event
