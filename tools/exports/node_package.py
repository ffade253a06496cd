"""reflect-three as a developer has it: node's packages, Chromium, and its scripts run. What cannot be had is `Missing`, with the reason."""

import fcntl
import functools
import hashlib
import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "reflect-three"
OLDEST_NODE = 20
INSTALL_S, RUN_S = 240, 500


class Missing(Exception):
    """What this machine lacks to draw an export by another program, as a sentence."""


class Failed(Exception):
    """What a script said that failed."""


def node(*arguments, seconds: float = RUN_S) -> str:
    """What a script of the package prints."""
    run = subprocess.run(["node", *map(str, arguments)], cwd=PACKAGE, capture_output=True, text=True, timeout=seconds)
    if run.returncode:
        raise Failed(f"node {arguments[0]}: {run.stdout[-3000:]}\n{run.stderr[-3000:]}")
    return run.stdout


@functools.cache
def need_node() -> None:
    """Node itself, for what needs no package."""
    if not shutil.which("node") or not shutil.which("npm"):
        raise Missing("no node and npm on PATH; reflect-three cannot be tried")
    version = subprocess.run(["node", "--version"], capture_output=True, text=True).stdout.strip()
    if int(version.lstrip("v").split(".")[0]) < OLDEST_NODE:
        raise Missing(f"node is {version}, and reflect-three's tests need {OLDEST_NODE}")


@functools.cache
def need_packages() -> None:
    """node_modules as package-lock.json says, installed once (the folder is ignored by git); tests in other processes wait for it."""
    need_node()
    wanted = hashlib.sha256((PACKAGE / "package-lock.json").read_bytes()).hexdigest()
    stamp = PACKAGE / "node_modules" / "reflect.lock"
    with open(Path(tempfile.gettempdir()) / f"reflect-npm-{hashlib.sha256(str(PACKAGE).encode()).hexdigest()[:12]}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if stamp.exists() and stamp.read_text() == wanted:
            return
        try:
            command = ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"]
            run = subprocess.run(command, cwd=PACKAGE, capture_output=True, text=True, timeout=INSTALL_S)
        except subprocess.TimeoutExpired:
            raise Missing(f"npm ci took more than {INSTALL_S} s")
        if run.returncode:
            raise Missing(f"npm ci cannot install reflect-three's packages: {run.stderr.strip()[-300:]}")
        stamp.write_text(wanted)


@functools.cache
def chromium() -> str:
    """Chromium's path; installed from Debian's packages where that may be done."""
    names = ("chromium", "chromium-browser", "google-chrome")
    found = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, names)), None)
    if not found and os.name == "posix" and os.geteuid() == 0 and shutil.which("apt-get"):
        for command in (["apt-get", "update"], ["apt-get", "install", "-y", "--no-install-recommends", "chromium"]):
            subprocess.run(command, capture_output=True, timeout=INSTALL_S, env={**os.environ, "DEBIAN_FRONTEND": "noninteractive"})
        found = shutil.which("chromium")
    if not found:
        raise Missing("no Chromium on PATH, nor could it be installed; set CHROMIUM to try reflect-three in a browser")
    os.environ["CHROMIUM"] = found
    return found


def drawn(export: Path, out: Path, methods: tuple[str, ...], *, pose: dict | None = None, plain: bool = False, seconds: float = RUN_S) -> dict:
    """What reflect-three/test/web/draw.js says of an export's first picture; the pictures lie in `out`. pose: of the whole scene; plain: no DXT1 on the card."""
    need_packages()
    chromium()
    node("test/web/draw.js", export, out, ",".join(methods), "--pose", json.dumps(pose), *(["--plain"] if plain else []), seconds=seconds)
    return json.loads((out / "drawn.json").read_text())
