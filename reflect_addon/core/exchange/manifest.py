"""The manifest of an export as data: docs/export-format.md says what each field means, reflect.schema.json says the same as a JSON schema.

Dataclasses in the order of the page; typed_json.typed reads them, checked.py looks at their values.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from ..asset import Asset
from ..asset_document import checked_fields, document_of, plain
from ..asset_images import kind_of
from ..look import TABLE_SIDE

WHAT, FORMAT = "reflect export", 1
BAKES_WHAT = "reflect bakes"
FILE_NAME, SCENE_NAME, BAKES_NAME, EXTENSION = "reflect.json", "scene.gltf", "bakes.json", "REFLECT_reflections"
IMAGES, SHADERS, PICTURES = "images", "shaders", "pictures"
GLSL, GODOT = "glsl", "gdshaderinc"  # endings of kernels' files
DIGITS = 12  # of a content's SHA-256 that its file's name holds
LOOK_KIND, LOOK_SIZE = "look", (TABLE_SIDE**2, TABLE_SIDE)
ENDINGS = {"tx": ("exr", "ktx2"), "buf": ("exr", "ktx2"), "bc1": ("dds",), LOOK_KIND: ("exr", "ktx2")}  # the first one where nothing is asked for
DEFLATED = 1032  # bytes that deflate makes one of at most: a small file that declares a large picture is a trap
MAX_SLOTS = 224  # vec4s of a fragment shader's uniforms that WebGL 2 promises


@dataclass(frozen=True)
class SceneFile:
    file: str
    name: str
    bytes: int
    sha256: str


@dataclass(frozen=True)
class Look:
    exposure: float  # stops
    table: str | None  # image id


@dataclass(frozen=True)
class Image:
    file: str
    kind: str  # of ENDINGS
    width: int  # texels
    height: int
    bytes: int
    sha256: str

    def texel_bytes(self) -> int:
        """Memory of its texels."""
        return self.width * self.height // 2 if self.kind == "bc1" else self.width * self.height * (16 if self.kind == "buf" else 8)


@dataclass(frozen=True)
class Text:
    file: str
    bytes: int
    sha256: str


@dataclass(frozen=True)
class Shader:
    """A kernel in two languages: a loader reads one of them. The id is of the first."""

    file: str  # GLSL ES 3.00
    bytes: int
    sha256: str
    godot: Text


@dataclass(frozen=True)
class Bakes:
    """What Reflect makes assets again from, which nobody else needs: in a file of its own, as long as the fingerprints of all that was baked."""

    assets: dict[str, dict]  # core/asset_document.document_of and `images`: name -> image id
    plan: dict | None


@dataclass(frozen=True)
class Material:
    """What mirrors, by the name that it has in glTF."""

    name: str
    base_color: tuple[float, float, float]
    metallic: float
    specular_tint: tuple[float, float, float]
    ior: float
    weight: float
    roughness: float


@dataclass(frozen=True)
class Answer:
    """What one method answers a reflector's rays with."""

    kind: str  # the method that answers
    assets: tuple[str, ...]  # ids, its own first
    shader: str
    samplers: dict[str, str]  # sampler2D -> image id
    slots: tuple[tuple[float, float, float, float], ...]
    bytes: int  # on the graphics card


@dataclass(frozen=True)
class Reflector:
    name: str  # Instance.name
    node: int
    materials: tuple[int, ...]
    methods: dict[str, Answer]


@dataclass(frozen=True)
class Picture:
    camera: str
    node: int
    width: int
    height: int
    projection: tuple[float, ...]  # 16 numbers, column by column: clip space (z in -1..1) from the camera, which looks down -z
    behind: str
    truth: str
    methods: dict[str, str]


@dataclass(frozen=True)
class Manifest:
    generator: str
    scene: SceneFile
    look: Look
    images: dict[str, Image]
    shaders: dict[str, Shader]
    bakes: Text
    materials: tuple[Material, ...]
    surface: str  # shader id
    reflectors: tuple[Reflector, ...]
    pictures: tuple[Picture, ...]

    def texts(self) -> tuple[Shader | Text, ...]:
        """All files of kernels."""
        return (*self.shaders.values(), *(shader.godot for shader in self.shaders.values()))

    def files(self) -> set[str]:
        """Of all that it names, below the folder; what the glTF names is beside them."""
        drawn = {name for p in self.pictures for name in (p.behind, p.truth, *p.methods.values())}
        return {FILE_NAME, self.scene.file, self.bakes.file, *(i.file for i in self.images.values()), *(s.file for s in self.texts())} | drawn


def text_of(manifest: Manifest) -> bytes:
    """The file's content."""
    return (json.dumps({"what": WHAT, "format": FORMAT, **asdict(manifest)}, indent=1, allow_nan=False, default=plain) + "\n").encode()


def bakes_text_of(bakes: Bakes) -> bytes:
    """The content of its file."""
    return (json.dumps({"what": BAKES_WHAT, "format": FORMAT, **asdict(bakes)}, allow_nan=False, default=plain) + "\n").encode()


def asset_entry(asset: Asset, images: dict[str, str]) -> dict:
    """A line of `assets`: the asset without its images, and which these are. ValueError for what could not be read back."""
    document = json.loads(json.dumps(document_of(asset), allow_nan=False, default=plain))
    checked_fields(Path(FILE_NAME), document)
    return {**document, "images": images}


def shape_of(image: Image) -> tuple[int, int, int]:
    """Of the array that an asset keeps."""
    kind = kind_of(f"_{image.kind}")
    return (image.height // kind.side, image.width // kind.side, kind.items)
