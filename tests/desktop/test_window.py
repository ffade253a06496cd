"""An artist's session in a real Blender window; see run_window.py. Needs root and the blender-desktop tool."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = "columns.blend"
LIMIT = 420  # s: about three times what it takes on two cores


def tool() -> Path:
    """blender-desktop, installed; a loud skip where it cannot run."""
    folders = (os.environ.get("REFLECT_SHARED"), ROOT.parent / "shared")
    found = next((t for f in folders if f and (t := Path(f) / "tools" / "blender-desktop").is_file()), None)
    if found is None:
        pytest.skip("SKIPPED: no Blender window was tried: tools/blender-desktop is not beside the checkout (REFLECT_SHARED)")
    if os.name != "posix" or os.geteuid() != 0:
        pytest.skip("SKIPPED: no Blender window was tried: blender-desktop needs root")
    installed = Path(os.environ.get("BLENDER_DESKTOP_ROOT", "/var/tmp/blender-desktop")) / "usr/bin/blender"
    if not installed.exists():
        pytest.skip("SKIPPED: no Blender window was tried: run `blender-desktop install` once")
    return found


@pytest.mark.desktop
def test_an_artists_session():
    run = tool()
    out = ROOT / "out" / "desktop"
    subprocess.run(["rm", "-rf", str(out)], check=True)
    out.mkdir(parents=True)
    subprocess.run([sys.executable, ROOT / "tools/build_zip.py"], cwd=ROOT, check=True)
    archive = max((ROOT / "build").glob("*.zip"), key=lambda p: p.stat().st_mtime)
    done = subprocess.run(
        [run, "run", ROOT / "tests/desktop/run_window.py", archive, ROOT / "sample_blends" / SAMPLE, out,
         ROOT / ".venv/bin/python"],
        cwd=ROOT,
        env=os.environ | {"BLENDER_DESKTOP_LIMIT": str(LIMIT), "BLENDER_DESKTOP_SIZE": "960x720"},
        capture_output=True,
        text=True,
    )  # fmt: skip
    assert done.returncode == 0, f"pictures: {out}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    result = json.loads((out / "result.json").read_text())
    assert "13-eevee-on" in result["steps"]
