"""The paper's scenes baked for `recursive` and drawn: what its benches of drawing share."""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import bpy

from ..core.asset import Asset
from ..core.camera import Camera
from ..core.methods import environment, recursive
from ..core.reflection_tree import Culling
from ..core.snapshot import SceneSnapshot
from ..scene.bake import bake_assets
from ..scene.camera import camera_of
from ..scene.raytrace import trace
from .assets import Baked, baked_in
from .bench_nielsen_scene import SCENES
from .frame import open_frame

# Colours are blurred by noise, which no time or count depends on.
QUICK = {"samples": 1, "resolution": 32, "surface_samples": 1, "surface_levels": 4}


@dataclass(frozen=True)
class Drawn:
    """One scene."""

    name: str
    snapshot: SceneSnapshot
    camera: Camera
    baked: Baked

    def renderer(self, culling: Culling | None = None, scene: SceneSnapshot | None = None, **settings):
        """It draws `recursive` with these settings. culling: what is not drawn, the default's by default."""
        from ..gpu.renderer import Renderer

        if culling is not None:
            settings |= recursive.culling_settings(culling)
        assets = {name: _with(asset, settings) for name, asset in self.baked.assets.items()}
        return Renderer(scene or self.snapshot, assets, surfaces=self.baked.surfaces)


def _with(asset: Asset, settings: dict) -> Asset:
    return replace(asset, settings={**asset.settings, **settings})


def smooth_floor() -> None:
    """(b)'s floor as a mirror, of the open file: how glossy it is changes no count."""
    for material in bpy.data.materials:
        if material.name.startswith("Mirror"):
            material.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.0


def drawn(name: str, size: tuple[int, int], folder: Path, settings: dict | None = None) -> Drawn:
    """A scene of SCENES, which becomes the open file, baked below folder for `environment` and `recursive` at the paper's depth."""
    build, depth = SCENES[name][:2]
    scene = build()
    smooth_floor()
    with open_frame(scene, None) as snapshot:
        asked = {**QUICK, "depth": depth, **(settings or {})}
        bake_assets(snapshot, (environment.NAME, recursive.NAME), folder / name, settings=asked, tracer=partial(trace, scene=scene))
        return Drawn(name, snapshot, camera_of(scene, None, *size), baked_in(folder / name, snapshot, recursive.NAME))
