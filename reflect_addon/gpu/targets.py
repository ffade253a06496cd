"""The ray map and the reflection buffer as textures: made once for a size, kept while the size stays."""

from functools import cached_property

import numpy as np

from ..core.rays import RayMap
from .counts import Counts
from .device import ensure
from .upload import check_size, read_texture

# Of a program that draws into a RayMapTarget.
RAY_MAP_OUTPUTS = (("VEC4", "origin_out"), ("VEC4", "direction_out"), ("VEC4", "normal_out"), ("VEC2", "material_out"))


class RayMapTarget:
    """docs/decisions.md, "Buffers on the GPU", and material_tx (RG32F): index into the snapshot's materials, cosine
    between normal and direction."""

    def __init__(self, width: int, height: int, counts: Counts):
        gpu = ensure()
        check_size("ray map", width, height)
        size = (width, height)
        self.width, self.height = width, height
        self.origin_tx, self.direction_tx, self.normal_tx = (
            gpu.types.GPUTexture(size, format="RGBA32F") for _ in range(3)
        )
        self.material_tx = gpu.types.GPUTexture(size, format="RG32F")
        self.depth_tx = gpu.types.GPUTexture(size, format="DEPTH_COMPONENT32F")
        self.textures = (self.origin_tx, self.direction_tx, self.normal_tx, self.material_tx)
        for texture in self.textures:
            texture.filter_mode(False)
        self.framebuffer = gpu.types.GPUFrameBuffer(depth_slot=self.depth_tx, color_slots=self.textures)
        self.bytes = width * height * (3 * 16 + 8 + 4)
        counts.allocations += 1

    def clear(self, window=None):
        """No reflector anywhere, nothing in front of anything; only within window (x, y, width, height) where there is one."""
        if window is not None:
            _clear(self.framebuffer, window, (0.0, 0.0, 0.0, -1.0))
            return
        self.origin_tx.clear(format="FLOAT", value=(0.0, 0.0, 0.0, -1.0))
        self.direction_tx.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
        self.normal_tx.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
        self.material_tx.clear(format="FLOAT", value=(-1.0, 0.0))
        with self.framebuffer.bind():
            self.framebuffer.clear(depth=1.0)

    def read(self, reflector_names: tuple[str, ...], counts: Counts) -> RayMap:
        origin, direction, normal = (read_texture(t, counts) for t in self.textures[:3])
        return RayMap(
            origin=origin[..., :3].copy(),
            direction=direction[..., :3].copy(),
            normal=normal[..., :3].copy(),
            reflector=np.rint(origin[..., 3]).astype(np.int32),
            width=normal[..., 3].copy(),
            spread=direction[..., 3].copy(),
            reflector_names=reflector_names,
        )


class Through:
    """What is seen through glass (glass.py): radiance, and in alpha 0: nothing, 1: a body, 2: a pane."""

    def __init__(self, width: int, height: int, counts: Counts):
        gpu = ensure()
        self.texture = gpu.types.GPUTexture((width, height), format="RGBA16F")
        self.texture.filter_mode(False)
        self.framebuffer = gpu.types.GPUFrameBuffer(color_slots=(self.texture,))
        self.bytes = width * height * 8
        counts.allocations += 1


class ReflectionTarget:
    """radiance_tx (rgb, a = coverage) and, as `beside` says, "position": position_tx (xyz, w = status), "distance":
    distance_tx (R32F, m along the ray), or None; depth_tx where something is drawn into it."""

    def __init__(
        self, width: int, height: int, beside: str | None, counts: Counts, radiance_format: str = "RGBA16F", depth: bool = False
    ):
        gpu = ensure()
        self.width, self.height, self.beside, self._counts = width, height, beside, counts
        self.depth_tx = gpu.types.GPUTexture((width, height), format="DEPTH_COMPONENT32F") if depth else None
        self.radiance_tx = gpu.types.GPUTexture((width, height), format=radiance_format)
        self.radiance_tx.filter_mode(False)
        self.position_tx = self.distance_tx = None
        slots = [self.radiance_tx]
        if beside == "position":
            self.position_tx = gpu.types.GPUTexture((width, height), format="RGBA32F")
            slots.append(self.position_tx)
        elif beside == "distance":
            self.distance_tx = gpu.types.GPUTexture((width, height), format="R32F")
            slots.append(self.distance_tx)
        slots[-1].filter_mode(False)
        with_depth = {"depth_slot": self.depth_tx} if depth else {}
        self.framebuffer = gpu.types.GPUFrameBuffer(color_slots=slots, **with_depth)
        more = {"position": 16, "distance": 4, None: 0}[beside] + 4 * depth
        self._bytes = width * height * ((8 if radiance_format == "RGBA16F" else 16) + more)
        counts.allocations += 1

    @cached_property
    def through(self) -> Through:
        """Made when glass first asks for it, empty."""
        made = Through(self.width, self.height, self._counts)
        made.texture.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
        return made

    @property
    def bytes(self) -> int:
        return self._bytes + (self.through.bytes if "through" in vars(self) else 0)

    def clear(self, window=None):
        """Nothing answered; only within window (x, y, width, height) where there is one."""
        glass = self.through if "through" in vars(self) else None
        if window is not None:
            for framebuffer in (self.framebuffer, *((glass.framebuffer,) if glass else ())):
                _clear(framebuffer, window, (0.0, 0.0, 0.0, 0.0))
            return
        for texture in (self.radiance_tx, self.position_tx, glass and glass.texture):
            if texture is not None:
                texture.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
        if self.distance_tx is not None:
            self.distance_tx.clear(format="FLOAT", value=(0.0,))
        if self.depth_tx is not None:
            with self.framebuffer.bind():
                self.framebuffer.clear(depth=1.0)


class LevelTarget:
    """The picture of a mirrored view: color_tx (RGBA16F, alpha 1 where there is something) and place_tx (RGBA32F, xyz world)."""

    def __init__(self, width: int, height: int, counts: Counts):
        gpu = ensure()
        check_size("mirrored view", width, height)
        self.width, self.height = width, height
        self.color_tx = gpu.types.GPUTexture((width, height), format="RGBA16F")
        self.place_tx = gpu.types.GPUTexture((width, height), format="RGBA32F")
        self._depth_tx = gpu.types.GPUTexture((width, height), format="DEPTH_COMPONENT32F")
        for texture in (self.color_tx, self.place_tx):
            texture.filter_mode(False)
        self.framebuffer = gpu.types.GPUFrameBuffer(depth_slot=self._depth_tx, color_slots=(self.color_tx, self.place_tx))
        self.lit = gpu.types.GPUFrameBuffer(color_slots=(self.color_tx,))  # light is added to what is there
        self.bytes = width * height * (8 + 16 + 4)
        counts.allocations += 1

    def clear(self, window):
        """Nothing within window (x, y, width, height)."""
        _clear(self.framebuffer, window, (0.0, 0.0, 0.0, 0.0))


def _clear(framebuffer, window, color):
    """All attachments within window; depth is farthest."""
    state = ensure().state
    with framebuffer.bind():
        state.scissor_set(*window)
        state.scissor_test_set(True)
        framebuffer.clear(color=color, depth=1.0)
        state.scissor_test_set(False)
