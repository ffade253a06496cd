"""The planar mirrors of a scene: coplanar faces of any mesh that show one mirrored view [nielsen-2002 3.1].

Problem. A planar mirror is a part of some mesh: a pane of a window, the floor of a room, one of five sides of a box.
Idea. A reflector's faces of mirror-like materials fall into large planes (flat_parts.py: connected or not, facets of round things left out);
those shaded flat are a mirror. Several materials on a plane share its view: one mirror, as strong as the strongest. Which side of a face
mirrors, and whether both do, is the mesh's topology's to say (reflector_topology.py): both sides of an open mesh, the outside of a closed
one, and its inside too where the camera or another object is within.
Too small is a plane of less than flat_parts.LARGE_PART of the object's mirroring surface; it stays with the gather methods. How small it
is on the screen is the schedule's to say (reflection_tree.py).
Limits. The outline is the hull: a window in it is reflected for nothing. Planes of several objects are several mirrors, coplanar or not.
A mark by hand makes mirrors of dull materials too, as long as they have a lobe.
"""

from dataclasses import dataclass

import numpy as np

from .flat_parts import LARGE_PART, SAME_NORMAL, contains, flat_parts
from .mirror_outline import hull
from .reflector_topology import Surface, surface_of
from .snapshot import Instance, Material, SceneSnapshot

# Shading normals part from their plane's by more than this, radians: what is seen there is bent.
BENT = 2 * SAME_NORMAL


@dataclass(frozen=True)
class MirrorPlane:
    """One side of the coplanar mirror-like faces of a reflector."""

    reflector: int  # into SceneSnapshot.reflectors()
    origin: np.ndarray  # (3,) float64 world, m: on the plane, amid the outline
    normal: np.ndarray  # (3,) float64 world, unit, towards the side that mirrors
    outline: np.ndarray  # (K, 3) float64 world, m: convex hull of its faces, counter-clockwise as seen from the side that mirrors
    specular: float  # largest channel of its reflectance straight on, 0..1
    grazing: float = 1.0  # its reflectance at 90 degrees, >= specular
    roughness: tuple[float, float] = (0.0, 0.0)  # smallest and largest of its materials, Blender's
    filled: float = 1.0  # share of the outline that its faces cover
    material: Material | None = None  # of all of it; None: it has several


def planes_of(scene: SceneSnapshot) -> tuple[MirrorPlane, ...]:
    """Every planar mirror of the scene's reflectors, in their order, large ones of a reflector first."""
    reflectors = scene.reflectors()
    middles = {i.name: np.mean(scene.bounds([i]), axis=0) for i in scene.instances} if reflectors else {}
    if scene.camera is not None:
        middles[""] = np.array(scene.camera)
    return tuple(plane for index, reflector in enumerate(reflectors) for plane in _planes(scene, index, reflector, middles))


def _planes(scene: SceneSnapshot, index: int, reflector: Instance, middles: dict[str, np.ndarray]) -> list[MirrorPlane]:
    mirrors = np.array([is_mirror(scene.materials[m], reflector) for m in reflector.materials], bool)
    if not mirrors.any():
        return []
    mesh, slots = scene.meshes[reflector.mesh], scene.slots(reflector)
    positions, normals = scene.world_positions(reflector), world_normals(reflector, mesh.corner_normals)
    if not _any_flat(positions[mesh.triangles[mirrors[slots]]], normals[mirrors[slots]]):
        return []
    surface = surface_of(positions, mesh.triangles, normals)
    slots = slots[surface.index]
    shown = np.flatnonzero(mirrors[slots])
    if not len(shown):
        return []
    area = surface.area[shown]
    parts = flat_parts(surface.corners[shown], 2 * surface.normal[shown] * area[:, None], area)
    inside = any(contains(scene, reflector, at) for name, at in middles.items() if name != reflector.name) if parts else False
    found = []
    for part in sorted((shown[part] for part in parts), key=lambda part: -surface.area[part].sum()):
        normal = _unit((surface.normal[part] * surface.area[part, None]).sum(0))
        part = part[np.einsum("tkx,x->tk", surface.shading[part], normal).min(1) > np.cos(BENT)]
        if len(part):
            materials = [scene.materials[reflector.materials[s]] for s in np.unique(slots[part])]
            both = inside or bool(surface.two_sided[part].any())
            found += [_plane(index, surface, part, side * normal, materials) for side in ((1, -1) if both else (1,))]
    return found


def _plane(index: int, surface: Surface, part: np.ndarray, normal: np.ndarray, materials: list[Material]) -> MirrorPlane:
    corners = surface.corners[part].reshape(-1, 3)
    middle = np.average(surface.corners[part].mean(1), axis=0, weights=surface.area[part])
    corners = corners - np.outer((corners - middle) @ normal, normal)
    outline = hull(corners, normal)
    around = outline - outline[0]
    world = surface.middle + surface.size * np.vstack([middle[None], outline])
    straight, grazing = np.max([reflectance(m) for m in materials], axis=0)
    rough = [m.roughness for m in materials]
    filled = float(surface.area[part].sum() / max(np.linalg.norm(np.cross(around[1:-1], around[2:]).sum(0)) / 2, 1e-300))
    only = materials[0] if len(materials) == 1 else None
    return MirrorPlane(index, world[0], normal, world[1:], float(straight), float(grazing), (min(rough), max(rough)), filled, only)


def is_mirror(material: Material, reflector: Instance) -> bool:
    """Whether faces of the material mirror: shiny ones, and of a reflector marked by hand all that have a lobe."""
    return (material.is_reflector or reflector.mark == "YES") and reflectance(material)[1] > 0


def reflectance(material: Material) -> tuple[float, float]:
    """(largest channel straight on, at 90 degrees): shading.reflectance at cosines 1 and 0, tints of a metal's edge aside."""
    dielectric = min(((material.ior - 1) / (material.ior + 1)) ** 2 * max(material.specular_tint), 1.0)
    straight = material.metallic * max(material.base_color) + (1 - material.metallic) * dielectric
    return material.specular_weight * min(straight, 1.0), material.specular_weight


def world_normals(reflector: Instance, normals: np.ndarray) -> np.ndarray:
    """(T, 3, 3): by the cofactors, which a mirroring matrix turns to the side that the turned winding has. Not of unit length."""
    linear = np.asarray(reflector.world_from_object, np.float64)[:3, :3]
    cofactors = np.stack([np.cross(linear[:, (k + 1) % 3], linear[:, (k + 2) % 3]) for k in range(3)], -1)
    return normals.astype(np.float64) @ cofactors.T / max(np.abs(cofactors).max(), 1e-300)


def _any_flat(corners: np.ndarray, normals: np.ndarray) -> bool:
    """Whether triangles (T, 3, 3) shaded flat are enough for a plane: told at once of a smooth ball of a million."""
    with np.errstate(invalid="ignore"):
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = np.linalg.norm(cross, axis=-1)
        least = np.cos(2 * BENT) * area[:, None] * np.linalg.norm(normals, axis=-1)
        flat = np.abs(np.einsum("tkx,tx->tk", normals, cross)) >= least
        return bool(area[flat.all(1)].sum() >= LARGE_PART * np.nansum(area))


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / max(np.linalg.norm(vector), 1e-300)
