"""Convex bodies by direction: for each direction from the middle the plane of the face there and its shading normal, as two images.

Problem. A kernel has to find where a ray inside a body meets its surface, and knows no mesh.
Idea. A convex body is star-shaped from any point within: a cube map (cubemap.py's layout) holds its faces. Planes, not points: a plane is exact on
all of its face, and every plane of the body is at its surface or outside of it, which glass_optics.py's search needs. Made in one go for all
texels of a tile that look the same way, with those triangles alone that the tile may see.
Limits. A texel on an edge has one of the faces beside it: near edges, for less than a texel, the way out is its neighbour's. Shading normals
are those of the texels' middles, bilinear between.
"""

from dataclasses import dataclass

import numpy as np

from .cubemap import texel_directions
from .glass_optics import IMAGES

# Texels along a face's edge: a cube's edges are found to 1 / 128 of its side, 3.3 MB a body.
SIDE = 128
# Texels along a tile's edge.
TILE = 13


@dataclass(frozen=True)
class ConvexMap:
    """Map space: world axes, (x - center) / size, in which the body lies in the unit ball."""

    center: np.ndarray  # (3,) float64 world, m
    size: float  # m
    images: dict[str, np.ndarray]  # IMAGES: outward unit normal and the plane's distance from the center; shading normal


def build(corners: np.ndarray, shading: np.ndarray, side: int = SIDE) -> ConvexMap:
    """Of a closed convex body: corners (T, 3, 3) world, counter-clockwise from outside; shading (T, 3, 3) unit, outwards."""
    points = corners.reshape(-1, 3)
    center = (points.max(0) + points.min(0)) / 2
    size = float(np.linalg.norm(points - center, axis=-1).max()) * (1 + 1e-6)
    local = (corners - center) / size
    normal = np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-300)
    offset = np.einsum("tc,tc->t", normal, local.mean(1))
    # d meets a triangle where it is on the inner side of the planes through the middle and its edges; shares follow from how far.
    edges = np.stack([np.cross(local[:, (k + 1) % 3], local[:, (k + 2) % 3]) for k in range(3)], 1)
    edges32 = np.ascontiguousarray((edges / np.abs(edges).max()).transpose(1, 2, 0), np.float32)
    axis = local.mean(1)
    axis /= np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-300)
    reach = np.arccos(np.clip(np.einsum("tkc,tc->tk", local / np.linalg.norm(local, axis=-1, keepdims=True), axis), -1, 1)).max(1)
    directions = texel_directions(side)
    planes, normals = np.zeros((*directions.shape[:2], 4), np.float32), np.zeros((*directions.shape[:2], 4), np.float32)
    for face in range(6):
        for y in range(0, side + 2, TILE):
            for x in range(0, side + 2, TILE):
                tile = slice(y, y + TILE), slice(face * (side + 2) + x, face * (side + 2) + min(x + TILE, side + 2))
                some = directions[tile].reshape(-1, 3)
                middle = some.mean(0) / np.linalg.norm(some.mean(0))
                some32 = some.astype(np.float32)
                wide = np.arccos(np.clip((some @ middle).min(), -1, 1)) + 1e-3
                near = np.flatnonzero(axis @ middle >= np.cos(np.minimum(reach + wide, np.pi)))
                # Of triangles that are met all three are positive, of others one is not.
                least = np.minimum(np.minimum(*(some32 @ edges32[k][:, near] for k in (0, 1))), some32 @ edges32[2][:, near])
                which = near[least.argmax(-1)]
                shares = np.maximum(np.einsum("dc,dkc->dk", some, edges[which]), 0.0)
                shares /= np.maximum(shares.sum(-1, keepdims=True), 1e-300)
                smooth = np.einsum("dk,dkc->dc", shares, shading[which])
                smooth /= np.maximum(np.linalg.norm(smooth, axis=-1, keepdims=True), 1e-300)
                shape = directions[tile].shape[:2]
                planes[tile] = np.column_stack([normal[which], offset[which]]).reshape(*shape, 4)
                normals[tile][..., :3] = smooth.reshape(*shape, 3)
    return ConvexMap(center, size, dict(zip(IMAGES, (planes, normals), strict=True)))
