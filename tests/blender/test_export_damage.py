"""Exports that were spoiled, by accident or by design: whatever is wrong is a sentence, before memory is taken and before anything is used."""

import copy
import hashlib
import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from small_export import read_everything, refuses, write

from reflect_addon.core.errors import ReflectError
from reflect_addon.core.exchange import checked
from reflect_addon.core.exchange.reading import read_export
from reflect_addon.scene.import_assets import image_of

DAMAGES, MOST_BYTES = 1000, 64 << 20
POISON = [
    None, [], {}, "", 0, -1, 1, 2.5, True, 1e308, 10**400, 2**31, 16385, 10**9, "../outside", "/etc/passwd", "images/../../x.exr", "images\\x.exr", "a" * 1000, "\0",
    "C:\\x", "scene.gltf", [1, 2], [[]], {"a": 1}, "tx", "buf", "NaN", float("nan"), float("-inf"), "0" * 64, "0" * 12, "x-" + "0" * 12,
]  # fmt: skip


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


def first(document: dict, table: str) -> dict:
    return next(iter(document[table].values()))


def image_of_kind(document: dict, kind: str) -> dict:
    return next(image for image in document["images"].values() if image["kind"] == kind)


def answer(document: dict) -> dict:
    return document["reflectors"][0]["methods"]["environment"]


def put(table: str, **values):
    return lambda d: first(d, table).update(values)


def forget(table: str):
    return lambda d: d[table].pop(next(iter(d[table])))


WRONG = {
    "another format": (lambda d: d.update(format=2), "newer Reflect"),
    "no format": (lambda d: d.update(format=0), "format"),
    "a field too many": (lambda d: d.update(more=1), "the manifest has other fields"),
    "a field too few": (lambda d: d.pop("plan"), "the manifest has other fields"),
    "scene's name": (lambda d: d["scene"].update(file="../scene.gltf"), "scene.file"),
    "scene's size": (lambda d: d["scene"].update(bytes=7), "where reflect.json says 7"),
    "scene's checksum": (lambda d: d["scene"].update(sha256="0" * 64), "checksum"),
    "path out": (put("images", file="../outside-0123456789ab.exr"), ".file"),
    "absolute path": (put("images", file="/etc/passwd"), ".file"),
    "kind": (put("images", kind="npy"), ".kind"),
    "width": (put("images", width=16385), ".width is 16385"),
    "height": (put("images", height=0), ".height is 0"),
    "half a width": (put("images", width=2.5), ".width is no whole number"),
    "a true width": (put("images", width=True), ".width is no whole number"),
    "huge from little": (lambda d: image_of_kind(d, "tx").update(width=16384, height=16384), "too little for a picture"),
    "blocks": (lambda d: image_of_kind(d, "bc1").update(width=18), "blocks"),
    "shader's name": (put("shaders", file="shaders/../x.glsl"), ".file"),
    "shader's size": (put("shaders", bytes=1 << 30), ".bytes"),
    "Godot's name": (lambda d: first(d, "shaders")["godot"].update(file="shaders/../x.gdshaderinc"), ".godot.file"),
    "no text for Godot": (lambda d: first(d, "shaders").pop("godot"), "other fields"),
    "no such shader": (lambda d: answer(d).update(shader="0" * 12), ".shader"),
    "no such image": (lambda d: answer(d)["samplers"].update(a="x-" + "0" * 12), ".samplers"),
    "a sampler's name": (lambda d: answer(d)["samplers"].update({"a; void": next(iter(d["images"]))}), ".samplers"),
    "no such asset": (lambda d: answer(d).update(assets=["x-" + "0" * 12]), ".assets"),
    "no asset": (lambda d: answer(d).update(assets=[]), ".assets"),
    "another kind": (lambda d: answer(d).update(kind="box_proxy"), ".kind"),
    "slots of three": (lambda d: answer(d)["slots"].append([1, 2, 3]), ".slots"),
    "slots of text": (lambda d: answer(d)["slots"].append(["1", 2, 3, 4]), "no finite number"),
    "slots beyond floats": (lambda d: answer(d)["slots"].append([1e39, 0, 0, 0]), "32-bit"),
    "endless slots": (lambda d: answer(d).update(slots=[[0.0] * 4] * 300), "more than 224"),
    "a node": (lambda d: d["reflectors"][0].update(node=0), "node 0 is not that"),
    "no such node": (lambda d: d["reflectors"][0].update(node=10**6), "node 1000000 is not that"),
    "a camera's node": (lambda d: d["pictures"][0].update(node=10**6), "camera's node"),
    "a material": (lambda d: d["reflectors"][0].update(materials=[9]), ".materials"),
    "a colour": (lambda d: d["materials"][0].update(base_color=[1, 1]), ".base_color"),
    "a picture": (lambda d: d["pictures"][0].update(truth="pictures/../truth-0123456789ab.png"), ".truth"),
    "a look": (lambda d: d["look"].update(table=next(iter(d["images"]))), "look.table"),
    "an asset's uniform": (lambda d: first(d, "assets")["uniforms"].update(radiance_scale="1"), "uniform"),
    "an asset's deep setting": (lambda d: first(d, "assets")["settings"].update(a=json.loads("[" * 400 + "]" * 400)), "too deeply"),
    "an asset's image": (lambda d: first(d, "assets")["images"].update(radiance_tx="x-" + "0" * 12), ".images"),
    "an asset's kind of image": (lambda d: first(d, "assets")["images"].update(a_buf=next(iter(d["images"]))), "another kind"),
    "a plan": (lambda d: d.update(plan={"what": "reflect plan", "format": 2}), "plan has other fields"),
    "no image": (forget("images"), ""),
    "no shader": (forget("shaders"), ""),
}  # fmt: skip


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


def places(value, path=()):
    """The path of every value in a JSON document."""
    yield path
    for key, item in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from places(item, (*path, key))


def spoil_document(rng: np.random.Generator, document):
    """Another value somewhere: gone, poisonous, doubled, or taken from elsewhere in the document."""
    document = copy.deepcopy(document)
    every = [path for path in places(document) if path]
    path = every[rng.integers(len(every))]
    holder = document
    for key in path[:-1]:
        holder = holder[key]
    match rng.integers(4):
        case 0:
            del holder[path[-1]]
        case 1:
            other = document
            for key in every[rng.integers(len(every))]:
                other = other[key]
            holder[path[-1]] = copy.deepcopy(other)
        case 2 if isinstance(holder, dict):
            holder[str(POISON[rng.integers(len(POISON))])[:80]] = copy.deepcopy(holder[path[-1]])
        case _:
            holder[path[-1]] = POISON[rng.integers(len(POISON))]
    return document


def spoil_bytes(rng: np.random.Generator, data: bytes) -> bytes:
    """Cut, longer, a byte changed, bytes put in or taken out."""
    data, at = bytearray(data), int(rng.integers(len(data)))
    match rng.integers(5):
        case 0:
            del data[at:]
        case 1:
            data += bytes(int(rng.integers(1, 99)))
        case 2:
            data[at] ^= int(rng.integers(1, 256))
        case 3:
            data[at:at] = [b"0", b"null", b"-", b"]", b"1e999", b'"', b"\xff", b"9" * 30][rng.integers(8)]
        case 4:
            del data[at : at + int(rng.integers(1, 40))]
    return bytes(data)


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
    for key in export.manifest.assets if name == "reflect.json" else ():
        export.asset(key)


def test_a_thousand_damages(saved, tmp_path, rng):
    """Each ends with a sentence, or the export says something else that is as right as before: by the JSON schema, too."""
    schema = pytest.importorskip("jsonschema", reason="SKIPPED: no jsonschema; ./dev installs it").Draft202012Validator(
        json.loads(Path(checked.__file__).with_name("reflect.schema.json").read_text())
    )
    whole = {p.relative_to(saved).as_posix(): p.read_bytes() for p in saved.rglob("*") if p.is_file()}
    document, folder = json.loads(whole["reflect.json"]), Path(shutil.copytree(saved, tmp_path / "copy"))
    read_everything(folder)  # what is loaded once is not the damage's
    files = sorted(name for name in whole if not name.startswith("pictures/"))  # which no reader of ours opens
    said, accepted, before = set(), 0, set(os.listdir(tmp_path))
    start = peak_bytes(again=True)
    for number in range(DAMAGES):
        if number % 2:
            name, text = "reflect.json", json.dumps(spoil_document(rng, document)).encode()
        else:
            name = files[rng.integers(len(files))]
            text = spoil_bytes(rng, whole[name])
        (folder / name).write_bytes(text)
        try:
            read_one(folder, name)
            accepted += 1
            assert name == "reflect.json", f"damage {number} of {name} was not seen"
            if accepted % 3 == 0:  # the schema takes longer than the reader
                assert schema.is_valid(json.loads((folder / "reflect.json").read_text())), f"damage {number}: the schema refuses what the reader takes"
        except ReflectError as error:
            assert str(folder) in error.message and error.remedy, error
            said.add(error.message)
        (folder / name).write_bytes(whole[name])
    assert peak_bytes() - start < MOST_BYTES and set(os.listdir(tmp_path)) == before
    assert accepted < 0.25 * DAMAGES and len(said) > 0.2 * DAMAGES


def test_the_schema_is_one_and_this_is_of_it(saved):
    jsonschema = pytest.importorskip("jsonschema", reason="SKIPPED: no jsonschema; ./dev installs it")
    schema = json.loads(Path(checked.__file__).with_name("reflect.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.Draft202012Validator(schema).validate(json.loads((saved / "reflect.json").read_text()))
