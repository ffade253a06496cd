"""Which chunks of the reflected scene a part of a reflector may show, before anything is searched.

A point V is reflected at P where the bisector of the directions to eye and V is P's normal. As seen from the middle of a ball around the
part the bisector has one direction; over the part, and over a chunk's ball of points, it turns by no more than the angles that eye and
chunk are seen to move by, over the length of the two directions' sum. Where that does not reach the cone of the part's normals, the part
cannot show the chunk. The search kernel asks the same of single vertices (reflection_search.py).
Limits. Points behind the part keep its chunk only where they are beside reflected ones: triangles that are hidden whole are not drawn.
"""

import numpy as np

# Above sines: angles are longer, up to half a right angle by this.
LONGER = 1.12
# Eye or chunk this near, as sine of half the ball's angle: directions from its middle say nothing.
NEAR = 0.7


def may_show(ball: np.ndarray, cone: np.ndarray, side: float, observer: np.ndarray, chunks: np.ndarray) -> np.ndarray:
    """(C,) bool. ball (4,), cone (4,) of a part (virtual_objects.TablePart), observer (4,) homogeneous, chunks (C, 4) balls: map space."""
    axis, cosine = cone[:3] * side, float(cone[3])
    if cosine <= -0.5:
        return np.ones(len(chunks), bool)
    eye = observer[:3] - ball[:3] * observer[3]
    far = max(float(np.linalg.norm(eye)), 1e-12)
    eye, eye_sine = eye / far, min(ball[3] / far, 1.0) * float(observer[3])
    away = chunks[:, :3] - ball[:3]
    distance = np.maximum(np.linalg.norm(away, axis=1), 1e-12)
    total = eye + away / distance[:, None]
    long = np.linalg.norm(total, axis=1)
    sine = np.minimum((ball[3] + chunks[:, 3]) / distance, 1.0)
    turn = np.minimum(LONGER * (eye_sine + sine) / np.maximum(long, 1e-3), np.pi)
    angle = np.arccos(np.clip(total @ axis / np.maximum(long, 1e-6), -1, 1))
    return (angle - turn <= np.arccos(cosine)) | (sine > NEAR) | (eye_sine > NEAR)


def runs(chosen: np.ndarray, table: np.ndarray) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """(first, count) of the vertices and of the triangles of the chosen chunks (C,) bool of VirtualMesh.chunks, neighbours as one."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]])))
    found = ([], [])
    for low, high in zip(edges[::2].tolist(), (edges[1::2] - 1).tolist(), strict=True):
        for column, out in ((0, found[0]), (2, found[1])):
            first = int(table[low, column])
            out.append((first, int(table[high, column] + table[high, column + 1]) - first))
    return found
