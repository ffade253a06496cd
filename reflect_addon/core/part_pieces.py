"""Where searches start on a part that may reflect a point more than once.

Problem. On concave and saddle-shaped surfaces a vertex has several reflection points, and a descent finds the one whose basin it starts in.
Idea. Within a piece whose normals lie in a narrow cone there is one at most, nearly always. So a part is cut into such pieces, by halves;
each is searched from its middle, and only for what its cone of normals may reflect (virtual_cull.py), so many pieces cost little.
Limits. A descent may leave its piece: then a neighbour's point is found twice. Roots closer than a piece is wide may be missed.
"""

import numpy as np

# Half a piece's cone of normals, radians, at most.
WIDEST = np.radians(35)


def pieces_of(middle: np.ndarray, normal: np.ndarray, area: np.ndarray, most: int) -> list[np.ndarray]:
    """Indices of each piece's triangles, largest area first: (T, 3) middles, (T, 3) unit normals and (T,) areas are halved until every
    cone is narrow or there are `most`."""
    done, queue = [], [np.arange(len(area))]
    while queue:
        queue.sort(key=lambda piece: area[piece].sum())
        piece = queue.pop()
        if len(piece) < 2 or len(done) + len(queue) + 1 >= most or half_angle(normal[piece], area[piece])[1] <= WIDEST:
            done.append(piece)
            continue
        side = _halves(middle[piece], normal[piece], area[piece])
        queue += [piece[side], piece[~side]]
    return sorted(done, key=lambda piece: -area[piece].sum())


def half_angle(normal: np.ndarray, area: np.ndarray) -> tuple[np.ndarray, float]:
    """((3,) axis, radians of the farthest normal from it)."""
    mean = area @ normal
    axis = mean / max(np.linalg.norm(mean), 1e-300)
    return axis, float(np.arccos(np.clip((normal @ axis).min(initial=1.0), -1, 1)))


def _halves(middle, normal, area) -> np.ndarray:
    """(T,) bool: before and behind the mean along the axis in which places and normals vary most."""
    size = max(float(np.ptp(middle, axis=0).max(initial=0)), 1e-300)
    feature = np.column_stack([normal, middle / size])
    weight = area / max(area.sum(), 1e-300)
    centred = feature - weight @ feature
    along = centred @ np.linalg.eigh((centred * weight[:, None]).T @ centred)[1][:, -1]
    side = along > 0
    return side if side.any() and not side.all() else np.arange(len(area)) < len(area) // 2
