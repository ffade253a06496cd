"""The camera of a depth map: a pinhole whose square image just holds one object [popescu-2006 section 4].

"constructed the same way and at the same cost as billboards, the only difference is that the texture is extended with a
z channel": it stands on the line from the object's middle to whoever looks, far enough for a narrow field of view, with
hither and yon planes around the object (4.1). The object's outline lies inside the image's inscribed circle, so that it
stays inside when the image is turned.

Image. x = p.right / (z tan_half), y = p.up / (z tan_half) in -1..1, z = p.forward in hither..yon, p from the eye. Depth is
stored as q = (1/z - 1/yon) / (1/hither - 1/yon): 1 on the hither plane, 0 on the yon plane (Fig 10).
"""

from dataclasses import dataclass

import numpy as np

from .rays import Rays

# Half the field of view that an eye at the ideal distance has: narrow, so that a map sees what a far viewer sees; the paper
# uses 10 degrees in all for billboards. Wider would only let it see less of the sides.
HALF_ANGLE = np.radians(7.5)
# The outline stays this share of the image's radius inside the circle: at 4 texels still half a texel (srdm keeps u >= 0.25).
MARGIN = 1.02
# Hither and yon stand this share of the object's size off it: a face that lies in one of them would be clipped away.
SLACK = 1e-3


@dataclass(frozen=True)
class DepthCamera:
    """A planar pinhole camera. Axes are world-space, unit and orthogonal; right x up = -forward."""

    eye: np.ndarray  # (3,) float64, world, m
    right: np.ndarray  # (3,) float64
    up: np.ndarray  # (3,) float64
    forward: np.ndarray  # (3,) float64, into the scene
    tan_half: float  # of half the field of view
    hither: float  # m, > 0
    yon: float  # m, > hither

    def project(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) float64: x, y of the image and depth z in metres of world points (N, 3). Points must lie in front."""
        p = np.asarray(points, np.float64) - self.eye
        z = p @ self.forward
        return np.stack([p @ self.right / (z * self.tan_half), p @ self.up / (z * self.tan_half), z], -1)

    def rays(self, w: int) -> tuple[Rays, np.ndarray]:
        """(rays through the w x w texel centres in row order, (w * w,) z of one metre along each)."""
        at = ((np.arange(w) + 0.5) / w * 2 - 1) * self.tan_half
        x, y = (a.reshape(-1, 1) for a in np.meshgrid(at, at))
        direction = self.forward + x * self.right + y * self.up
        length = np.linalg.norm(direction, axis=-1, keepdims=True)
        return Rays(np.broadcast_to(self.eye, direction.shape).copy(), direction / length), 1 / length[:, 0]

    def normalised(self, z: np.ndarray) -> np.ndarray:
        """q of depths z in metres."""
        return (self.yon - z) * self.hither / ((self.yon - self.hither) * z)

    def depth(self, q: np.ndarray) -> np.ndarray:
        """z in metres of normalised depths."""
        return self.hither * self.yon / (self.hither + (self.yon - self.hither) * q)

    def texel(self, w: int) -> float:
        """Width of a texel at the object's middle depth, m."""
        return self.tan_half * (self.hither + self.yon) / w

    def moved(self, world_from_world: np.ndarray) -> "DepthCamera":
        """The camera after its object was moved by a rigid transform, (4, 4) that may scale uniformly (4.3: "The DM camera
        is simply transformed")."""
        m = np.asarray(world_from_world, np.float64)
        size = float(np.cbrt(np.abs(np.linalg.det(m[:3, :3]))))
        turn = m[:3, :3] / size
        axes = (turn @ self.right, turn @ self.up, turn @ self.forward)
        return DepthCamera(m[:3, :3] @ self.eye + m[:3, 3], *axes, self.tan_half, self.hither * size, self.yon * size)


def fit(vertices: np.ndarray, towards: np.ndarray) -> DepthCamera:
    """The camera that looks at the vertices (V, 3, world) from the direction `towards` (3,), wherever that ends."""
    vertices = np.asarray(vertices, np.float64)
    middle = (vertices.min(0) + vertices.max(0)) / 2
    radius = float(np.linalg.norm(vertices - middle, axis=-1).max()) or 1e-6 * max(float(np.abs(middle).max()), 1e-6)
    forward = -np.asarray(towards, np.float64)
    length = np.linalg.norm(forward)
    forward = forward / length if length > 0 else np.array([0.0, 0.0, -1.0])
    helper = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    eye = middle - forward * (radius / np.sin(HALF_ANGLE))
    # The bounding box's middle is not the outline's: aim again at the middle of what is seen.
    for _ in range(2):
        right = np.cross(forward, helper)
        right /= np.linalg.norm(right)
        up = np.cross(right, forward)
        p = vertices - eye
        x, y = (p @ right) / (p @ forward), (p @ up) / (p @ forward)
        aim = forward + right * (x.min() + x.max()) / 2 + up * (y.min() + y.max()) / 2
        forward = aim / np.linalg.norm(aim)
    right = np.cross(forward, helper)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    p = vertices - eye
    z = p @ forward
    widest = float((np.hypot(p @ right, p @ up) / z).max())
    slack = SLACK * max(float(z.max() - z.min()), radius * 0.1)
    # A needle seen end on still needs an image with an area.
    tan_half = max(widest * MARGIN, 1e-4 * radius / float(z.mean()))
    return DepthCamera(eye, right, up, forward, tan_half, float(z.min()) - slack, float(z.max()) + slack)
