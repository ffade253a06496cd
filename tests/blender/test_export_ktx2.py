"""Float images as KTX2: the same numbers by every reader, and what is refused. The program is a stand-in (stand_in_ktx.py): Khronos' own is in no registry."""

import struct
from pathlib import Path

import numpy as np
import pytest
from page_reader import Page
from small_export import read_everything, refuses, write
from stand_in_ktx import stand_in

from reflect_addon.core.errors import ReflectError
from reflect_addon.core.exchange import ktx2_header
from reflect_addon.scene.ktx2 import find_ktx, read_ktx2, write_ktx2


def program(folder: Path, text: str) -> Path:
    path = folder / "ktx"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


@pytest.fixture(scope="module")
def ktx(tmp_path_factory) -> Path:
    return stand_in(tmp_path_factory.mktemp("bin"))


@pytest.fixture(scope="module")
def saved(tmp_path_factory, ktx):
    return write(tmp_path_factory.mktemp("export") / "packed", ktx=str(ktx))


def test_the_same_numbers(saved, tmp_path):
    """By the page and by Reflect's own reader, as in an export of EXR."""
    plain, packed = write(tmp_path / "plain"), saved
    ours, theirs = read_everything(packed), read_everything(plain)
    assert {one.kind for one in ours.values()} == {one.kind for one in theirs.values()}
    for asset in ours.values():
        (other,) = [one for one in theirs.values() if one.kind == asset.kind]
        assert all(asset.images[name].tobytes() == image.tobytes() for name, image in other.images.items())
    page, other = Page(packed), Page(plain)
    endings = {Path(image["file"]).suffix for image in page.manifest["images"].values()}
    assert endings == {".ktx2", ".dds"}
    for mine, its in zip(page.manifest["reflectors"], other.manifest["reflectors"], strict=True):
        for method, answer in mine["methods"].items():
            for sampler, key in answer["samplers"].items():
                np.testing.assert_array_equal(page.image(key), other.image(its["methods"][method]["samplers"][sampler]))


def test_any_float_comes_back(ktx, tmp_path, rng):
    texels = rng.integers(0, 2**32, (7, 5, 4), dtype=np.uint32).view("f")
    halves = rng.integers(0, 2**16, (6, 3, 4)).astype(np.uint16).view(np.float16)
    for k, array in enumerate((texels, halves)):
        path = tmp_path / f"{k}.ktx2"
        write_ktx2(str(ktx), path, array)
        found = read_ktx2(path, path.read_bytes())
        assert found.dtype == array.dtype and found.tobytes() == array.tobytes() and not path.with_suffix(".raw").exists()


def test_one_colour_stays_exr(ktx, tmp_path):
    """Zstandard makes so little of it that readers, who bound what a small file may declare, would refuse it."""
    from dataclasses import replace

    from small_export import baked

    environment = baked()[1]["environment"]
    images = {name: np.zeros((1024, 1024, 4), image.dtype) if name.endswith("_tx") else image for name, image in environment.images.items()}
    folder = write(tmp_path / "export", {"environment": replace(environment, images=images, alone=None)}, ktx=str(ktx))
    read_everything(folder)
    assert any(Path(image["file"]).suffix == ".exr" and image["width"] == 1024 for image in Page(folder).manifest["images"].values())


@pytest.mark.parametrize("at, value, form", [(12, 37, "I"), (20, 4095, "I"), (36, 6, "I"), (40, 2, "I"), (44, 1, "I"), (80, 2**40, "Q"), (88, 2**63, "Q"), (96, 2**50, "Q"), (96, 8, "Q")])
def test_headers(saved, at, value, form):
    """A format, size, faces, levels, supercompression, and texels elsewhere or of another size."""
    data = bytearray(next(saved.glob("images/*.ktx2")).read_bytes())
    header, _ = ktx2_header.header_of(data)
    struct.pack_into(f"<{form}", data, at, value)
    found = ktx2_header.header_of(data)
    assert found is None or found[0] != header


def test_a_bomb_is_refused(saved, tmp_path):
    """Texels of another size than the header says, which Zstandard would take memory for."""
    import zstandard

    path = next(saved.glob("images/*.ktx2"))
    data = path.read_bytes()
    _, texels = ktx2_header.header_of(data)
    for body in (zstandard.compress(bytes(1 << 30)), b"\x28\xb5\x2f\xfd" + bytes(40), data[texels.start :][:-9]):
        spoiled = bytearray(data[: texels.start] + body)
        struct.pack_into("<Q", spoiled, 88, len(body))
        with pytest.raises(ReflectError, match="does not unpack"):
            read_ktx2(path, spoiled)


def test_a_changed_file_is_refused(saved, tmp_path):
    import shutil

    folder = Path(shutil.copytree(saved, tmp_path / "copy"))
    path = next(folder.glob("images/*.ktx2"))
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)
    refuses(folder, "checksum", all_of_it=True)


def test_no_program(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ReflectError, match="no ktx on PATH") as error:
        find_ktx()
    assert "KTX-Software" in error.value.remedy
    program(tmp_path, "echo usage: a game")
    with pytest.raises(ReflectError, match="is not Khronos'"):
        find_ktx()


def test_a_program_that_fails(tmp_path):
    failing = program(tmp_path, "echo no room >&2; exit 2")
    with pytest.raises(ReflectError, match="no room"):
        write_ktx2(str(failing), tmp_path / "a.ktx2", np.zeros((2, 2, 4), np.float16))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["ktx"]
