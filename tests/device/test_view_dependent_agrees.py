"""core/hit_shading.py: NumPy against GLSL, through the fill shader, on a scene with glossy things, mirrors and two lamps."""

from dataclasses import replace

import numpy as np
import pytest
import tolerances
import trimesh
from analytic import unit
from baked_methods import SETTINGS, is_on_the_brink, rays_of_all_kinds, same_answer, scene_of_everything
from mesh_scenes import job, smooth_mirror, snapshot, world_mesh

from reflect_addon.core import methods
from reflect_addon.core.kernel import record, run_numpy
from reflect_addon.core.rays import Rays
from reflect_addon.core.snapshot import Material

COUNT = 20_000
PLASTIC = Material("plastic", roughness=0.3)
BRASS = Material("brass", metallic=1.0, roughness=0.35, base_color=(0.9, 0.7, 0.3))
DULL = Material("dull", specular_weight=0.0)


def asset_of(name: str):
    everything = scene_of_everything()
    named = {i.name: world_mesh(everything, i) for i in everything.instances}
    plastic = smooth_mirror(named["Torus"], PLASTIC)
    brass = named["Crate"]
    brass.metadata["material"] = BRASS
    panel = trimesh.creation.box((0.5, 0.5, 0.01)).apply_translation([1.0, 0.8, 1.3])
    bulb = trimesh.creation.icosphere(2, 0.1).apply_translation([-1.2, 0.2, 1.0])
    block = smooth_mirror(named["Block"])
    for lamp in (panel, bulb):
        lamp.metadata["material"] = DULL
    room = named["Room"]
    room.metadata["material"] = DULL
    scene = snapshot(smooth_mirror(named["Mirror"]), Room=room, Torus=plastic, Crate=brass, Block=block, Panel=panel, Bulb=bulb)
    bright = [i.name in ("Panel", "Bulb") for i in scene.instances] + [False]  # owner -1: the sky

    def paint(position, owner):
        return np.where(np.take(bright, owner)[:, None], 100.0, 0.3 + 0.1 * np.sin(position))

    method = methods.get(name)
    return method.bake(job(scene, {**method.DEFAULTS, **SETTINGS, "view_dependent": True}, paint=paint))


@pytest.mark.parametrize("name", ["billboards", "depth_maps"])
def test_glsl_says_what_numpy_says(name, device, rng, record_property):
    from reflect_addon.gpu.fill import trace_rays

    asset, trace = asset_of(name), methods.get(name).trace
    assert asset.options["glossy"] > 1 and asset.options["mirrors"] and asset.options["ball_lamps"]
    assert asset.options["lamp_count"] >= 2
    rays = rays_of_all_kinds(np.random.default_rng(11), COUNT)
    # Half of them go to what is glossy.
    aim = rng.choice([[1.6, 0.3, 0.2], [-1.5, 1.0, -0.6]], COUNT) + rng.uniform(-0.4, 0.4, (COUNT, 3))
    rays.direction[::2] = unit(aim - rays.origin)[::2]
    width, spread = rng.uniform(0, 0.05, COUNT).astype("f"), rng.choice([0.0, 0.004, 0.05, 0.7], COUNT).astype("f")
    found, program = trace_rays(asset, trace, rays, width, spread), record(trace, asset)
    wanted = run_numpy(program, asset, rays, width, spread)
    dark = replace(asset, images={**asset.images, "lamp_buf": asset.images["lamp_buf"] * [[1], [1], [1], [0]]})
    lit = np.abs(wanted.radiance - run_numpy(program, dark, rays, width, spread).radiance).max(1)
    assert np.isfinite(found.radiance).all() and (lit > 0.01).mean() > 0.005, "few rays see a highlight"
    bounds = tolerances.KERNEL_RADIANCE_RELATIVE, tolerances.KERNEL_DISTANCE_RELATIVE
    odd = np.flatnonzero(~same_answer(found, wanted, rays.origin, *bounds))
    record_property("exceptions", len(odd))
    assert len(odd) <= tolerances.RAYS_ON_BRINKS * COUNT
    few = Rays(rays.origin[odd], rays.direction[odd])
    part = type(found)(*(getattr(found, f)[odd] for f in ("radiance", "coverage", "position", "status")))
    assert is_on_the_brink(program, asset, few, width[odd], spread[odd], part, rng, tolerances.BRINK, *bounds).all()
