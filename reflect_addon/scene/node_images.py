"""Images for shader nodes, and how nodes read them: an exact texel, and, as a group, a bilinear sample of four.

Problem. A method may have seven images; a material has a few samplers for all its textures, and artists a list to look through.
Idea. An asset's images become at most MOST data-blocks of the file: of those of one precision the smallest lie together in one, one above
another or side by side, and a look-up adds its image's place to the texel. Depths, addresses and tables are float32 and stay it, colours are
half floats. Look-ups take one exact texel ("Closest") and blend by themselves, so neither a neighbour's texels nor a level that a derivative
chooses is ever in them; clamping is to the image's own edge, not the data-block's.
Kept: Blender forgets generated pixels. Packed into the .blend or saved beside the asset they are EXR files of 32 bits, halves too: bit for bit.
"""

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ..core.asset_images import size_of, texels
from ..core.asset_places import file_name
from .node_report import images_of
from .node_tree import Source, TreeBuilder

MOST = 4  # data-blocks of a group: EEVEE binds a dozen textures of its own, OpenGL promises 16 a shader, and a material may have others
TALLEST = 16384  # texels along a side that graphics cards hold


@dataclass(frozen=True)
class Place:
    """Where one of an asset's images lies. at: its lower left texel; size: width, height."""

    image: bpy.types.Image
    at: tuple[int, int]
    size: tuple[int, int]


def images_from(name: str, pixels: dict[str, np.ndarray]) -> dict[str, Place]:
    """The data-blocks of a group, called "NAME IMAGE" or, of several, "NAME IMAGE, IMAGE"."""
    together = [(key,) for key in sorted(pixels)]
    while len(together) > MOST and (pair := _smallest_pair(together, pixels)) is not None:
        together = [group for group in together if group not in pair] + [pair[0] + pair[1]]
    places = {}
    for group in together:
        decoded = {key: _texels(pixels[key]) for key in group}
        corners, (width, height) = _arranged({key: size_of(d) for key, d in decoded.items()})
        whole = np.zeros((height, width, 4), np.float16 if _is_half(pixels[group[0]]) else np.float32)
        for key, (x, y) in corners.items():
            w, h = size_of(decoded[key])
            whole[y : y + h, x : x + w] = decoded[key]
        image = image_from(f"{name} {', '.join(group)}", whole)
        places |= {key: Place(image, corners[key], size_of(decoded[key])) for key in group}
    return places


def _smallest_pair(groups: list[tuple], pixels) -> tuple | None:
    """The two groups of one precision that are smallest together and fit into one image; None where there are none."""
    area = {g: int(np.prod(_arranged({k: size_of(pixels[k]) for k in g})[1])) for g in groups}
    pairs = [
        (a, b) for i, a in enumerate(groups) for b in groups[i + 1 :]
        if _is_half(pixels[a[0]]) == _is_half(pixels[b[0]]) and max(_arranged({k: size_of(pixels[k]) for k in a + b})[1]) <= TALLEST
    ]  # fmt: skip
    return min(pairs, key=lambda pair: area[pair[0]] + area[pair[1]], default=None)


def _arranged(sizes: dict[str, tuple[int, int]]) -> tuple[dict[str, tuple[int, int]], tuple[int, int]]:
    """(corners, size of the whole): one above another or side by side, whichever is smaller and not too long."""
    best = None
    for axis in (1, 0):
        corners, reach = {}, 0
        for key, size in sizes.items():
            corners[key] = (reach, 0) if axis == 0 else (0, reach)
            reach += size[axis]
        across = max(size[1 - axis] for size in sizes.values())
        whole = (reach, across) if axis == 0 else (across, reach)
        rank = (max(whole) > TALLEST, whole[0] * whole[1])
        if best is None or rank < best[0]:
            best = rank, corners, whole
    return best[1:]


def _is_half(pixels: np.ndarray) -> bool:
    return pixels.dtype != np.float32


def _texels(pixels: np.ndarray) -> np.ndarray:
    """BC1 blocks are decoded: what Blender reads of a packed .dds would be 8 bits."""
    if pixels.dtype != np.uint8:
        return pixels
    width, height = size_of(pixels)
    return texels(pixels, np.arange(width), np.arange(height)[:, None])


def image_from(name: str, pixels: np.ndarray) -> bpy.types.Image:
    """A float image of the file holding (height, width, 4) numbers, row 0 at the bottom; float32 arrays keep their full precision."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True, is_data=True)
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "CHANNEL_PACKED"  # alpha is data too: never multiplied in or divided out
    image.use_half_precision = _is_half(pixels)
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    image.update()
    return image


def keep_images(tree: bpy.types.NodeTree, pack: bool, folder: Path | None) -> None:
    """The pixels that a group reads, those of nested groups too, survive saving the file: packed into it, or as files in the folder. Raises
    OSError where that cannot be written."""
    for image in images_of(tree):
        if image.source != "GENERATED":
            continue  # kept already
        if pack:
            image.pack()
            continue
        folder.mkdir(parents=True, exist_ok=True)
        image.filepath_raw, image.file_format = str(folder / f"{file_name(image.name)}.exr"), "OPEN_EXR"
        try:
            image.save()
        except RuntimeError as error:
            raise OSError(f"{image.filepath_raw} cannot be written: {error}") from error
        image.filepath_raw = _beside(image.filepath_raw)


def _beside(path: str) -> str:
    """Relative to the open file, so that the two can be moved together; Blender changes it when the file is saved elsewhere. On another
    drive, or for a file that was never saved, the path itself."""
    try:
        return bpy.path.relpath(path) if bpy.data.filepath else path
    except ValueError:
        return path


def sample_group(build: TreeBuilder, place: Place) -> bpy.types.NodeTree:
    """X, Y in texels (centres at + 0.5) -> Color, Alpha: bilinear of four fetches, as k.sample states it."""
    for socket in ("X", "Y"):
        build.socket(socket, "Float", is_output=False)
    build.socket("Color", "Vector", is_output=True)
    build.socket("Alpha", "Float", is_output=True)
    low, high, weight = [], [], []
    for axis, coordinate in enumerate(build.inputs.outputs[:2]):
        shifted = build.math("SUBTRACT", coordinate, 0.5)
        first = build.math("FLOOR", shifted)
        weight.append(build.math("SUBTRACT", shifted, first))
        low.append(address(build, place, axis, first))
        high.append(address(build, place, axis, build.math("ADD", first, 1.0)))
    t00, t10, t01, t11 = (texel(build, place, x, y) for y in (low[1], high[1]) for x in (low[0], high[0]))
    bottom = _mix(build, t00, t10, weight[0])
    top = _mix(build, t01, t11, weight[0])
    build.results(*_mix(build, bottom, top, weight[1]))
    return build.tree


def address(build: TreeBuilder, place: Place, axis: int, whole: Source) -> Source:
    """The data-block's coordinate (0 to 1) of a whole texel of the image, clamped to its edge. By numbers and not by vectors: what a node does not
    use of its inputs lies in the shader's uniform block as well (node_report.py)."""
    last, texels = place.size[axis] - 1.0, place.image.size[axis]
    per_texel, begin = 1.0 / texels, (place.at[axis] + 0.5) / texels
    if isinstance(whole, float):
        return min(max(whole, 0.0), last) * per_texel + begin
    # Clamped here and not by the texture: Cycles turns coordinates beyond an int's range into texel 0.
    clamp = build.node("ShaderNodeClamp")
    for socket, source in zip(clamp.inputs, (whole, 0.0, last)):
        build.plug(socket, source)
    return build.math("MULTIPLY_ADD", build.finish(clamp).outputs[0], per_texel, begin)


def texel(build: TreeBuilder, place: Place, x: Source, y: Source, label: str = "") -> tuple[Source, Source]:
    """(color, alpha) at a coordinate."""
    look_up = build.node("ShaderNodeTexImage", label, image=place.image, interpolation="Closest", extension="EXTEND")
    build.plug(look_up.inputs["Vector"], build.combine(x, y))
    build.finish(look_up)
    return look_up.outputs["Color"], look_up.outputs["Alpha"]


def _mix(build: TreeBuilder, a, b, t):
    """a + (b - a) * t of a color and an alpha."""
    color = build.vector("MULTIPLY_ADD", build.vector("SUBTRACT", b[0], a[0]), t, a[0])
    return color, build.math("MULTIPLY_ADD", build.math("SUBTRACT", b[1], a[1]), t, a[1])
