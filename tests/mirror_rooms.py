"""Rooms with planar mirrors, baked through Embree for `recursive`, and what an eye with one ray a pixel sees in them."""

from dataclasses import replace

import numpy as np
import trimesh
from analytic import smooth
from mesh_scenes import MIRROR, job, snapshot, tracer
from virtual_scenes import BELOW, Baked

from reflect_addon.core import surface_radiance
from reflect_addon.core.methods import layered_distance, recursive
from reflect_addon.core.snapshot import SceneSnapshot

SURFACES = {**surface_radiance.DEFAULTS, "surface_samples": 1, "surface_tolerance": 0.02}


def paint(position, owner):
    """Radiance of what stands at a place, from 0.1 to about 1; each thing has its own brightness."""
    return 0.1 + 0.3 * smooth(2 * position) + 0.1 * owner[:, None]


def pane(width, height, place, toward, material=MIRROR) -> trimesh.Trimesh:
    """A rectangle about `place` whose one side faces along `toward`; its height is as near to Z as may be."""
    normal = np.asarray(toward, float) / np.linalg.norm(toward)
    up = np.array([0, 0, 1.0]) if abs(normal[2]) < 0.99 else np.array([0, 1.0, 0])
    side = np.cross(up, normal)
    side /= np.linalg.norm(side)
    up = np.cross(normal, side)
    corners = [place + sx * side * width / 2 + sy * up * height / 2 for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    shape = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)
    shape.metadata.update(material=material)
    return shape


def things(size=6.0) -> dict[str, trimesh.Trimesh]:
    return {
        "Torus": trimesh.creation.torus(0.35, 0.15).apply_translation((0.4, 0.7, 0.5)),
        "Rock": trimesh.creation.icosphere(3, 0.3).apply_translation((-0.5, -0.6, 0.35)),
        "Floor": trimesh.creation.box((size, size, 0.01)).apply_translation((0, 0, -0.005)),
    }


def one_mirror(**more) -> SceneSnapshot:
    """A pane at x = -1.5 that faces +X, over a floor with a torus and a rock."""
    return replace(snapshot(pane(3, 2, (-1.5, 0, 1.0), (1, 0, 0)), **things(), **more), light_hash="day")


def two_mirrors(place=(1.5, 0, 1.0), toward=(-1, 0, 0)) -> SceneSnapshot:
    """The pane and another one, which faces it by default."""
    return one_mirror(Other=pane(3, 2, place, toward))


def baked(scene: SceneSnapshot, paint=paint, method=recursive, **settings) -> Baked:
    """Assets of all reflectors, joined, and the surfaces. method: recursive, or another that stands on layered_distance."""
    assets = {}
    for reflector in scene.reflectors():
        own = replace(job(scene, {**method.DEFAULTS, **BELOW, **settings}, paint=paint), reflector=reflector)
        assets[reflector.name] = method.bake(own).joined(layered_distance.bake(own))
    return Baked(scene, assets, surface_radiance.bake(scene, tracer(scene, paint), scene.instances, SURFACES))
