"""Godot 4 on a machine that may have none: installs Debian unstable's in a folder of its own, and runs a project on a virtual screen.

    ./dev python tools/godot.py install                     once: about 160 MB, unpacked 530
    ./dev python tools/godot.py run PROJECT [ARGUMENT ...]  Godot on that project; arguments for its scripts stand after "--"

Packages come from the mirror that the machine's own apt names; nothing of the system is touched but for Xvfb, which is installed where it is missing and that may
be done. Debian's program wants a newer C library than a stable system has, so it is started by the loader that was unpacked with it, with Mesa from the same
place. OpenGL runs on the processor (llvmpipe): pictures are right, times are not those of a graphics card. $GODOT names another program, $REFLECT_GODOT another
folder than ~/.cache/reflect-godot.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PACKAGES = ("godot", "libgl1-mesa-dri", "libglx-mesa0", "libegl1", "libegl-mesa0", "libc6")
LEAST = (4, 6)  # Image.load_exr_from_buffer
LIBRARIES = "usr/lib/x86_64-linux-gnu"
INSTALL_S, RUN_S = 600, 300


class NoGodot(Exception):
    """There is none, with the reason."""


def place() -> Path:
    return Path(os.environ.get("REFLECT_GODOT", Path.home() / ".cache" / "reflect-godot"))


def install(folder: Path) -> None:
    """Debian unstable's Godot with all that it needs, in this folder, whole or not at all. NoGodot with what could not be done."""
    if os.name != "posix" or os.uname().machine != "x86_64" or not all(map(shutil.which, ("apt-get", "dpkg-deb"))):
        raise NoGodot("only a Debian system on x86_64 can install Godot here; set GODOT to a Godot 4.6 or newer")
    with tempfile.TemporaryDirectory(prefix="reflect-godot-") as name:
        apt, unpacked = Path(name), folder.with_name(f"{folder.name}~{os.getpid()}")
        for part in ("lists/partial", "archives/partial"):
            (apt / part).mkdir(parents=True)
        (apt / "status").touch()
        (apt / "sources.list").write_text(f"deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] {_mirror()} sid main\n")
        options = {
            "Dir::Etc::SourceList": apt / "sources.list", "Dir::Etc::SourceParts": "/dev/null", "Dir::Etc::Preferences": "/dev/null", "Dir::Etc::PreferencesParts": "/dev/null",
            "Dir::State": apt, "Dir::State::Lists": apt / "lists", "Dir::State::status": apt / "status", "Dir::Cache": apt, "Dir::Cache::archives": apt / "archives",
            "Acquire::Check-Valid-Until": "false", "APT::Install-Recommends": "false", "APT::Sandbox::User": "root",
        }  # fmt: skip
        words = [word for key, value in options.items() for word in ("-o", f"{key}={value}")]
        _do("apt-get", *words, "update")
        _do("apt-get", *words, "install", "-y", "--download-only", *PACKAGES)
        try:
            for package in sorted((apt / "archives").glob("*.deb")):
                _do("dpkg-deb", "-x", package, unpacked)
            shutil.rmtree(folder, ignore_errors=True)
            unpacked.rename(folder)
        finally:
            shutil.rmtree(unpacked, ignore_errors=True)
    if not shutil.which("Xvfb") and os.geteuid() == 0:
        _do("apt-get", "update")
        _do("apt-get", "install", "-y", "--no-install-recommends", "xvfb")


def program() -> tuple[list[str], dict[str, str]]:
    """(command, environment) of a Godot that is new enough. NoGodot with the reason."""
    folder = place()
    libraries = folder / LIBRARIES
    if named := os.environ.get("GODOT") or shutil.which("godot") or shutil.which("godot4"):
        command, environment = [named], {}
    elif (folder / "usr/bin/godot").is_file():
        command = [str(libraries / "ld-linux-x86-64.so.2"), "--library-path", f"{libraries}:{libraries}/pulseaudio", str(folder / "usr/bin/godot")]
        environment = {"LIBGL_DRIVERS_PATH": str(libraries / "dri"), "__EGL_VENDOR_LIBRARY_DIRS": str(folder / "usr/share/glvnd/egl_vendor.d"), "LIBGL_ALWAYS_SOFTWARE": "1"}
    else:
        raise NoGodot("no Godot on PATH nor in ~/.cache/reflect-godot; install it with: ./dev python tools/godot.py install")
    environment = {**os.environ, **environment}
    try:
        said = subprocess.run([*command, "--headless", "--version"], capture_output=True, text=True, env=environment, timeout=60).stdout
    except (OSError, subprocess.TimeoutExpired) as error:
        raise NoGodot(f"{command[-1]} does not run ({error})") from error
    version = re.match(r"(\d+)\.(\d+)", said.strip())
    if not version or tuple(map(int, version.groups())) < LEAST:
        raise NoGodot(f"{command[-1]} is {said.strip() or 'no Godot'}; 4.6 or newer is needed")
    return command, environment


def run(project: Path, *arguments, limit: float = RUN_S) -> subprocess.CompletedProcess:
    """Runs a project in a window on a virtual screen until it ends. stdout: all that it says. NoGodot where it cannot be started; subprocess.TimeoutExpired."""
    command, environment = program()
    with _screen() as display, tempfile.TemporaryDirectory(prefix="reflect-godot-") as home:
        environment = {**environment, "DISPLAY": display} | {f"XDG_{kind}_HOME": home for kind in ("DATA", "CONFIG", "CACHE")}
        words = [*command, "--path", project, "--rendering-driver", "opengl3", "--audio-driver", "Dummy", *arguments]
        return subprocess.run(list(map(str, words)), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment, timeout=limit)


@contextmanager
def _screen() -> Iterator[str]:
    """A virtual screen's name."""
    if not shutil.which("Xvfb"):
        raise NoGodot("no Xvfb on PATH, which Godot's window needs; install the package xvfb")
    reading, writing = os.pipe()
    words = ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1920x1440x24", "-nolisten", "tcp"]
    with subprocess.Popen(words, pass_fds=(writing,), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as server:
        os.close(writing)
        try:
            with open(reading) as told:
                number = told.readline().strip()
            if not number:
                raise NoGodot("Xvfb does not start")
            yield f":{number}"
        finally:
            server.terminate()


def _mirror() -> str:
    """Where the machine's apt has Debian's packages from."""
    for path in sorted((*Path("/etc/apt/sources.list.d").glob("*"), Path("/etc/apt/sources.list"))):
        if path.is_file() and (found := re.search(r"^(?:URIs:|deb (?:\[[^\]]*\] )?)\s*(\S+/debian/?)(?:\s|$)", path.read_text(), re.M)):
            return found[1]
    raise NoGodot("this machine's apt names no mirror of Debian")


def _do(*words) -> None:
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, timeout=INSTALL_S, env={**os.environ, "DEBIAN_FRONTEND": "noninteractive"})
    if done.returncode:
        raise NoGodot(f"{words[0]} failed: {(done.stderr or done.stdout).strip()[-300:]}")


def main(words: list[str]) -> int:
    try:
        match words:
            case ["install"]:
                install(place())
                print(f"Godot is in {place()}")
            case ["run", project, *rest]:
                done = run(Path(project), *rest)
                print(done.stdout, end="")
                return done.returncode
            case _:
                print(__doc__)
                return 2
    except (NoGodot, subprocess.TimeoutExpired) as problem:
        print(f"godot: {problem}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
