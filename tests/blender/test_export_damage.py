"""Exports that were spoiled, by accident or by design: whatever is wrong is a sentence, before memory is taken and before anything is used."""

import hashlib
import json
import os
import shutil
from pathlib import Path

import pytest
from small_export import read_everything, refuses, write
from spoiled_exports import WRONG, WRONG_BAKES, spoil_bytes, spoil_document

from reflect_addon.core.errors import ReflectError
from reflect_addon.core.exchange import checked
from reflect_addon.core.exchange.reading import read_export
from reflect_addon.scene.import_assets import image_of

DAMAGES, MOST_BYTES = 1000, 64 << 20


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    return write(tmp_path_factory.mktemp("export") / "whole")


@pytest.fixture
def spoiled(saved, tmp_path):
    """A copy to spoil."""
    return Path(shutil.copytree(saved, tmp_path / "copy"))


def edit(folder: Path, change) -> None:
    path = folder / "reflect.json"
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))


def edit_bakes(folder: Path, change) -> None:
    """The manifest vouches for it."""
    path = folder / "bakes.json"
    document = json.loads(path.read_text())
    document = change(document) or document
    content = json.dumps(document).encode()
    path.write_bytes(content)
    edit(folder, lambda manifest: manifest["bakes"].update(bytes=len(content), sha256=hashlib.sha256(content).hexdigest()))


@pytest.mark.parametrize("case", WRONG_BAKES)
def test_wrong_bakes_get_a_sentence(spoiled, case):
    change, words = WRONG_BAKES[case]
    edit_bakes(spoiled, change)
    refuses(spoiled, words)


@pytest.mark.parametrize("case", WRONG)
def test_wrong_fields_get_a_sentence(spoiled, case):
    change, words = WRONG[case]
    edit(spoiled, change)
    refuses(spoiled, words)


def test_all_images_together_are_bounded(spoiled):
    """Five of 16384 x 16384 floats, of files that might hold them."""

    def many(document):
        key, image = next((k, i) for k, i in document["images"].items() if i["kind"] == "tx")
        for number in range(5):
            document["images"][f"{'abcde'[number]}_{key}"] = {**image, "kind": "buf", "width": 16384, "height": 16384, "bytes": 8 << 20, "file": f"images/{'abcde'[number]}_{key}.exr"}

    edit(spoiled, many)
    refuses(spoiled, "GiB")


@pytest.mark.parametrize("name", ["reflect.json", "scene.gltf", "images", "shaders"])
def test_links_that_leave_are_not_read(spoiled, name):
    outside = spoiled.parent / "outside"
    (spoiled / name).rename(outside)
    (spoiled / name).symlink_to(outside)
    refuses(spoiled, "", all_of_it=True)


def with_another_picture(export: Path, change) -> None:
    """Changes an EXR's bytes; checksum, name and manifest go along."""
    document = json.loads((export / "reflect.json").read_text())
    key, image = next((k, i) for k, i in document["images"].items() if i["kind"] == "tx")
    data = bytearray((export / image["file"]).read_bytes())
    change(data)
    digest = hashlib.sha256(data).hexdigest()
    new = f"{key[:-12]}{digest[:12]}"
    text = (export / "reflect.json").read_text().replace(key, new).replace(image["sha256"], digest)
    (export / "reflect.json").write_text(text.replace(f'"bytes": {image["bytes"]},', f'"bytes": {len(data)},'))
    edit_bakes(export, lambda bakes: json.loads(json.dumps(bakes).replace(key, new)))
    (export / image["file"]).unlink()
    (export / "images" / f"{new}.exr").write_bytes(data)


def test_a_header_that_says_two_things_is_refused(spoiled):
    """A small picture for us and a large one for the decoder."""

    def again(data):
        start = data.index(b"dataWindow\0")
        end = start + len(b"dataWindow\0box2i\0") + 4 + 16
        data[end:end] = data[start:end]

    with_another_picture(spoiled, again)
    refuses(spoiled, "its header says", all_of_it=True)


@pytest.mark.parametrize("at", ["channels", "dataWindow", "compression"])
def test_a_header_that_says_something_else_is_refused(spoiled, at):
    """The checksum is right and the manifest agrees with it: only the picture's own header does not."""

    def other(data):
        start = data.index(at.encode() + b"\0") + len(at) + 1
        start = data.index(b"\0", start) + 5  # after the type's name and the size
        data[start + {"channels": 2, "dataWindow": 8, "compression": 0}[at]] ^= 3

    with_another_picture(spoiled, other)
    refuses(spoiled, "its header says", all_of_it=True)


def peak_bytes(again: bool = False) -> int:
    """The most memory that this process had, all libraries' too, since the last call with `again`; 0 where the system does not tell."""
    try:
        if again:
            Path("/proc/self/clear_refs").write_text("5")
        return next(1024 * int(line.split()[1]) for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    except OSError:
        return 0


def read_one(folder: Path, name: str) -> None:
    """The export, and the image or kernel of this file's name; of what it names itself all assets' words, too."""
    export = read_export(folder)
    for key, image in export.manifest.images.items():
        if image.file == name:
            image_of(export, key)
    for shader in export.manifest.texts():
        if shader.file == name:
            export.content(shader)
    for key in export.bakes.assets if name in ("reflect.json", "bakes.json") else ():
        export.asset(key)


def of_schema(folder: Path, name: str) -> bool:
    """Whether a file is as the schema has it."""
    jsonschema = pytest.importorskip("jsonschema", reason="SKIPPED: no jsonschema; ./dev installs it")
    schema = json.loads(Path(checked.__file__).with_name("reflect.schema.json").read_text())
    if name == "bakes.json":
        schema = {"$ref": "#/$defs/bakes", "$defs": schema["$defs"]}
    return jsonschema.Draft202012Validator(schema).is_valid(json.loads((folder / name).read_text()))


def test_a_thousand_damages(saved, tmp_path, rng):
    """Each ends with a sentence, or the export says something else that is as right as before: by the JSON schema, too."""
    whole = {p.relative_to(saved).as_posix(): p.read_bytes() for p in saved.rglob("*") if p.is_file()}
    document, folder = json.loads(whole["reflect.json"]), Path(shutil.copytree(saved, tmp_path / "copy"))
    read_everything(folder)  # what is loaded once is not the damage's
    files = sorted(name for name in whole if not name.startswith("pictures/"))  # which no reader of ours opens
    said, accepted, before = set(), 0, set(os.listdir(tmp_path))
    start = peak_bytes(again=True)
    for number in range(DAMAGES):
        if number % 4 == 1:
            name = "bakes.json"
            edit_bakes(folder, lambda bakes: spoil_document(rng, bakes))
        elif number % 2:
            name = "reflect.json"
            (folder / name).write_text(json.dumps(spoil_document(rng, document)))
        else:
            name = files[rng.integers(len(files))]
            (folder / name).write_bytes(spoil_bytes(rng, whole[name]))
        try:
            read_one(folder, name)
            accepted += 1
            assert number % 2 or name == "reflect.json", f"damage {number} of {name} was not seen"
            if accepted % 3 == 0:  # the schema takes longer than the reader
                assert of_schema(folder, name), f"damage {number} of {name}: the schema refuses what the reader takes"
        except ReflectError as error:
            assert str(folder) in error.message and error.remedy, error
            said.add(error.message)
        for name in {name, "reflect.json"}:
            (folder / name).write_bytes(whole[name])
    assert peak_bytes() - start < MOST_BYTES and set(os.listdir(tmp_path)) == before
    assert accepted < 0.25 * DAMAGES and len(said) > 0.2 * DAMAGES


def test_the_schema_is_one_and_this_is_of_it(saved):
    jsonschema = pytest.importorskip("jsonschema", reason="SKIPPED: no jsonschema; ./dev installs it")
    schema = json.loads(Path(checked.__file__).with_name("reflect.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    assert all(of_schema(saved, name) for name in ("reflect.json", "bakes.json"))
