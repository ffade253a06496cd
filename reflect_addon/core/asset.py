"""A baked stand-in in memory. core/asset_files.py writes and reads it."""

from dataclasses import dataclass, field, replace

import numpy as np

from .asset_images import kind_of
from .snapshot import Instance

# What a half float may hold with its full 11 bits; images above it are stored divided by a power of two.
HALF_MAX = 65504.0


@dataclass(frozen=True)
class Part:
    """What a row of an asset's table stands for, as it was when the row was made: what core/remake.py compares."""

    instance: str  # Instance.name
    kind: str  # of stand-in, see remake.RULES; or 'reflector': the asset's own, without a row
    row: int  # of the method's table; -1 for the reflector
    world_from_object: tuple[float, ...]  # 16 numbers, row by row
    mesh: str  # Mesh.key

    def matrix(self) -> np.ndarray:
        """(4, 4) float64."""
        return np.array(self.world_from_object, np.float64).reshape(4, 4)


@dataclass(frozen=True)
class Asset:
    """What a method looks its answers up in, for one reflector (or for all: reflector == "").

    images: name ending in _tx (float16 (H, W, 4): radiance and what goes with it, filtered or fetched), _buf (float32
    (H, W, 4): tables, fetched exactly) or _bc1 (uint8 (H / 4, W / 4, 8): BC1 blocks). Row 0 is the bottom.
    uniforms: name -> float or tuple of 2 to 4 floats; changing one needs no new shader.
    options: name -> int, float, bool or str that the kernel reads while it is recorded; changing one makes another
    shader variant (a count of loop steps, a switch).
    """

    kind: str  # the method's name
    reflector: str  # the object's name; "" when it serves every reflector
    images: dict[str, np.ndarray]
    uniforms: dict[str, float | tuple[float, ...]] = field(default_factory=dict)
    options: dict[str, object] = field(default_factory=dict)
    settings: dict[str, object] = field(default_factory=dict)  # what the user asked for (resolution, samples ...)
    requires: tuple[str, ...] = ()  # kinds whose assets (of the same reflector) this one reads too
    inputs_hash: str = ""  # sha256 over everything the content depends on; differs from the scene's: stale
    source: str = "trace"  # what made it: 'trace' (Cycles) | 'capture' (GPU) | 'viewport'
    bake_seconds: float = 0.0
    parts: tuple[Part, ...] = ()  # what its rows stand for; () = not known, the asset cannot follow what moves
    light_hash: str = ""  # SceneSnapshot.light_hash that its radiance was made under
    items: dict[str, dict[str, str]] = field(default_factory=dict)  # scene_items.kept of what inputs_hash is over; {}: not known
    balls: dict[str, tuple[float, float, float, float]] = field(default_factory=dict)  # refresh.balls_of when it was made; {}: not known
    beside: tuple["Asset", ...] = ()  # those that it was joined with
    alone: "Asset | None" = None  # what it was before it was joined

    def bytes(self) -> int:
        """Memory on the GPU: 8 bytes a texel of _tx, 16 of _buf, half a byte of _bc1."""
        return sum(a.shape[0] * a.shape[1] * kind_of(name).bytes for name, a in self.images.items())

    def joined(self, *others: "Asset") -> "Asset":
        """This asset with the images, uniforms and options of those it requires. A name in two of them is an error."""
        parts = {"images": dict(self.images), "uniforms": dict(self.uniforms), "options": dict(self.options)}
        for other in others:
            for key, merged in parts.items():
                values = getattr(other, key)
                clash = merged.keys() & values.keys()
                if clash:
                    raise ValueError(f"assets {self.kind} and {other.kind} both have {key} {sorted(clash)}")
                merged.update(values)
        return replace(self, **parts, bake_seconds=self.bake_seconds + sum(o.bake_seconds for o in others), beside=others, alone=self)


def asset_of(assets: dict[str, Asset], reflector: Instance) -> Asset | None:
    """The asset that answers for a reflector: its own, its object's (one dupli for all), or the one for all."""
    return assets.get(reflector.name) or assets.get(reflector.object_name) or assets.get("")


def half_with_scale(radiance: np.ndarray) -> tuple[np.ndarray, float]:
    """(radiance / scale as float16, scale): scale is the smallest power of two >= 1 that keeps the peak finite.

    Non-finite input becomes 0, negative is kept. HDR suns of 7e4 and more survive (half floats end at 65504).
    """
    radiance = np.nan_to_num(np.asarray(radiance, np.float32), nan=0.0, posinf=0.0, neginf=0.0)
    peak = float(np.abs(radiance).max(initial=0.0))
    scale = float(2.0 ** max(0.0, np.ceil(np.log2(max(peak, 1.0) / HALF_MAX))))
    return (radiance / scale).astype(np.float16), scale
