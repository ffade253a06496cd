"""Images for shader nodes, and the two node groups that read them: an exact texel, and a bilinear sample of four."""

from pathlib import Path

import bpy
import numpy as np

from ..core.asset_images import size_of, texels
from ..core.asset_places import file_name
from .node_tree import TreeBuilder


def image_from(name: str, pixels: np.ndarray) -> bpy.types.Image:
    """A float image of the file holding an asset's image, row 0 at the bottom; float32 arrays keep their full precision, and
    BC1 blocks are decoded: what Blender reads of a packed .dds would be 8 bits."""
    width, height = size_of(pixels)
    half = pixels.dtype != np.float32
    if pixels.dtype == np.uint8:
        pixels = texels(pixels, np.arange(width), np.arange(height)[:, None])
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True, is_data=True)
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "CHANNEL_PACKED"  # alpha is data too: never multiplied in or divided out
    image.use_half_precision = half
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    image.update()
    return image


def keep_images(tree: bpy.types.NodeTree, pack: bool, folder: Path | None) -> None:
    """Makes the images of a group and of those in it last beyond this session: packed into the .blend, else written as .exr into
    the folder."""
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeGroup":
            keep_images(node.node_tree, pack, folder)
        image = getattr(node, "image", None)
        if image is None or image.source != "GENERATED":  # kept already
            continue
        if pack:
            image.pack()
        else:
            image.filepath_raw, image.file_format = str(folder / f"{file_name(image.name)}.exr"), "OPEN_EXR"
            folder.mkdir(parents=True, exist_ok=True)
            image.save()


def fetch_group(name: str, image: bpy.types.Image) -> bpy.types.NodeTree:
    """X, Y -> Color, Alpha of texel (floor X, floor Y), clamped to the edge."""
    build = TreeBuilder(name)
    build.socket("X", "Float", is_output=False)
    build.socket("Y", "Float", is_output=False)
    build.socket("Color", "Vector", is_output=True)
    build.socket("Alpha", "Float", is_output=True)
    width, height = image.size
    texel = build.vector("FLOOR", build.combine(*build.inputs.outputs[:2]))
    # Clamped here and not by the texture: Cycles turns coordinates beyond an int's range into texel 0.
    texel = build.vector("MINIMUM", build.vector("MAXIMUM", texel, (0.0, 0.0, 0.0)), (width - 1.0, height - 1.0, 0.0))
    scale, centre = (1.0 / width, 1.0 / height, 0.0), (0.5 / width, 0.5 / height, 0.0)
    look_up = build.node("ShaderNodeTexImage", image=image, interpolation="Closest", extension="EXTEND")
    build.plug(look_up.inputs["Vector"], build.vector("MULTIPLY_ADD", texel, scale, centre))
    build.finish(look_up)
    build.results(look_up.outputs["Color"], look_up.outputs["Alpha"])
    return build.tree


def sample_group(name: str, fetch: bpy.types.NodeTree) -> bpy.types.NodeTree:
    """X, Y in texels (centres at + 0.5) -> Color, Alpha: bilinear of four fetches, as k.sample states it."""
    build = TreeBuilder(name)
    build.socket("X", "Float", is_output=False)
    build.socket("Y", "Float", is_output=False)
    build.socket("Color", "Vector", is_output=True)
    build.socket("Alpha", "Float", is_output=True)
    low, high, weight = [], [], []
    for coordinate in build.inputs.outputs[:2]:
        shifted = build.math("SUBTRACT", coordinate, 0.5)
        low.append(build.math("FLOOR", shifted))
        high.append(build.math("ADD", low[-1], 1.0))
        weight.append(build.math("SUBTRACT", shifted, low[-1]))
    t00, t10, t01, t11 = (build.group(fetch, x, y) for y in (low[1], high[1]) for x in (low[0], high[0]))
    bottom = _mix(build, t00, t10, weight[0])
    top = _mix(build, t01, t11, weight[0])
    build.results(*_mix(build, bottom, top, weight[1]))
    return build.tree


def _mix(build: TreeBuilder, a, b, t):
    """a + (b - a) * t of a color and an alpha."""
    color = build.vector("MULTIPLY_ADD", build.vector("SUBTRACT", b[0], a[0]), t, a[0])
    return color, build.math("MULTIPLY_ADD", build.math("SUBTRACT", b[1], a[1]), t, a[1])
