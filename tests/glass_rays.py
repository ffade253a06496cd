"""Rays through glass by the book, on triangles met by Embree: Snell and Fresnel [Hecht, Optics, 4.4 and 4.6], one way a ray."""

import numpy as np
import trimesh
from analytic import unit
from mesh_scenes import first_hits

from reflect_addon.core.snapshot import Material

GLASS = Material("glass", roughness=0.0, ior=1.5, base_color=(1.0, 0.9, 0.8), is_reflector=True, refracts=True)
CLEAR = Material("clear", roughness=0.0, ior=1.5, base_color=(1.0, 1.0, 1.0), is_reflector=True, refracts=True)


def fresnel(cosine, before, behind):
    """(N,) reflectance of unpolarised light; 1 where all is reflected."""
    sine2 = (before / behind) ** 2 * (1 - cosine**2)
    inner = np.sqrt(np.maximum(1 - sine2, 0))
    across = (before * cosine - behind * inner) / (before * cosine + behind * inner)
    along = (behind * cosine - before * inner) / (behind * cosine + before * inner)
    return np.where(sine2 >= 1, 1.0, (across**2 + along**2) / 2)


def snell(direction, normal, before, behind):
    """(N, 3) by the angles in the plane of incidence: its axis along the surface and the one into it."""
    cosine = -(direction * normal).sum(1, keepdims=True)
    along = direction + cosine * normal
    sine = np.linalg.norm(along, axis=1, keepdims=True)
    bent = np.minimum(before / behind * sine, 1.0)
    return along / np.maximum(sine, 1e-12) * bent - normal * np.sqrt(1 - bent**2)


def normals_at(mesh: trimesh.Trimesh, triangle, position, smooth: bool):
    if not smooth:
        return unit(mesh.triangles_cross[triangle])
    at = trimesh.triangles.points_to_barycentric(mesh.triangles[triangle], position, method="cross")
    return unit(np.einsum("nc,ncx->nx", at, mesh.vertex_normals[mesh.faces[triangle]]))


def through_body(mesh: trimesh.Trimesh, smooth: bool, origin, view, ior: float, inside: int = 4):
    """Of rays from outside (N, 3): (mask that meet it, then for those: entry, shading normal there, origin and direction of the ray that leaves,
    share (M,) of its radiance, 0 where it does not leave after so many whole reflections, (M,) those it took)."""
    triangle, far = first_hits(mesh, origin, view)
    met = triangle >= 0
    entry, d = (origin + view * np.where(met, far, 0)[:, None])[met], view[met].astype(float)
    normal = normals_at(mesh, triangle[met], entry, smooth)
    share = 1 - fresnel(np.clip(-(d * normal).sum(1), 0, 1), 1.0, ior)
    d, at = snell(d, normal, 1.0, ior), entry.copy()
    out, way, took = np.zeros_like(at), np.zeros_like(at), np.full(len(at), inside + 1)
    left = np.arange(len(at))
    for step in range(inside + 1):
        triangle, far = first_hits(mesh, at[left] + 1e-4 * d[left], d[left])
        fine = triangle >= 0
        left, triangle, far = left[fine], triangle[fine], far[fine]
        at[left] += d[left] * (far[:, None] + 1e-4)
        normal = normals_at(mesh, triangle, at[left], smooth)
        mirrored = fresnel(np.clip((d[left] * normal).sum(1), 0, 1), ior, 1.0)
        leaves = mirrored < 1
        some = left[leaves]
        out[some], way[some], took[some] = at[some], snell(d[some], -normal[leaves], ior, 1.0), step
        share[some] *= 1 - mirrored[leaves]
        left, normal = left[~leaves], normal[~leaves]
        d[left] -= 2 * (d[left] * normal).sum(1, keepdims=True) * normal
    share[took > inside] = 0
    return met, entry, normals_at(mesh, first_hits(mesh, origin, view)[0][met], entry, smooth), out, way, share, took
