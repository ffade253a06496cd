"""Kernels of GLSL's dialects as jobs for a bench (gles_bench.py, godot/godot_bench.py), and an asset of every gathering method to run them on."""

import numpy as np
from baked_methods import SETTINGS, bake_all, scene_of_everything
from gles_bench import Job
from mesh_scenes import job as bake_job

from reflect_addon.core import bc1, methods
from reflect_addon.core.asset import Asset


def as_texture(image: np.ndarray) -> np.ndarray:
    """An asset's image as a sampler reads it."""
    if image.dtype != np.uint8:
        return image
    y, x = np.indices((image.shape[0] * bc1.SIDE, image.shape[1] * bc1.SIDE))
    rgb = bc1.texels(image, x, y)
    return np.concatenate([rgb, np.ones_like(rgb[..., :1])], -1).astype("f")


def job_of(kernel, asset: Asset, inputs: dict[str, np.ndarray]) -> Job:
    samplers = {sampler: as_texture(asset.images[name]) for name, sampler in kernel.images.items()}
    return Job(kernel.source, inputs, kernel.outputs, samplers, kernel.pack_uniforms(asset).reshape(-1, 4) if kernel.block_name else None, kernel.function)


def baked_everything() -> dict[str, Asset]:
    """Method -> asset, and a light field of blocks."""
    scene = scene_of_everything()
    found, method = bake_all(scene), methods.get("light_field")
    found["light_field of blocks"] = method.bake(bake_job(scene, {**method.DEFAULTS, **SETTINGS, "compressed": True}, {}))
    return found
