"""teapots: four mirror teapots on a chequered ground under an HDR world (popescu-2006, Fig. 1).

Claim: with R = 4 reflectors every teapot reflects the three others, R(R-1) = 12 second-order reflections, and the world
alone cannot show them: what `environment` misses here is the other teapots and the parallax of the ground.
"""

import math
import tempfile
from pathlib import Path

import bpy
import numpy as np

from sample_blends import scene_parts as parts
from sample_blends.teapot_data import tessellate

WORLD = "courtyard.exr"
SCALE = 0.1  # Newell's units to metres: a teapot 0.315 m high


def small_world(name, height=256):
    """A world of the Blender wheel, averaged down to 2 `height` x `height`, as half-float EXR packed into this file."""
    bpy.utils.expose_bundled_modules()
    import OpenImageIO as oiio

    source = Path(bpy.utils.resource_path("LOCAL")) / "datafiles" / "studiolights" / "world" / name
    pixels = oiio.ImageBuf(str(source)).get_pixels(oiio.FLOAT)[..., :3]
    factor = pixels.shape[0] // height
    pixels = pixels.reshape(height, factor, 2 * height, factor, 3).mean(axis=(1, 3))
    with tempfile.TemporaryDirectory(prefix="reflect-") as folder:
        path = Path(folder) / name
        spec = oiio.ImageSpec(2 * height, height, 3, oiio.HALF)
        spec.attribute("compression", "dwaa:150")
        spec.attribute("DateTime", "2026:01:01 00:00:00")  # else the time of the build is written
        out = oiio.ImageOutput.create(str(path))
        if not (out.open(str(path), spec) and out.write_image(np.minimum(pixels, 65504.0).astype(np.float32))):
            raise OSError(f"{path}: {out.geterror()}")
        out.close()
        image = bpy.data.images.load(str(path))
        image.pack()
    image.filepath_raw = f"//{name}"
    image.name = name
    return image


def build():
    scene = parts.start("teapots")
    parts.set_world_image(scene, small_world(WORLD), turn=math.radians(200))
    vertices, faces = tessellate(8)
    ground = parts.checker("Chequered ground", (0.75, 0.72, 0.66), (0.12, 0.2, 0.3), 0.25)
    parts.box("Ground", (3.0, 3.0, 0.04), (0, 0, -0.02), ground)
    silver = parts.mirror("Silver", (0.93, 0.93, 0.92))
    gold = parts.mirror("Gold", (1.0, 0.78, 0.42))
    copper = parts.mirror("Copper", (0.96, 0.64, 0.54))
    places = [
        ("Front", (0.0, -0.42), 200, silver),
        ("Left", (-0.62, 0.02), 25, copper),
        ("Right", (0.62, 0.08), 150, gold),
        ("Back", (0.02, 0.55), -40, silver),
    ]
    shared = {}  # one mesh a metal: front and back are the same mesh twice
    for name, (x, y), degrees, surface in places:
        turned = {"location": (x, y, 0.0), "rotation": (0, 0, math.radians(degrees))}
        if surface in shared:
            parts.add(f"Teapot {name}", shared[surface], **turned)
        else:
            shared[surface] = parts.mesh(f"Teapot {name}", vertices * SCALE, faces, surface, **turned).data
    parts.camera((0.12, -1.75, 0.72), (0.0, -0.02, 0.13), lens=42)


if __name__ == "__main__":
    build()
    parts.save(parts.HERE / "teapots.blend")
