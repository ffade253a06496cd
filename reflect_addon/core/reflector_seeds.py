"""Where to start searches in a part, and whether one start is enough.

A vertex is reflected where the normal is the bisector towards it and the eye. A surface that lies behind the plane at each
of its points has one such point; others may have several, which differ in normal or in place. Bisectors being anything,
starts are spread as k-means over directions and normals, by area, from the ones farthest apart.
Limits. Nothing promises a start in each root's basin.
"""

import numpy as np

# How far above a plane others may lie, as a share of the part's half diagonal: facets and noise.
ABOVE = 0.02
# So many planes are tried against so many points.
SAMPLES = 400
# Weight of normals beside directions, and rounds of k-means.
NORMALS, ROUNDS = 0.7, 8


def lies_behind(middle: np.ndarray, normal: np.ndarray, area: np.ndarray) -> float:
    """Share of area whose plane has all of the part behind it. middle, normal (T, 3), area (T,)."""
    some = np.argsort(-area, kind="stable")[:: -(-len(area) // SAMPLES)]
    p, n = middle[some], normal[some]
    above = (n @ p.T).max(1) - np.einsum("ij,ij->i", n, p)
    size = np.linalg.norm(np.ptp(middle, axis=0)) / 2
    return float(area[some][above <= ABOVE * size].sum() / area[some].sum())


def seeds_among(away: np.ndarray, normal: np.ndarray, area: np.ndarray, count: int) -> np.ndarray:
    """(S, 3) unit, S <= count: directions to some of the triangles, which are `away` (T, 3) from the centre; the one nearest
    to the middle of all first."""
    direction = away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-300)
    feature = np.column_stack([direction, NORMALS * normal])
    middle = area @ feature / area.sum()
    chosen = [int(_apart(feature, middle).argmin())]
    apart = _apart(feature, feature[chosen[0]])
    for _ in range(count - 1):
        chosen.append(int(apart.argmax()))
        apart = np.minimum(apart, _apart(feature, feature[chosen[-1]]))
    centers = feature[sorted(set(chosen))]
    for _ in range(ROUNDS if len(centers) > 1 else 0):
        of = np.stack([_apart(feature, c) for c in centers]).argmin(0)
        weight = np.bincount(of, area, minlength=len(centers))
        sums = np.stack([np.bincount(of, area * f, minlength=len(centers)) for f in feature.T], -1)
        centers = np.where(weight[:, None] > 0, sums / np.maximum(weight, 1e-300)[:, None], centers)
    found = sorted({int(_apart(feature, c).argmin()) for c in centers}, key=lambda t: _apart(feature[t : t + 1], middle)[0])
    return direction[found]


def _apart(feature: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(T,) squared distances."""
    return ((feature - other) ** 2).sum(-1)
