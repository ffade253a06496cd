"""What ships: a valid zip that holds the package and nothing else, installs, and switches off and on cleanly."""

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tools import build_zip

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    return build_zip.build(tmp_path_factory.mktemp("zip"))


def test_zip_holds_exactly_the_package(archive):
    with zipfile.ZipFile(archive) as opened:
        held = {name for name in opened.namelist() if not name.endswith("/")}
    package = {name for name in build_zip.known_files() if name.startswith("reflect_addon/")}
    assert held == package | {"blender_manifest.toml", "__init__.py", "LICENSE"}
    assert not [name for name in held if name.endswith((".pyc", ".blend", ".zip"))]


def test_zip_is_named_after_its_version(archive):
    project = (ROOT / "pyproject.toml").read_text()
    assert f'version = "{archive.stem.removeprefix("reflect-")}"' in project


@pytest.mark.parametrize(
    "old, new, word",
    [
        ('tags = ["3D View", ', 'tags = ["Shiny", ', "Shiny"),
        ('version = "0.1.0"', 'version = "0.2.0"', "0.2.0"),
        ('id = "reflect"', 'id = "re-flect"', 'key "id" invalid'),
    ],
)
def test_a_wrong_manifest_is_refused_by_name(tmp_path, old, new, word):
    root = tmp_path / "copy"
    for name in ("blender_manifest.toml", "__init__.py", "pyproject.toml"):
        root.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, root)
    subprocess.run(["git", "init", "-q", str(root)], check=True)
    manifest = root / "blender_manifest.toml"
    text = manifest.read_text()
    assert old in text
    manifest.write_text(text.replace(old, new))
    with pytest.raises(RuntimeError, match=word):
        build_zip.build(tmp_path / "out", root)
    assert not (tmp_path / "out").exists()


INSTALL = """
import json, sys
import bpy

def classes():
    return {name for name in dir(bpy.types) if "reflect" in name.lower()}

def state():
    handlers = [f"{kind}:{f.__module__}.{f.__qualname__}" for kind in dir(bpy.app.handlers)
                for f in (getattr(bpy.app.handlers, kind) if isinstance(getattr(bpy.app.handlers, kind), list) else ())]
    return {
        "classes": sorted(classes()),
        "handlers": sorted(handlers),
        "properties": sorted(name for kind in ("Scene", "Object", "WindowManager", "Material")
                             for name in getattr(bpy.types, kind).bl_rna.properties.keys() if "reflect" in name.lower()),
        "enabled": sorted(a.module for a in bpy.context.preferences.addons if "reflect" in a.module),
    }

bpy.ops.wm.read_factory_settings(use_empty=True)
states = {"before": state()}
bpy.ops.extensions.package_install_files(filepath=sys.argv[-1], repo="user_default", enable_on_install=True)
states["enabled"] = state()
name = states["enabled"]["enabled"][0]
bpy.ops.preferences.addon_disable(module=name)
states["disabled"] = state()
bpy.ops.preferences.addon_enable(module=name)
states["again"] = state()
bpy.ops.preferences.addon_disable(module=name)
states["disabled again"] = state()
print("STATES " + json.dumps(states))
"""


def test_install_enable_disable_enable_leaves_nothing_behind(archive, tmp_path):
    environment = os.environ | {"BLENDER_USER_RESOURCES": str(tmp_path / "profile")}
    environment.pop("PYTHONPATH", None)  # the source tree must not answer for the installed package
    done = subprocess.run(
        [sys.executable, "-c", INSTALL, str(archive)], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stdout + done.stderr, done.stdout + done.stderr
    states = json.loads(next(line for line in done.stdout.splitlines() if line.startswith("STATES "))[7:])
    assert states["enabled"]["enabled"] == ["bl_ext.user_default.reflect"]
    assert states["again"] == states["enabled"]
    assert states["disabled"] == states["before"]
    assert states["disabled again"] == states["before"]
