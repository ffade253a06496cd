"""Mirrors beyond the last level, answered from the branch's own pictures (core/mirror_series.py): one pass for each, over the pixels that show it.

The pictures are those of the views on the way from the eye, which are in their levels' targets while a branch is drawn: surfaces, places
and ray maps are there, what mirrors add is not yet, and each leg adds it.
"""

from collections.abc import Sequence

import numpy as np

from ..core import mirror_series, spaces, virtual_lamps
from ..core.asset import Asset
from ..core.kernel import emit_glsl, emitted, record_function
from ..core.methods import recursive
from ..core.mirror_planes import MirrorPlane
from ..core.mirror_series import PICTURES, ROWS
from .asset_inputs import AssetInputs
from .background import FULLSCREEN
from .counts import Counts
from .device import ensure
from .fill import RAYS, stored
from .level_programs import MIRROR_UNIFORMS
from .level_targets import Level, Seen
from .program import Program, ProgramInfo, call_text, program
from .resolve import Resolve
from .resolve_kernels import fade_parts
from .resolve_tables import MaterialTable
from .shown_mirrors import near_plane
from .texture_cache import TextureCache
from .virtual_lamps import Lamps

_STRUCT = f"struct ReflectSeries {{ vec4 of[{PICTURES * len(ROWS)}]; }};"
_REST = {"origin": "start", "direction": "along", "width": "width", "spread": "spread"}
_MARCH = {
    "picture": "float(at)", "start": "from", "direction": "along", "eye": "eye.xyz", "forward": "forward.xyz", "row_x": "row_x", "row_y": "row_y", "row_w": "row_w",
    "window": "window", "footprint": "eye.w", "reach": "reach",
}  # fmt: skip


class MirrorSeries:
    """Of one renderer."""

    def __init__(self, counts: Counts, textures: TextureCache, batch):
        self._counts, self._textures, self._batch = counts, textures, batch
        self._infos: dict[tuple, tuple[Asset, ProgramInfo, AssetInputs]] = {}
        self._rows = None  # the uniform buffer of the pictures' rows

    def keep_only(self, assets):
        """Let go of what was made of other assets."""
        self._infos = {key: made for key, made in self._infos.items() if any(made[0] is asset for asset in assets)}

    def prepare(self, planes: Sequence[MirrorPlane], assets: dict[int, Asset], resolve: Resolve, beside: str | None, lamps: Lamps):
        """Compile now, for sharp mirrors that may see others. assets: by reflector."""
        sharp = [plane.reflector for plane in planes if plane.roughness[1] == 0]
        for reflector in sharp if len(sharp) > 1 else ():
            program(self._made(assets[reflector], resolve, beside, lamps)[1], self._counts)

    def draw(self, window, plane: MirrorPlane, pictures: Sequence[tuple[Level, np.ndarray]], first: int, seen: Seen, asset: Asset,
             resolve: Resolve, materials: MaterialTable, lamps: Lamps, per_metre: float, reach: float):  # fmt: skip
        """A mirror without a view, as answers to its rays within window (x, y, width, height px of the schedule's picture). pictures: levels' targets and their rows (mirror_series.rows_of); first: which of them
        is the mirror's own; asset: of its reflector; per_metre: unit of depth in reflection buffers; reach: m, beyond everything."""
        gpu, target, (x, y, width, height) = ensure(), seen.target, window
        with target.framebuffer.bind():
            target.framebuffer.viewport_set(0, 0, target.width, target.height)
            gpu.state.blend_set("NONE")
            gpu.state.depth_test_set("LESS")
            gpu.state.depth_mask_set(True)
            gpu.state.scissor_set(x - seen.corner[0], y - seen.corner[1], width, height)
            gpu.state.scissor_test_set(True)
            shader = self._bound(asset, resolve, target.beside, lamps, pictures)
            for name, texture in zip(RAYS, seen.rays.textures, strict=False):
                shader.image(name, texture)
            shader.image("materials_tx", materials.texture)
            shader.set("plane_origin", (*plane.origin, near_plane(plane, seen.camera)))
            shader.set("plane_normal", (*plane.normal, plane.reflector))
            shader.set("sizes_per_metre", per_metre)
            shader.set("at_first", first)
            shader.set("reach", reach)
            shader.draw(self._batch)
            gpu.state.scissor_test_set(False)
            gpu.state.depth_mask_set(False)
            gpu.state.depth_test_set("NONE")
        self._counts.passes += 1

    def _bound(self, asset: Asset, resolve: Resolve, beside: str | None, lamps: Lamps, pictures) -> Program:
        _, info, inputs = self._made(asset, resolve, beside, lamps)
        shader = program(info, self._counts)
        shader.bind()
        inputs.bind(shader)
        rows = np.zeros((PICTURES, len(ROWS), 4), np.float32)
        rows[: len(pictures)] = [found for _, found in pictures]
        if self._rows is None:
            self._rows = ensure().types.GPUUniformBuf(rows.ravel())
        else:
            self._rows.update(rows.ravel())
        shader.block("series", self._rows)
        for i in range(PICTURES):
            level, _ = pictures[min(i, len(pictures) - 1)]
            for name, texture in zip(_names(i), (level.picture.color_tx, level.picture.place_tx, level.rays.material_tx), strict=True):
                shader.image(name, texture)
        if len(lamps.rows):
            shader.image("lamps_buf", lamps.texture)
        if resolve.plan.attenuation:
            shader.set("half_distance", resolve.half_distance)
        return shader

    def _made(self, asset: Asset, resolve: Resolve, beside: str | None, lamps: Lamps):
        """(the asset, its program, what its kernel reads)."""
        key = id(asset), resolve.plan, beside, bool(len(lamps.rows))
        if key not in self._infos:
            kernel = emitted(recursive.trace, asset, ("radiance", "coverage"))
            inputs = AssetInputs(kernel, asset, self._textures)
            self._infos[key] = asset, _info(kernel, inputs, resolve, beside, key[-1]), inputs
        return self._infos[key]

    def free(self):
        self._infos, self._rows = {}, None


def _names(i: int) -> tuple[str, str, str]:
    """Samplers of picture i: its colours, places and materials."""
    return f"picture{i}_tx", f"place{i}_tx", f"material{i}_tx"


def _info(kernel, inputs: AssetInputs, resolve: Resolve, beside: str | None, lamps: bool) -> ProgramInfo:
    outputs, store = stored(beside)
    reflectance, reflectance_call = resolve.reflectance_parts()
    fade, fade_call = fade_parts("met.along", "through") if resolve.plan.attenuation else ("", "")
    recorded = record_function(mirror_series.march, mirror_series.INPUTS, mirror_series.IMAGES)
    march = emit_glsl(recorded, ("radiance", "distance", "found", "pixel"), "march_mirrors", prefix="")
    names = (*RAYS, "materials_tx", *inputs.samplers, *(("lamps_buf",) if lamps else ()), *(n for i in range(PICTURES) for n in _names(i)))
    numbers = {
        "PICTURES": PICTURES, "ROWS": len(ROWS), **{name.upper(): i for i, name in enumerate(ROWS)}, "LEGS": mirror_series.LEGS,
        "LEAST": f"{mirror_series.LEAST:.6f}", "STATUS_HIT": f"{spaces.STATUS_HIT:.1f}", "FAR": f"{spaces.FAR:.1f}",
        **({"LAMPS": 1, "ELLIPSE": f"{virtual_lamps.ELLIPSE:.1f}", "BALL": f"{virtual_lamps.BALL:.1f}"} if lamps else {}),
    }  # fmt: skip
    return ProgramInfo(
        name="reflect_mirror_series",
        fragment="mirror_series.frag.glsl",
        blocks=((_STRUCT, "ReflectSeries", "series"), *inputs.blocks),
        uniforms=(*MIRROR_UNIFORMS[:3], ("FLOAT", "at_first"), ("FLOAT", "reach"), *((("FLOAT", "half_distance"),) if fade else ())),
        samplers=tuple(("FLOAT_2D", name) for name in names),
        outputs=(("VEC4", "radiance_out"), *outputs),
        generated=(
            ("kernel", kernel.source), ("march", march.source), ("march_call", call_text(march, _MARCH, "march_")), ("reflectance", reflectance + fade),
            ("reflectance_call", reflectance_call), ("fade", fade_call), ("call", call_text(kernel, _REST, "rest_")), ("store_answer", store),
        ),
        defines=tuple((name, str(value)) for name, value in numbers.items()),
        depth="ANY",
        **FULLSCREEN,
    )  # fmt: skip
