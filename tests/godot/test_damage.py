"""Spoiled exports in Godot: whatever is wrong is one sentence that names the file and the field, before memory is taken and before anything is used."""

import copy
import hashlib
import json
import os
import re
import shutil
import struct
from pathlib import Path

import pytest
from godot_program import godot
from small_export import write
from spoiled_exports import WRONG, spoil_document
from stand_in_ktx import stand_in

pytestmark = pytest.mark.slow
SENTENCE = re.compile(r"^[^:\n]{1,120}: [^\n]{3,400}\.$")
BEYOND = {  # what the add-on has no reader for: only Blender makes use of it
    "an asset's name", "bakes' size", "bakes' checksum",
    # seen when files and the scene are opened
    "scene's size", "scene's checksum", "a node", "no such node", "a camera's node", "huge from little",
}  # fmt: skip
DAMAGES = 1000


@pytest.fixture(scope="module")
def saved(tmp_path_factory) -> Path:
    """Core's stand-ins, with a glTF of one triangle."""
    return write(tmp_path_factory.mktemp("export") / "whole", triangle=True)


def said(jobs: list[dict], folder: Path) -> list[str]:
    """What Godot says of each."""
    (folder / "list.json").write_text(json.dumps(jobs))
    godot("--headless", "-s", Path(__file__).with_name("opened.gd"), "--", folder / "list.json", folder / "said.json")
    return json.loads((folder / "said.json").read_text())


def manifests(documents: list, folder: Path) -> list[str]:
    for k, document in enumerate(documents):
        (folder / f"{k}.json").write_text(json.dumps(document))
    return said([{"manifest": str(folder / f"{k}.json")} for k in range(len(documents))], folder)


@pytest.fixture(scope="module")
def packed(tmp_path_factory) -> Path:
    """The same with float images as KTX2."""
    folder = tmp_path_factory.mktemp("packed")
    return write(folder / "whole", triangle=True, ktx=str(stand_in(folder)))


def test_wrong_fields_get_a_sentence(saved, tmp_path):
    right = json.loads((saved / "reflect.json").read_text())
    cases = [case for case in WRONG if case not in BEYOND]
    documents = [right]
    for case in cases:
        documents.append(copy.deepcopy(right))
        WRONG[case][0](documents[-1])
    first, *others = manifests(documents, tmp_path)
    assert first == ""
    assert all(SENTENCE.match(one) and one.startswith("reflect.json: ") for one in others), dict(zip(cases, others))


def test_a_thousand_damaged_manifests(saved, tmp_path, rng):
    right = json.loads((saved / "reflect.json").read_text())
    found = manifests([spoil_document(rng, right) for _ in range(DAMAGES)], tmp_path)
    assert all(one == "" or SENTENCE.match(one) for one in found), [one for one in found if one and not SENTENCE.match(one)][:5]
    # Most values of a manifest are those of stand-ins and plans, which only Blender reads.
    assert len(set(found)) > 0.1 * DAMAGES and found.count("") < 0.7 * DAMAGES


def spoiled(saved: Path, folder: Path, name: str, change) -> dict:
    copied = Path(shutil.copytree(saved, folder / name))
    change(copied)
    return {"folder": str(copied)}


def changed(folder: str, ending: str):
    def change(copied: Path) -> None:
        for path in (copied / folder).glob(f"*{ending}"):
            data = bytearray(path.read_bytes())
            data[len(data) // 2] ^= 1
            path.write_bytes(data)

    return change


def linked(name: str):
    def change(copied: Path) -> None:
        outside = copied.with_name(f"{copied.name} outside")
        (copied / name).rename(outside)
        os.symlink(outside, copied / name)

    return change


def test_damaged_files_get_a_sentence(saved, tmp_path):
    cases = {
        "whole": (lambda copied: None, ""),
        "an image": (changed("images", ".exr"), "sha256 is not the manifest's"),
        "a kernel": (changed("shaders", ".gdshaderinc"), "sha256 is not the manifest's"),
        "GLSL": (changed("shaders", ".glsl"), ""),  # which Godot does not read
        "the scene": (lambda copied: (copied / "scene.gltf").write_text("{}"), "scene.gltf: bytes are 2 where the manifest says"),
        "no manifest": (lambda copied: (copied / "reflect.json").unlink(), "reflect.json: is missing"),
        "no kernels": (lambda copied: shutil.rmtree(copied / "shaders"), "is missing"),
        "no JSON": (lambda copied: (copied / "reflect.json").write_bytes(b"\x80{"), "reflect.json: is not JSON"),
        "links to kernels": (linked("shaders"), "is a link"),
        "a link to the scene": (linked("scene.gltf"), "scene.gltf: is a link"),
    }
    found = said([spoiled(saved, tmp_path, name, change) for name, (change, _) in cases.items()], tmp_path)
    for (name, (_, words)), sentence in zip(cases.items(), found):
        assert (words in sentence and SENTENCE.match(sentence)) if words else sentence == "", (name, sentence)


def rewritten(at: int, form: str, value: int):
    """Float images with another header, whose checksums hold."""

    def change(copied: Path) -> None:
        path = copied / "reflect.json"
        text = path.read_text()
        for image in (copied / "images").glob("*.ktx2"):
            data = bytearray(image.read_bytes())
            struct.pack_into(f"<{form}", data, at, value)
            digits = hashlib.sha256(data).hexdigest()
            text = text.replace(json.loads(text)["images"][image.stem]["sha256"], digits).replace(image.stem, f"{image.stem[:-12]}{digits[:12]}")
            image.unlink()
            image.with_name(f"{image.stem[:-12]}{digits[:12]}.ktx2").write_bytes(data)
        path.write_text(text)

    return change


def test_ktx2(packed, tmp_path):
    cases = {
        "whole": (lambda copied: None, ""),
        "the format": (rewritten(12, "I", 37), "vkFormat is 37, not 97"),
        "the size": (rewritten(20, "I", 16384), "where the manifest says"),
        "faces": (rewritten(36, "I", 6), "not of one picture"),
        "elsewhere": (rewritten(80, "Q", 2**62), "lies outside of the file"),
        "texels": (rewritten(96, "Q", 2**40), "is not that of its texels"),
        "a frame that is none": (rewritten(200, "I", 0), "does not unpack to its texels"),
    }
    found = said([spoiled(packed, tmp_path, name, change) for name, (change, _) in cases.items()], tmp_path)
    for (name, (_, words)), sentence in zip(cases.items(), found):
        assert (words in sentence and SENTENCE.match(sentence)) if words else sentence == "", (name, sentence)
