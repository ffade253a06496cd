"""Exports' manifests and files made wrong, field by field and at random, for the loaders of every program."""

import copy
import json

import numpy as np

POISON = [
    None, [], {}, "", 0, -1, 1, 2.5, True, 1e308, 10**400, 2**31, 16385, 10**9, "../outside", "/etc/passwd", "images/../../x.exr", "images\\x.exr", "a" * 1000, "\0",
    "C:\\x", "scene.gltf", [1, 2], [[]], {"a": 1}, "tx", "buf", "NaN", float("nan"), float("-inf"), "0" * 64, "0" * 12, "x-" + "0" * 12,
]  # fmt: skip


def first(document: dict, table: str) -> dict:
    return next(iter(document[table].values()))


def image_of_kind(document: dict, kind: str) -> dict:
    return next(image for image in document["images"].values() if image["kind"] == kind)


def answer(document: dict) -> dict:
    return document["reflectors"][0]["methods"]["environment"]


def put(table: str, **values):
    return lambda d: first(d, table).update(values)


def forget(table: str):
    return lambda d: d[table].__delitem__(next(iter(d[table])))


WRONG = {
    "another format": (lambda d: d.update(format=2), "newer Reflect"),
    "no format": (lambda d: d.update(format=0), "format"),
    "a field too many": (lambda d: d.update(more=1), "the manifest has other fields"),
    "a field too few": (lambda d: d.pop("bakes"), "the manifest has other fields"),
    "scene's name": (lambda d: d["scene"].update(file="../scene.gltf"), "scene.file"),
    "scene's size": (lambda d: d["scene"].update(bytes=7), "where reflect.json says 7"),
    "scene's checksum": (lambda d: d["scene"].update(sha256="0" * 64), "checksum"),
    "bakes' name": (lambda d: d["bakes"].update(file="../bakes.json"), "bakes.file"),
    "bakes' size": (lambda d: d["bakes"].update(bytes=7), "where reflect.json says 7"),
    "bakes' checksum": (lambda d: d["bakes"].update(sha256="0" * 64), "checksum"),
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
    "an asset's name": (lambda d: answer(d).update(assets=["../x"]), ".assets"),
    "no asset": (lambda d: answer(d).update(assets=[]), ".assets"),
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
    "no image": (forget("images"), ""),
    "no shader": (forget("shaders"), ""),
}  # fmt: skip

WRONG_BAKES = {
    "an asset's uniform": (lambda d: first(d, "assets")["uniforms"].update(radiance_scale="1"), "uniform"),
    "an asset's deep setting": (lambda d: first(d, "assets")["settings"].update(a=json.loads("[" * 400 + "]" * 400)), "too deeply"),
    "an asset's image": (lambda d: first(d, "assets")["images"].update(radiance_tx="x-" + "0" * 12), ".images"),
    "an asset's kind of image": (lambda d: first(d, "assets")["images"].update(a_buf=first(d, "assets")["images"]["radiance_tx"]), "another kind"),
    "a plan": (lambda d: d.update(plan={"what": "reflect plan", "format": 2}), "plan has other fields"),
    "an asset too few": (forget("assets"), "names an asset that is not there"),
    "an asset of another kind": (lambda d: first(d, "assets").update(kind="another"), ""),
    "another field": (lambda d: d.update(more=1), "other fields"),
    "another thing": (lambda d: d.update(what="reflect export"), "no export of Reflect's"),
}  # fmt: skip


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
