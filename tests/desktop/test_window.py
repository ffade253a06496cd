"""Artists' sessions in a real Blender window; see run_window.py, run_light_field.py, run_contact.py, run_export.py, run_virtual.py
and run_mirror_source.py. Needs root and the blender-desktop tool."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LIMIT = 600  # s: about four times what one session takes on two cores


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


def session(script: str, sample: str, *more: str) -> dict:
    """Runs a story of this folder on a sample; returns its results. Pictures stay in out/desktop."""
    run, out = tool(), ROOT / "out" / "desktop" / script
    subprocess.run(["rm", "-rf", str(out)], check=True)
    out.mkdir(parents=True)
    subprocess.run([sys.executable, ROOT / "tools/build_zip.py"], cwd=ROOT, check=True)
    archive = max((ROOT / "build").glob("*.zip"), key=lambda p: p.stat().st_mtime)
    done = subprocess.run(
        [run, "run", ROOT / "tests/desktop" / f"{script}.py", archive, ROOT / "sample_blends" / sample, out,
         ROOT / ".venv/bin/python", *more],
        cwd=ROOT,
        env=os.environ | {"BLENDER_DESKTOP_LIMIT": str(LIMIT), "BLENDER_DESKTOP_SIZE": "960x720"},
        capture_output=True,
        text=True,
    )  # fmt: skip
    assert done.returncode == 0, f"pictures: {out}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return json.loads((out / "result.json").read_text())


@pytest.mark.alone
@pytest.mark.desktop
def test_an_artists_session():
    assert "13-eevee-on" in session("run_window", "columns.blend")["steps"]


@pytest.mark.alone
@pytest.mark.desktop
def test_a_light_field_is_focused_and_shown_behind():
    assert "07-inside-again" in session("run_light_field", "columns.blend")["steps"]


@pytest.mark.alone
@pytest.mark.desktop
def test_things_that_touch_and_move():
    found = session("run_contact", "contact.blend", "Suzanne matt")
    assert "07-billboards-back" in found["steps"]
    # A map goes along with its object, a billboard is captured again.
    assert "moved=3" in found["depth_maps followed"] and "remade=1" in found["billboards followed"]


@pytest.mark.alone
@pytest.mark.desktop
def test_what_is_old_is_baked_again_by_itself():
    found = session("run_refresh", "contact.blend", "Suzanne matt")
    assert "04-fresh" in found["steps"] and found["seconds"]["idle: stopped by a change"] < 5.0


@pytest.mark.alone
@pytest.mark.desktop
def test_an_export_beside_the_window():
    assert "03-exported" in session("run_export", "contact.blend")["steps"]


@pytest.mark.alone
@pytest.mark.desktop
def test_virtual_objects_follow_what_moves():
    assert "05-back" in session("run_virtual", "contact.blend", "Suzanne matt")["steps"]


@pytest.mark.alone
@pytest.mark.desktop
def test_a_mirror_shows_the_viewport_live():
    found = session("run_mirror_source", "contact.blend")
    assert "07-surfaces-again" in found["steps"] and found["share"]["behind"] == 0
