"""What refracts, and how: panes are seen straight through, solid convex glass bends rays twice, and all else is left as it was.

Problem. nielsen-2002 leaves refraction to future work; which views or rays glass asks for depends on its shape alone.
Idea. Glass that is flat and thin moves what is behind it by a part of its thickness and bends nothing: what it shows is the scene from the
same camera, begun behind it (pane_view.py). In a closed convex shape a ray that entered leaves once, and where is known by the shape alone
(convex_map.py, glass_optics.py). A pane is a sheet, or a body whose thickness is a small part of its width; only its two faces count.
Where we depart from a renderer: a lone sheet is a pane, where Cycles without Thin Wall begins a body that has no end.
Limits. Other glass has no refraction: what is dented, open, mixed with other materials in one body, in several pieces that do not lie in
one pane, or a bent thin wall. A pane's narrow sides show what they showed.
"""

from dataclasses import dataclass, replace

import numpy as np

from .flat_parts import is_closed
from .mirror_outline import hull
from .mirror_planes import MirrorPlane, reflectance
from .snapshot import Instance, Material, SceneSnapshot

# A body's thickness over the smaller of its width and height, up to which it is a pane.
THIN = 0.1
# Cosine between a pane's faces and their own triangles: shading normals that part by more bend what is seen. 2 degrees.
FLAT = 0.9994
# Of a pane's surface, what its two faces must have: the rest is narrow sides and bevels.
FACES = 0.6
# Vertices outside of a face's plane, over the size: a convex body's, rounded to float32 after some modifiers.
CONVEX = 1e-4
# Triangles of a convex body: testing and mapping it takes seconds beyond.
MOST_TRIANGLES = 20_000
PANE, SOLID, OTHER = "pane", "solid", "other"


@dataclass(frozen=True)
class Pane(MirrorPlane):
    """One side of a pane; `specular` is what it lets through, straight on, at most: what a view through it weighs."""

    thickness: float = 0.0  # m
    ior: float = 1.5

    @property
    def beyond(self) -> MirrorPlane:
        """Its other face, towards what is seen through it."""
        return MirrorPlane(self.reflector, self.origin - self.normal * self.thickness, -self.normal, self.outline, 0.0)


@dataclass(frozen=True)
class Glass:
    """The glass of one instance: its triangles in the world, as one body."""

    kind: str  # PANE, SOLID or OTHER
    reason: str  # why OTHER, a part of a sentence; else ""
    corners: np.ndarray  # (T, 3, 3) float64 world, m, counter-clockwise from outside if SOLID
    shading: np.ndarray  # (T, 3, 3) unit, outwards if SOLID
    material: Material
    normal: np.ndarray | None = None  # (3,) of a pane


def glass_of(scene: SceneSnapshot, instance: Instance) -> Glass | None:
    """None for what does not refract. Seconds for a body of many triangles."""
    part = _clear_part(scene, instance)
    if part is None or part.kind == PANE:
        return part
    mesh = scene.meshes[instance.mesh]
    reason = ""
    if part.material.thin_wall:
        reason = "its walls are thin and not flat"
    elif len(np.unique(scene.slots(instance))) > 1:
        reason = "it has several materials"
    elif len(part.corners) > MOST_TRIANGLES:
        reason = f"it has more than {MOST_TRIANGLES} triangles"
    elif not is_closed(mesh.positions, mesh.triangles):
        reason = "it is open"
    if reason:
        return replace(part, reason=reason)
    corners, shading, cross = part.corners, part.shading, _cross(part.corners)
    if np.einsum("tc,tc->", corners[:, 0] - corners.mean((0, 1)), cross) < 0:  # wound the other way round, or mirrored by its matrix
        corners, shading, cross = corners[:, ::-1], shading[:, ::-1], -cross
    if not _is_convex(corners, cross):
        return replace(part, reason="it has dents")
    shading = np.where(np.einsum("tkc,tc->tk", shading, cross)[..., None] < 0, -shading, shading)
    return replace(part, kind=SOLID, corners=corners, shading=shading)


def panes_of(scene: SceneSnapshot) -> tuple[Pane, ...]:
    """Both sides of every pane."""
    found = []
    for index, reflector in enumerate(scene.reflectors()):
        glass = _clear_part(scene, reflector)
        if glass is None or glass.kind != PANE:
            continue
        points = glass.corners.reshape(-1, 3)
        along = points @ glass.normal
        thickness, loss = float(np.ptp(along)), reflectance(glass.material)[0]
        through = (1 - loss) / (1 + loss) * max(glass.material.base_color) ** 2
        for normal, top in ((glass.normal, along.max()), (-glass.normal, -along.min())):
            face = points + np.outer(top - points @ normal, normal)
            outline, ior = hull(face, normal), glass.material.ior
            found.append(Pane(index, face.mean(0), normal, outline, through, through, thickness=thickness, ior=ior))
    return tuple(found)


def _clear_part(scene: SceneSnapshot, instance: Instance) -> Glass | None:
    """Its triangles that are glass: a pane, or yet to be told."""
    clear = [k for k, m in enumerate(instance.materials) if scene.materials[m].refracts]
    if not clear or not instance.is_reflector:
        return None
    mesh, slots = scene.meshes[instance.mesh], scene.slots(instance)
    shown = np.flatnonzero(np.isin(slots, clear))
    corners = scene.world_positions(instance)[mesh.triangles[shown]]
    sized = np.linalg.norm(_cross(corners), axis=-1) > 0
    shown, corners = shown[sized], corners[sized]
    if not len(shown) or not np.isfinite(corners).all():
        return None
    shading = _unit(mesh.corner_normals[shown].astype(np.float64) @ np.linalg.pinv(instance.world_from_object[:3, :3]))
    normal = _pane_normal(corners, _cross(corners), shading)
    material = scene.materials[instance.materials[slots[shown[0]]]]
    return Glass(OTHER if normal is None else PANE, "", corners, shading, material, normal)


def _cross(corners: np.ndarray) -> np.ndarray:
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _pane_normal(corners, cross, shading) -> np.ndarray | None:
    """(3,) across a pane, None where it is none."""
    area = np.linalg.norm(cross, axis=-1)
    normal = _unit(cross[area.argmax()])
    facing = np.abs(cross @ normal) / area
    flat = (facing > FLAT) & (np.abs(shading @ normal).min(-1) > FLAT)
    if area[flat].sum() < FACES * area.sum():
        return None
    normal = _unit((cross[flat] * np.sign(cross[flat] @ normal)[:, None]).sum(0))
    points = corners.reshape(-1, 3)
    heights = points @ normal
    thickness = np.ptp(heights)
    # Its faces lie in two planes, not in steps.
    between = np.abs(corners[flat].mean(1) @ normal - (heights.max() + heights.min()) / 2)
    if (between < 0.45 * thickness).any():
        return None
    across = np.linalg.svd(normal[None])[2][1:]
    flat_points = points @ across.T
    turns = np.linspace(0, np.pi, 16, endpoint=False)
    width = np.ptp(flat_points @ np.stack([np.cos(turns), np.sin(turns)]), axis=0).min()
    return normal if thickness <= THIN * width else None


def _is_convex(corners, cross) -> bool:
    """Whether no vertex is outside of a face's plane."""
    points = np.unique(corners.reshape(-1, 3), axis=0)
    middle, size = points.mean(0), np.ptp(points, axis=0).max()
    points = (points - middle) / size
    normals, places = _unit(cross), (corners[:, 0] - middle) / size
    offsets = np.einsum("tc,tc->t", normals, places)
    return all((points @ n.T <= o + CONVEX).all() for n, o in zip(_batches(normals), _batches(offsets), strict=True))


def _batches(values):
    return [values[k : k + 512] for k in range(0, len(values), 512)]


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)
