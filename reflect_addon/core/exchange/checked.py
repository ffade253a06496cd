"""What a manifest may say: every value is looked at before it is used, and every refusal names the file and the field.

Nothing here touches a disk. typed_json.typed has seen to types; what is left are names, sizes, ids and numbers that must fit each other.
"""

import re
from pathlib import Path

from ..asset_document import IMAGE_NAME, MAX_SIDE, checked_fields
from ..errors import ReflectError
from ..planning.plan import plan_of
from ..typed_json import typed
from .manifest import (
    BAKES_NAME,
    BAKES_WHAT,
    DEFLATED,
    DIGITS,
    ENDINGS,
    FILE_NAME,
    FORMAT,
    GLSL,
    GODOT,
    LOOK_KIND,
    LOOK_SIZE,
    MAX_SLOTS,
    SCENE_NAME,
    SHADERS,
    WHAT,
    Answer,
    Bakes,
    Image,
    Manifest,
    Material,
    Shader,
    Text,
)  # fmt: skip

EXPORT_AGAIN = "Export it again."
MAX_BYTES = 4 << 30  # of all images' texels together
MAX_SHADER_BYTES, MAX_SCENE_BYTES, MAX_BAKES_BYTES = 4 << 20, 256 << 20, 256 << 20
MOST_FLOAT = 3.4e38
_WORD = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,79}")
_ID = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,79}-[0-9a-f]{%d}" % DIGITS)
_SHADER_ID = re.compile(r"[0-9a-f]{%d}" % DIGITS)
_PICTURE = re.compile(r"pictures/[A-Za-z0-9_~-]{1,120}-[0-9a-f]{%d}\.(?:png|exr)" % DIGITS)
_HASH = re.compile(r"[0-9a-f]{64}")


def manifest_of(document, path: Path) -> Manifest:
    """The manifest of a JSON value. ReflectError names `path` and the field."""
    return _checked(document, path, WHAT, Manifest, "the manifest", _check)


def bakes_of(document, path: Path, manifest: Manifest) -> Bakes:
    """What the value of its other file says, which must be what the manifest's answers need. ReflectError as above."""

    def check(bakes: Bakes, path: Path) -> None:
        for key, entry in bakes.assets.items():
            _asset(f"assets[{key[:60]!r}]", key, entry, manifest.images, path)
        for k, reflector in enumerate(manifest.reflectors):
            for method, answer in reflector.methods.items():
                name = f"{FILE_NAME}'s reflectors[{k}].methods[{method[:60]!r}]"
                _need(all(a in bakes.assets for a in answer.assets), f"{name}.assets", "names an asset that is not there")
                _need(bakes.assets[answer.assets[0]]["kind"] == answer.kind, f"{name}.kind", "is not its own asset's")
        if bakes.plan is not None:
            plan_of(bakes.plan)

    return _checked(document, path, BAKES_WHAT, Bakes, "the file", check)


def _checked(document, path: Path, what: str, kind, name: str, check):
    if not (isinstance(document, dict) and document.get("what") == what and type(document.get("format")) is int):
        raise ReflectError(f"{path} is no export of Reflect's.", "Point at a folder that `reflect export` wrote.")
    if document["format"] > FORMAT:
        raise ReflectError(f"{path} has format {document['format']}: it was made by a newer Reflect (this one reads {FORMAT}).", "Update the add-on or export again.")
    try:
        _need(document["format"] >= 1, "format", "is none that ever was")
        found = typed(kind, {key: value for key, value in document.items() if key not in ("what", "format")}, name)
        check(found, path)
    except ValueError as error:
        raise ReflectError(f"{path} is damaged: {error}.", EXPORT_AGAIN) from error
    return found


def _need(holds: bool, field: str, what: str) -> None:
    if not holds:
        raise ValueError(f"{field} {what}")


def _check(manifest: Manifest, path: Path) -> None:
    scene = manifest.scene
    _need(scene.file == SCENE_NAME, "scene.file", f"is not {SCENE_NAME}")
    _size("scene.bytes", scene.bytes, MAX_SCENE_BYTES)
    _hash("scene.sha256", scene.sha256)
    _need(manifest.bakes.file == BAKES_NAME, "bakes.file", f"is not {BAKES_NAME}")
    _size("bakes.bytes", manifest.bakes.bytes, MAX_BAKES_BYTES)
    _hash("bakes.sha256", manifest.bakes.sha256)
    for key, image in manifest.images.items():
        _image(f"images[{key[:60]!r}]", key, image)
    total = sum(image.texel_bytes() for image in manifest.images.values())
    _need(total <= MAX_BYTES, "images", f"declare {total / 2**30:.1f} GiB, more than {MAX_BYTES >> 30}")
    for key, shader in manifest.shaders.items():
        name = f"shaders[{key[:60]!r}]"
        _need(bool(_SHADER_ID.fullmatch(key)) and shader.sha256.startswith(key), name, "is no id of this content")
        _text(name, shader, GLSL)
        _text(f"{name}.godot", shader.godot, GODOT)
    _look(manifest)
    for k, material in enumerate(manifest.materials):
        _material(f"materials[{k}]", material)
    _need(manifest.surface in manifest.shaders, "surface", "is no shader of the manifest")
    for k, reflector in enumerate(manifest.reflectors):
        name = f"reflectors[{k}]"
        _need(0 <= reflector.node < 1 << 24, f"{name}.node", "is no node")
        _need(all(0 <= m < len(manifest.materials) for m in reflector.materials), f"{name}.materials", "names a material that is not there")
        for method, answer in reflector.methods.items():
            _answer(f"{name}.methods[{method[:60]!r}]", method, answer, manifest)
    for k, picture in enumerate(manifest.pictures):
        _picture(f"pictures[{k}]", picture)


def _size(field: str, count: int, most: int) -> None:
    _need(0 < count <= most, field, f"is {count}, not 1 to {most}")


def _hash(field: str, value: str) -> None:
    _need(bool(_HASH.fullmatch(value)), field, "is no checksum")


def _numbers(field: str, *numbers: float) -> None:
    _need(all(abs(n) <= MOST_FLOAT for n in numbers), field, "does not fit a 32-bit float")


def _image(field: str, key: str, image: Image) -> None:
    _hash(f"{field}.sha256", image.sha256)
    _need(image.kind in ENDINGS, f"{field}.kind", f"is none of {', '.join(ENDINGS)}")
    _need(bool(_ID.fullmatch(key)) and key.endswith(image.sha256[:DIGITS]), field, "is no id of this content")
    files = [f"images/{key}.{ending}" for ending in ENDINGS[image.kind]]
    _need(image.file in files, f"{field}.file", f"is not {' or '.join(files)}")
    for side in ("width", "height"):
        _size(f"{field}.{side}", getattr(image, side), MAX_SIDE)
    if image.kind == LOOK_KIND:
        _need((image.width, image.height) == LOOK_SIZE, field, f"is not {LOOK_SIZE[0]} x {LOOK_SIZE[1]} as a look is")
    body = image.texel_bytes()
    if image.kind == "bc1":
        _need(image.width % 4 == 0 and image.height % 4 == 0, field, "is no whole number of blocks")
        _need(image.bytes == body + 128, f"{field}.bytes", f"is not {body + 128}")
    _need(body <= DEFLATED * image.bytes, f"{field}.bytes", "is too little for a picture of this size")
    _size(f"{field}.bytes", image.bytes, body + body // 64 + (1 << 16) + 16 * image.height)  # deflate may add a little, headers and offsets do


def _text(field: str, text: Shader | Text, ending: str) -> None:
    _hash(f"{field}.sha256", text.sha256)
    file = f"{SHADERS}/{text.sha256[:DIGITS]}.{ending}"
    _need(text.file == file, f"{field}.file", f"is not {file}")
    _size(f"{field}.bytes", text.bytes, MAX_SHADER_BYTES)


def _look(manifest: Manifest) -> None:
    look = manifest.look
    _need(abs(look.exposure) <= 64, "look.exposure", "is beyond 64 stops")
    if look.table is not None:
        _need(look.table in manifest.images and manifest.images[look.table].kind == LOOK_KIND, "look.table", "is no look's image")


def _asset(field: str, key: str, entry: dict, images: dict[str, Image], path: Path) -> None:
    _need(bool(_ID.fullmatch(key)), field, "is no id")
    named = entry.get("images")
    _need(isinstance(named, dict), f"{field}.images", "is no table")
    for name, image in named.items():
        _need(bool(IMAGE_NAME.fullmatch(name)), f"{field}.images", "has a name that is none of an image")
        _need(isinstance(image, str) and image in images, f"{field}.images[{name!r}]", "is no image of the manifest")
        _need(images[image].kind == name.rpartition("_")[2], f"{field}.images[{name!r}]", "is an image of another kind")
    try:
        checked_fields(path, {name: value for name, value in entry.items() if name != "images"})
    except ReflectError as error:
        raise ValueError(f"{field}: {error.message.partition(': ')[2].rstrip('.')}") from error


def _material(field: str, material: Material) -> None:
    _numbers(field, *material.base_color, *material.specular_tint, material.metallic, material.ior, material.weight, material.roughness)
    _need(material.ior > 0, f"{field}.ior", "is not above 0")


def _answer(field: str, method: str, answer: Answer, manifest: Manifest) -> None:
    _need(bool(_WORD.fullmatch(method)) and bool(_WORD.fullmatch(answer.kind)), field, "is no method's name")
    _need(len(answer.assets) > 0 and all(_ID.fullmatch(a) for a in answer.assets), f"{field}.assets", "are no ids")
    _need(answer.shader in manifest.shaders, f"{field}.shader", "is no shader of the manifest")
    for sampler, image in answer.samplers.items():
        _need(bool(_WORD.fullmatch(sampler)) and "__" not in sampler, f"{field}.samplers", "has a name that no sampler may have")
        _need(image in manifest.images, f"{field}.samplers[{sampler!r}]", "is no image of the manifest")
    _need(len(answer.slots) <= MAX_SLOTS, f"{field}.slots", f"are more than {MAX_SLOTS}")
    _numbers(f"{field}.slots", *(n for slot in answer.slots for n in slot))
    _size(f"{field}.bytes", answer.bytes, 16 * MAX_BYTES)


def _picture(field: str, picture) -> None:
    _need(0 <= picture.node < 1 << 24, f"{field}.node", "is no node")
    _size(f"{field}.width", picture.width, MAX_SIDE)
    _size(f"{field}.height", picture.height, MAX_SIDE)
    _need(len(picture.projection) == 16, f"{field}.projection", "is not 16 numbers")
    _numbers(f"{field}.projection", *picture.projection)
    for name, file in (("behind", picture.behind), ("truth", picture.truth), *picture.methods.items()):
        ending = "exr" if name == "behind" else "png"
        _need(bool(_PICTURE.fullmatch(file)) and file.endswith(ending), f"{field}.{name[:60]}", f"is no .{ending} in pictures/")
