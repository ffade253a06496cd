"""An export's folder is whole after a kill at any point, and what is not ours is never moved or deleted."""

import os
import shutil

import pytest
from small_export import write

from reflect_addon.core.exchange import folder as places
from reflect_addon.core.exchange.folder import EARLIER, whole_folder
from reflect_addon.core.exchange.reading import read_export


class Killed(BaseException):
    """What a process that is killed does not live to clean up after."""


@pytest.fixture(scope="module")
def export(tmp_path_factory):
    return write(tmp_path_factory.mktemp("export") / "out")


@pytest.mark.parametrize("renames", [0, 1, 2])
def test_a_kill_between_renames(export, tmp_path, monkeypatch, renames):
    """After so many renames the process is gone; the next export finds an export, and leaves one alone."""
    out = tmp_path / "out"
    shutil.copytree(export, out)
    done = []

    def rename(a, b):
        if len(done) == renames:
            raise Killed
        done.append(shutil.move(a, b))

    def delete(*_arguments, **_named):
        raise Killed

    with monkeypatch.context() as patch, pytest.raises(Killed):
        patch.setattr(places.os, "rename", rename)
        patch.setattr(places.shutil, "rmtree", delete)
        with whole_folder(out) as new:
            shutil.copytree(export, new, dirs_exist_ok=True)
    assert out.is_dir() or out.with_name("out" + EARLIER).is_dir()
    with whole_folder(out) as new:
        shutil.copytree(export, new, dirs_exist_ok=True)
    assert read_export(out) and not out.with_name("out" + EARLIER).exists()


@pytest.mark.parametrize("there", [False, True])
def test_a_folder_of_that_name_that_is_not_ours(export, tmp_path, there):
    """It is never taken for an earlier export."""
    out, other = tmp_path / "out", tmp_path / f"out{EARLIER}"
    if there:
        shutil.copytree(export, out)
    other.mkdir()
    (other / "notes.txt").write_text("mine")
    try:
        with whole_folder(out) as new:
            shutil.copytree(export, new, dirs_exist_ok=True)
    except places.ReflectError:
        assert there, "nothing stood in the way"
    assert read_export(out) and os.listdir(other) == ["notes.txt"] and set(os.listdir(tmp_path)) == {"out", other.name}
