"""Virtual vertices on the GPU: the search kernel of core/reflection_search.py in a compute shader, for one part of a reflector.

The same recorded kernel as NumPy's. What fails searches again from where a neighbour ended: on parts that are not convex one start is
seldom good for all. Each part keeps what it found, from which the next frame's searches start.
"""

from dataclasses import dataclass

import numpy as np

from ..core import reflection_search
from ..core.asset import Asset
from ..core.kernel import GlslKernel, emit_glsl, record_function
from .compute import ComputeInfo
from .counts import Counts
from .program import call_text, program
from .upload import texture_from
from .virtual_draw import STATUSES, TABLES
from .virtual_scene import VirtualScene

MAPS = ("reflector_position_buf", "reflector_normal_buf")
# Passes in which what failed searches again, and how far a vertex looks for another to start from: in a chunk neighbours in place are
# neighbours in number. On a torus 64 % of the pixels are found without, 76 with one pass, 80, 82 and 84 % with more.
AGAIN, REACH = 3, 64
_WANTED = ("virtual", "direction", "status")
ARGUMENTS = {"observer": "observer", "vertex": "vec4(place, 1.0)", "start": "start", "block": "block", "ball": "ball", "cone": "cone"}


@dataclass
class Found:
    """What the searches of one piece have found."""

    virtual: object  # vertices in map space, w = status; shared, and so the last piece's
    place: object  # where the real ones are; shared too
    start: object  # directions from which the next frame's searches start
    placing: object = None  # the texture of `rows`
    rows: np.ndarray | None = None


class Search:
    """One asset's kernel, compiled, with its maps."""

    def __init__(self, asset: Asset, textures, counts: Counts):
        self.counts = counts
        kernel = search_kernel(asset)
        self._images = {sampler: textures.texture(name, asset.images[name]) for name, sampler in kernel.images.items()}
        call = call_text(kernel, ARGUMENTS, "found_")
        self.program, self.again = (
            program(
                ComputeInfo(
                    name="reflect_virtual_search",
                    compute="virtual_search.comp.glsl",
                    group=(64, 1, 1),
                    uniforms=(
                        *(("VEC4", name) for name in ("observer", "seed", "block", "ball", "cone")), ("VEC2", "range"), *more,
                    ),
                    samplers=(("FLOAT_2D", "vertices_buf"), ("FLOAT_2D", "placing_buf"), *(("FLOAT_2D", s) for s in self._images)),
                    images=(
                        ("RGBA16F", "FLOAT_2D", "start_img", "READ_WRITE"), ("RGBA32F", "FLOAT_2D", "virtual_img", "READ_WRITE"),
                        ("RGBA32F", "FLOAT_2D", "place_img", "WRITE"),
                    ),
                    generated=(("kernel", kernel.source), ("call", call)),
                    defines=TABLES + STATUSES + defines,
                ),
                counts,
            )
            for more, defines in (((), ()), ((("FLOAT", "pass"),), (("AGAIN", "1"), ("REACH", str(REACH)))))
        )  # fmt: skip

    def run(self, scene: VirtualScene, found: Found, observer: np.ndarray, part, ranges):
        """The vertices in `ranges`, each (first, count), for a piece (virtual_objects.TablePart). Nothing is read back."""
        self._dispatch(self.program, scene, found, observer, part, ranges)
        self.counts.searches += sum(count for _, count in ranges)
        for number in range(1, AGAIN + 1):
            self._dispatch(self.again, scene, found, observer, part, ranges, number)

    def _dispatch(self, shader, scene: VirtualScene, found: Found, observer: np.ndarray, part, ranges, again: int = 0):
        shader.bind()
        if again:
            shader.set("pass", again)
        for name, value in (("observer", observer), ("seed", part.start), ("block", part.block), ("ball", part.ball), ("cone", part.cone)):
            shader.set(name, value)
        shader.image("vertices_buf", scene.vertices_buf)
        shader.image("placing_buf", found.placing)
        for sampler, texture in self._images.items():
            shader.image(sampler, texture)
        for name, texture in (("start_img", found.start), ("virtual_img", found.virtual), ("place_img", found.place)):
            shader.store(name, texture)
        for first, count in ranges:
            shader.set("range", (first, count))
            shader.dispatch(count)


def search_kernel(asset: Asset) -> GlslKernel:
    """The search as the asset's options ask for it."""
    kernel = reflection_search.midpoint if asset.options["paper"] else reflection_search.newton
    options = {"steps": int(asset.options["search_steps"]), "tolerance": reflection_search.TOLERANCE}
    program = record_function(kernel, reflection_search.INPUTS, MAPS, options=options, name="reflection_point")
    return emit_glsl(program, _WANTED, "reflection_point")


def place(found: Found, rows: np.ndarray, counts: Counts):
    """rows: (instances, 3, 4), where they stand now in the part's space, beside which go the cofactors that turn normals; uploaded
    when one has moved."""
    cofactors = np.stack([np.cross(rows[:, (i + 1) % 3, :3], rows[:, (i + 2) % 3, :3]) for i in range(3)], 1)
    cofactors *= np.sign(np.linalg.det(rows[:, :, :3]))[:, None, None]
    rows = np.concatenate([rows, np.pad(cofactors, ((0, 0), (0, 0), (0, 1)))], 1).astype(np.float32)
    if found.rows is None or not np.array_equal(found.rows, rows):
        found.rows, found.placing = rows, texture_from("virtual placing", rows, counts, "RGBA32F")
