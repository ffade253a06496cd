"""A mirror ball among things with lamps, as Cycles has them: a ray takes a lamp's light along and goes on."""

from dataclasses import replace

import numpy as np
import trimesh
from mesh_scenes import intersect, tracer
from virtual_scenes import among_things, paint

from reflect_addon.core.lamp_hits import with_lamps
from reflect_addon.core.snapshot import SceneSnapshot
from reflect_addon.scene.lamps import _ball, _disk, _rectangle

LIGHT = {"Window": np.array([5.0, 4.0, 3.0]), "Disk": np.array([2.0, 6.0, 2.0]), "Bulb": np.array([3.0, 3.0, 9.0])}


# A rectangle before the sky, an ellipse before floor and rock, a ball between; all of them shine at the mirror.
SHAPES = {"Window": (_rectangle(0.8, 0.5), (1.6, 0.2, 1.2)), "Disk": (_disk(0.6, 0.3), (1.0, -1.0, 0.5)), "Bulb": (_ball(0.12), (1.1, -0.2, 0.5))}


def lit_scene() -> SceneSnapshot:
    found = among_things(**{name: trimesh.Trimesh(mesh.positions, mesh.triangles, process=False) for name, (mesh, _) in SHAPES.items()})
    lamps = []
    for lamp in found.instances:
        if lamp.name in SHAPES:
            place = np.array(SHAPES[lamp.name][1])
            towards = np.array((0, 0, 0.5)) - place
            turn = trimesh.geometry.align_vectors([0, 0, -1], towards / np.linalg.norm(towards))
            lamps.append(replace(lamp, world_from_object=trimesh.transformations.translation_matrix(place) @ turn, materials=()))
    return replace(found, instances=tuple(i for i in found.instances if i.name not in SHAPES), lamps=tuple(lamps))


def lit_tracer(scene: SceneSnapshot):
    """As tracer, with the lamps' light."""
    base = tracer(scene, paint)

    def trace(rays, **more):
        hits = base(rays, **more)
        radiance = hits.radiance.copy()
        for lamp in scene.lamps:
            met = with_lamps(hits, rays, replace(scene, lamps=(lamp,)), intersect(scene))
            low, high = scene.bounds([lamp])
            inside = np.linalg.norm(rays.origin - (low + high) / 2, axis=1) < (high - low).max() / 2
            # From inside a ball does not shine.
            radiance[(met.object == len(hits.object_names)) & ~(inside & (lamp.name == "Bulb"))] += LIGHT[lamp.name]
        return replace(hits, radiance=radiance)

    return trace
