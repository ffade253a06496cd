"""What a window of a camera's picture cannot show: boxes beyond one of its six planes."""

import numpy as np

from .camera import Camera


def may_be_seen(camera: Camera, corners: np.ndarray, window: tuple[int, int, int, int]) -> bool:
    """Whether something within the convex hull of corners (N, 3), world, m, may be in window (x, y, width, height), px."""
    clip = np.column_stack([corners, np.ones(len(corners))]) @ camera.clip_from_world().T
    x, y, width, height = window
    size = np.array([camera.width, camera.height])
    # A pixel more on each side: a vertex's place on the screen is rounded.
    low, high = 2 * (np.array([x, y]) - 1) / size - 1, 2 * (np.array([x + width, y + height]) + 1) / size - 1
    w = clip[:, 3:]
    inside = np.hstack([clip[:, :2] - low * w, high * w - clip[:, :2], clip[:, 2:3] + w, w - clip[:, 2:3]])
    return bool((inside >= 0).any(0).all())
