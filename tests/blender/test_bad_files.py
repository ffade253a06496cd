"""Files that are no .blend, or look odd and are one, through the command line."""

import numpy as np
import pytest
from bad_input import FRAME, TINY, VERBS, ball, contents, empty_stage, reflect, save  # noqa: F401

from reflect_addon.core.asset_files import load_asset

ENVIRONMENT = ("--methods", "environment", *TINY[:4])


@pytest.fixture
def home(tmp_path):
    """A folder with a good.blend, uncompressed."""
    empty_stage()
    ball()
    return save(tmp_path / "home" / "good.blend", compress=False).parent


def header(**replace):
    def change(data: bytes) -> bytes:
        for old, new in replace.values():
            assert old in data
            data = data.replace(old, new, 1)
        return data

    return change


FILES = {
    "missing": (None, ("There is no file", "Check the path")),
    "empty": (lambda data: b"", ("is empty or cut short", "backup")),
    "cut short": (lambda data: data[: len(data) // 2], ("could not be opened", "backup")),
    "a picture": (lambda data: b"\x89PNG\r\n\x1a\n" + bytes(99), ("is not a .blend", "Name a file")),
    "newer format": (header(v=(b"BLENDER17-01v05", b"BLENDER17-99v99")), ("could not be opened", "Blender 5.2")),
    "a folder": ("folder", ("There is no file", "Check the path")),
}


@pytest.mark.parametrize("case", FILES)
def test_files_that_are_no_blend(reflect, home, tmp_path, case):
    change, says = FILES[case]
    blend = tmp_path / "bad.blend"
    if change == "folder":
        blend.mkdir()
    elif change is not None:
        blend.write_bytes(change((home / "good.blend").read_bytes()))
    for verb in ("analyse", "bake", "render", "evaluate", "shader"):
        arguments = VERBS[verb](tmp_path / "out") if verb in VERBS else ()
        reflect.refuses(verb, blend, *arguments, says=(*says, str(blend)), keeps=[tmp_path])


def test_files_that_only_look_odd(reflect, tmp_path):
    """Compressed, read-only, with another ending."""
    before = {}
    for name, options in (("compressed.blend", {"compress": True}), ("plain.blend", {}), ("backup.blend1", {})):
        empty_stage()
        ball()
        blend = save(tmp_path / name, **options)
        blend.chmod(0o444)
        before |= contents(blend)
        assert "Ball" in reflect.works("analyse", blend).out
        reflect.works("bake", blend, *ENVIRONMENT, "--out", tmp_path / "out")
        reflect.works("render", blend, "--method", "environment", *FRAME, *TINY[:4], "--out", tmp_path / "p.png")
    assert (tmp_path / "compressed.blend").read_bytes()[:4] == b"\x28\xb5\x2f\xfd"
    assert contents(*(tmp_path / n for n in ("compressed.blend", "plain.blend", "backup.blend1"))) == before
    assert np.isfinite(load_asset(tmp_path / "out" / "environment-Ball").images["radiance_tx"]).all()
