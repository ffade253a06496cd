"""The design's layers, held by walking every import statement in reflect_addon/."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "reflect_addon"
FILES = sorted(PACKAGE.rglob("*.py"))

BLENDER = {"bpy", "mathutils", "bmesh", "bpy_extras", "gpu_extras", "blf", "_cycles"}
BUNDLED = {"OpenImageIO", "PyOpenColorIO", "oslquery"}  # behind bpy.utils.expose_bundled_modules()
# What each part may import besides the standard library: modules from outside, and parts of Reflect ("" is its top).
MAY = {
    "core": ({"numpy"}, {"core"}),
    "scene": ({"numpy"} | BLENDER | BUNDLED, {"core", "scene"}),
    "gpu": ({"numpy", "gpu"} | BLENDER, {"core", "scene", "gpu"}),
    "evaluation": ({"numpy"} | BLENDER | BUNDLED, {"core", "scene", "gpu", "evaluation"}),
    "ops": ({"numpy"} | BLENDER, {"core", "scene", "gpu", "evaluation", "ops", "ui"}),
    "ui": ({"numpy"} | BLENDER, {"core", "scene", "gpu", "ops", "ui"}),
    "": ({"numpy"} | BLENDER, {"core", "scene", "gpu", "evaluation", "ops", "ui", ""}),
}
# What ./dev installs and Blender lacks: only evaluation may use it, and only inside a function, so that a user's
# Blender can import the module and say what is missing.
DEVELOPMENT = {"matplotlib", "flip_evaluator", "skimage"}
HARD_LIMIT, SOFT_LIMIT = 400, 250  # lines


def part_of(path):
    inside = path.relative_to(PACKAGE).parts
    return inside[0] if len(inside) > 1 else ""


def imports(path, source=None):
    """(line, module from outside or None, part of Reflect or None, whether at module level) for each import."""
    tree = ast.parse(source if source is not None else path.read_text(), str(path))
    top = {id(node) for node in tree.body}
    folder = path.relative_to(PACKAGE.parent).parent.parts  # ("reflect_addon", "core", ...)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name.split(".")[0], None, id(node) in top
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.lineno, node.module.split(".")[0], None, id(node) in top
        elif isinstance(node, ast.ImportFrom):
            base = folder[: max(len(folder) - node.level + 1, 0)]
            for name in [node.module] if node.module else [alias.name for alias in node.names]:
                target = (*base, *name.split("."))
                if not base:
                    yield node.lineno, "(above the package)", None, id(node) in top
                else:
                    yield node.lineno, None, target[1] if (PACKAGE / target[1]).is_dir() else "", id(node) in top


def wrongs(path, source=None):
    """What is wrong with the imports of one file, as sentences."""
    part = part_of(path)
    outside_allowed, parts_allowed = MAY[part]
    for line, outside, inside, top in imports(path, source):
        where = f"{path.relative_to(PACKAGE.parent)}:{line}"
        if outside == "reflect_addon":
            yield f"{where}: absolute import of the package itself; it has another name when installed"
        elif outside is not None and outside not in sys.stdlib_module_names and outside not in outside_allowed:
            if not (part == "evaluation" and outside in DEVELOPMENT and not top):
                yield f"{where}: {part or 'the package'} may not import {outside}"
        elif inside is not None and inside not in parts_allowed:
            yield f"{where}: {part or 'the package'} may not import from {inside or 'the top of the package'}"


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_stay_in_their_layer(path):
    assert list(wrongs(path)) == []


WRONG = [
    ("core", "import bpy"),
    ("core", "def f():\n    from mathutils import Vector"),
    ("core", "from ..scene import snapshot"),
    ("core", "from .. import scene"),
    ("core/kernel", "from ...gpu import program"),
    ("scene", "import gpu"),
    ("scene", "from ..gpu import program"),
    ("scene", "import scipy"),
    ("gpu", "from ..ops import bake"),
    ("ops", "import gpu.types"),
    ("ui", "from reflect_addon.core import rays"),
    ("evaluation", "import matplotlib"),
    ("core", "from .... import elsewhere"),
]
RIGHT = [
    ("core", "import math\nimport numpy as np\nfrom . import rays\nfrom .rays import Ray"),
    ("core/methods", "from ..rays import Ray\nfrom ...core import asset"),
    ("gpu", "import gpu\nfrom ..core import rays"),
    ("evaluation", "def plot():\n    import matplotlib"),
]


@pytest.mark.parametrize("part, source", WRONG)
def test_the_walk_sees_a_wrong_import(part, source):
    assert list(wrongs(PACKAGE / part / "made_up.py", source))


@pytest.mark.parametrize("part, source", RIGHT)
def test_the_walk_lets_right_imports_pass(part, source):
    assert list(wrongs(PACKAGE / part / "made_up.py", source)) == []


def test_importing_the_package_touches_neither_blender_nor_its_gpu():
    code = "import sys, reflect_addon; print(sorted({'bpy', 'gpu', 'reflect_addon.gpu'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_core_runs_without_blender():
    """Every module of core imports in a Python that has been told there is no bpy, gpu or mathutils."""
    names = [
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for path in FILES
        if part_of(path) == "core"
    ]
    assert len(names) > 5
    code = "import sys, importlib\nfor name in ('bpy', 'gpu', 'mathutils'): sys.modules[name] = None\n" + "".join(
        f"importlib.import_module({name!r})\n" for name in names
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_files_stay_readable():
    lengths = sorted(
        ((len(path.read_text().splitlines()), str(path.relative_to(ROOT))) for path in FILES), reverse=True
    )
    for lines, name in lengths:
        if lines > SOFT_LIMIT:
            print(f"longer than {SOFT_LIMIT} lines: {name} ({lines})")
    assert [name for lines, name in lengths if lines > HARD_LIMIT] == []
