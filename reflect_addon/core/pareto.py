"""The front of the best: what nothing else beats in cost and error at once."""

import math


def pareto_front(points: list[tuple[float | None, float | None]]) -> list[int]:
    """Indices of the (cost, error) points that no other point equals or beats in both, by rising cost.

    Points with None or non-finite values are never in the front; of equal points the first is.
    """
    known = [i for i, p in enumerate(points) if all(v is not None and math.isfinite(v) for v in p)]
    front, best = [], math.inf
    for i in sorted(known, key=lambda i: (*points[i], i)):
        if points[i][1] < best:
            front.append(i)
            best = points[i][1]
    return front
