"""A second reader of exports, written from docs/export-format.md alone: it shares no line with Reflect's and imports nothing of it.

Only what the page says is used. Images come through OpenImageIO, blocks through the published decoding of DXT1.
"""

import json
import struct
from pathlib import Path

import numpy as np


class Page:
    """An export's folder."""

    def __init__(self, folder: Path):
        self.folder = Path(folder)
        self.manifest = json.loads((self.folder / "reflect.json").read_text(encoding="utf-8"))
        assert self.manifest["what"] == "reflect export" and self.manifest["format"] == 1
        self.bakes = json.loads((self.folder / self.manifest["bakes"]["file"]).read_text(encoding="utf-8"))
        assert self.bakes["what"] == "reflect bakes" and self.bakes["format"] == 1
        self.scene = json.loads((self.folder / self.manifest["scene"]["file"]).read_text(encoding="utf-8"))

    def image(self, key: str) -> np.ndarray:
        """(H, W, 4), row 0 of the texture first: the bottom row of the picture."""
        image = self.manifest["images"][key]
        path = self.folder / image["file"]
        kind = "float" if image["kind"] == "buf" else "half"
        texels = {".dds": lambda: dxt1(path.read_bytes()), ".ktx2": lambda: ktx2(path.read_bytes()), ".exr": lambda: exr(path, kind)}[path.suffix]()
        assert texels.shape == (image["height"], image["width"], 4)
        return texels[::-1]

    def shader(self, key: str) -> str:
        return (self.folder / self.manifest["shaders"][key]["file"]).read_text(encoding="ascii")

    def godot(self, key: str) -> str:
        """The same in Godot's language."""
        return (self.folder / self.manifest["shaders"][key]["godot"]["file"]).read_text(encoding="ascii")

    def program(self, reflector: int, method: str) -> tuple[str, dict[str, np.ndarray], np.ndarray]:
        """(functions, texture of each sampler, (n, 4) uniforms) of a method's answer."""
        answer = self.manifest["reflectors"][reflector]["methods"][method]
        samplers = {name: self.image(key) for name, key in answer["samplers"].items()}
        return self.shader(answer["shader"]), samplers, np.array(answer["slots"], "f").reshape(-1, 4)

    def node(self, reflector: int) -> dict:
        """The glTF's, which must point back."""
        node = self.scene["nodes"][self.manifest["reflectors"][reflector]["node"]]
        assert node["extensions"]["REFLECT_reflections"]["reflector"] == reflector
        return node

    def shown(self, radiance: np.ndarray) -> np.ndarray:
        """(..., 3) scene-linear radiance through the look."""
        look = self.manifest["look"]
        exposed = np.maximum(np.asarray(radiance, np.float64) * 2.0 ** look["exposure"], 0)
        if look["table"] is None:
            x = np.clip(exposed, 0, 1)
            return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
        table = self.image(look["table"])[..., :3].astype(np.float64)
        at = np.clip(np.log2(exposed / 2**-7 + 1) / np.log2(128 / 2**-7 + 1), 0, 1) * 63
        low = np.minimum(np.floor(at).astype(int), 62)
        out = np.zeros(exposed.shape)
        for red in (0, 1):
            for green in (0, 1):
                for blue in (0, 1):
                    r, g, b = (low[..., k] + step for k, step in enumerate((red, green, blue)))
                    weight = np.prod([1 - np.abs(at[..., k] - v) for k, v in enumerate((r, g, b))], axis=0)
                    out += weight[..., None] * table[g, 64 * b + r]
        return out


def exr(path: Path, kind: str) -> np.ndarray:
    """(H, W, channels), the picture's top row first."""
    import bpy

    bpy.utils.expose_bundled_modules()
    import OpenImageIO

    source = OpenImageIO.ImageInput.open(str(path))
    pixels = source.read_image(kind)
    source.close()
    return pixels


def ktx2(data: bytes) -> np.ndarray:
    """(H, W, 4), the picture's top row first."""
    import zstandard

    vk, _, width, height, *_, scheme = struct.unpack_from("<9I", data, 12)
    start, length, size = struct.unpack_from("<3Q", data, 80)
    level = data[start : start + length]
    body = zstandard.ZstdDecompressor().decompress(level, max_output_size=size) if scheme == 2 else level
    return np.frombuffer(body, {97: "<f2", 109: "<f4"}[vk]).reshape(height, width, 4)


def dxt1(data: bytes) -> np.ndarray:
    """(H, W, 4) float32, the picture's top row first, alpha 1."""
    assert data[:4] == b"DDS " and data[84:88] == b"DXT1"
    height, width = struct.unpack_from("<2I", data, 12)
    blocks = np.frombuffer(data, np.uint8, offset=128).reshape(height // 4, width // 4, 8)
    ends = blocks[..., :4].copy().view("<u2").astype(int)
    colours = np.stack([(ends >> 11) / 31, (ends >> 5 & 63) / 63, (ends & 31) / 31], -1)  # (rows, columns, 2, 3)
    first, second = colours[..., 0, :], colours[..., 1, :]
    four = (ends[..., 0] > ends[..., 1])[..., None]
    third = np.where(four, (2 * first + second) / 3, (first + second) / 2)
    fourth = np.where(four, (first + 2 * second) / 3, 0)
    palette = np.stack([first, second, third, fourth], 2)
    bits = blocks[..., 4:].copy().view("<u4")[..., 0]
    which = np.stack([bits >> 2 * k & 3 for k in range(16)], -1)  # texel k: column k % 4 of row k // 4, the top row first
    rgb = np.take_along_axis(palette, which[..., None].astype(int), 2).reshape(height // 4, width // 4, 4, 4, 3)
    rgb = rgb.transpose(0, 2, 1, 3, 4).reshape(height, width, 3)
    return np.concatenate([rgb, np.ones_like(rgb[..., :1])], -1).astype("f")
