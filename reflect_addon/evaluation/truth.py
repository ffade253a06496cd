"""The truth: Cycles' answer to exactly the rays that the shader answers, and a Cycles frame for the eye.

Both sides answer single rays: the method is asked with footprint 0 and the truth is traced along the ray map's ray, so
neither side filters. Noise of the truth is bounded by a second truth with another seed (the floor).

A ray starts on its reflector and would meet it again at distance 0 half of the time. It is therefore lifted off along
the shading normal by LIFT of the scene's diagonal, or by some float32 steps of its coordinates where those are larger: a
hundred times less than the hit errors that are reported, and enough for a concave reflector to see itself.

Tracing costs seconds, so a truth is kept in a folder under a hash of everything that it depends on: geometry, camera,
size, the rays themselves, samples, seeds and Blender's version. A kept file that does not read back is traced again.
"""

import hashlib
import io
import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from ..core.camera import Camera
from ..core.rays import Hits, RayMap, Rays
from ..core.safe_write import write_whole

FORMAT = 1
SEEDS = (1, 2)  # of the truth and of the second truth
LIFT = 1e-5  # of the scene's diagonal
LIFT_STEPS = 8 * 2.0**-23  # float32 steps of the largest coordinate


@dataclass(frozen=True)
class Truth:
    """For the covered pixels of a ray map, in row order."""

    hits: Hits
    second_radiance: np.ndarray  # (N, 3) float32, scene-linear: another seed
    frame: np.ndarray  # (H, W, 3) float32, scene-linear, row 0 at the bottom: what the camera sees in Cycles
    frame_glossy: np.ndarray  # (H, W, 3) float32: the mirror-like part of it


def lifted(ray_map: RayMap, diagonal: float) -> Rays:
    """The covered pixels' rays, started just above their reflector."""
    mask = ray_map.covered()
    origin = ray_map.origin[mask].astype(np.float64)
    step = np.maximum(LIFT * diagonal, LIFT_STEPS * np.abs(origin).max(-1, initial=0.0))
    return Rays((origin + ray_map.normal[mask] * step[:, None]).astype(np.float32), ray_map.direction[mask])


def key_of(ray_map: RayMap, camera: Camera, geometry_hash: str, samples: int, blender: str) -> str:
    """Name of a truth: hex digits of a sha256 over all that it depends on."""
    digest = hashlib.sha256(json.dumps([FORMAT, geometry_hash, camera.width, camera.height, samples, SEEDS, blender]).encode())
    for array in (camera.world_from_camera, camera.clip_from_camera, *_ray_arrays(ray_map)):
        digest.update(np.ascontiguousarray(array))
    return digest.hexdigest()[:32]


def truth_of(
    ray_map: RayMap,
    camera: Camera,
    diagonal: float,
    samples: int,
    trace: Callable,
    primary: Callable,
    kept: Path | None = None,
) -> Truth:
    """Traces the ray map twice and the frame once, or reads them back from the file `kept`.

    trace(rays, samples=, seed=) and primary(camera, samples=, seed=) are scene/raytrace.py's, bound to the scene.
    """
    count = int(ray_map.covered().sum())
    if kept is not None and (found := _read(kept, count, camera)) is not None:
        return found
    if count:
        rays = lifted(ray_map, diagonal)
        hits = trace(rays, samples=samples, seed=SEEDS[0])
        second = trace(rays, samples=samples, seed=SEEDS[1]).radiance
    else:
        none = np.zeros((0, 3), np.float32)
        hits, second = Hits(none, none, none, np.zeros(0, np.int32), np.zeros(0, bool)), none
    frame = primary(camera, samples=samples, seed=SEEDS[0])
    truth = Truth(hits, second, frame.combined, frame.glossy)
    if kept is not None:
        _write(kept, truth)
    return truth


def _ray_arrays(ray_map: RayMap):
    mask = ray_map.covered()
    return mask, ray_map.origin[mask], ray_map.direction[mask], ray_map.normal[mask]


def _write(path: Path, truth: Truth) -> None:
    arrays = {f.name: getattr(truth.hits, f.name) for f in fields(Hits) if f.name not in ("object_names", "glossy")}
    arrays |= {name: getattr(truth, name) for name in ("second_radiance", "frame", "frame_glossy")}
    names = np.frombuffer(json.dumps(truth.hits.object_names).encode(), np.uint8)
    content = io.BytesIO()
    np.savez(content, object_names=names, **arrays)
    write_whole(path, content.getvalue())


def _read(path: Path, count: int, camera: Camera) -> Truth | None:
    """None when there is no such file, or it was cut short or damaged: tracing again repairs it."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        names = tuple(json.loads(arrays.pop("object_names").tobytes()))
        rest = {name: arrays.pop(name) for name in ("second_radiance", "frame", "frame_glossy")}
        truth = Truth(Hits(**arrays, object_names=names), **rest)
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
        return None
    fits = len(truth.hits.radiance) == count and truth.frame.shape == (camera.height, camera.width, 3)
    return truth if fits else None
