"""Calming a noisy function on a surface: more paths where neighbours say that noise is left, and nowhere else.

Problem. A few paths a question are enough to decide where a mesh must be finer (surface_refine.py, which knows its noise); what is shown
afterwards is their noise, and it is uneven: what a lamp shines on is exact with four paths, a dark side that bounces alone reach is not
with sixty-four. Paths for all alike are wasted on the first.
Idea. Ask everything twice more. Three answers give a variance, noisy itself; that of the triangles around is added to it. From it follows how
often each sample must be asked so that the relative standard deviation of its mean is as wished (optimum allocation [Neyman 1934]); that
is asked, in one bundle, and everything averaged: no answer is thrown away and none weighs by what it was.
Limits. How often a sample is asked depends a little on its own first answers (through the mean of its neighbours), a bias far below the noise. Where three answers and all around are alike by chance nothing more is asked. Rare bright paths (fireflies) stay what they are.
"""

import numpy as np

from .surface_soup import DARK, Ask, Soup, inwards, normals

FIRST = 2  # questions of each sample before its noise is judged; with refinement's own, three answers
SMOOTHED = 2  # times that variances are averaged over triangles: of some twenty samples, 40 degrees of freedom
MOST = 32  # further questions of a sample
BUNDLE = 1 << 16  # questions at a time: what arrays of them may take


def calm(soup: Soup, values: np.ndarray, ask: Ask, noise: float, most: int) -> np.ndarray:
    """(S, 3) values with a relative standard deviation of about `noise`, where MOST questions and `most` in all are enough.

    values: (S, 3), one answer for each sample of the soup. noise: 0: the values as they are. most: further questions, about; two for each
    sample are asked before any is given where it is needed, or nothing at all."""
    if noise <= 0 or not len(values) or FIRST * len(values) > most:
        return values
    number, corner, which = np.unique(soup.sample.ravel(), return_index=True, return_inverse=True)
    triangle = corner // 3
    points, towards = inwards(soup, triangle, soup.points[soup.place.ravel()[corner]]), normals(soup)[triangle]
    owner, face = soup.owner[triangle], soup.face[triangle]

    def more(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(S, 3) sums of so many further answers (S,), and of their squares."""
        total, square = np.zeros((len(number), 3)), np.zeros((len(number), 3))
        every = np.repeat(np.arange(len(number)), times)
        # Far from each other in the bundle: neighbours in it share what is stratified over its pixels.
        every = np.random.default_rng(len(every)).permutation(every)
        for start in range(0, len(every), BUNDLE):
            mine = every[start : start + BUNDLE]
            answer = ask(points[mine], towards[mine], owner[mine], face[mine])
            np.add.at(total, mine, answer)
            np.add.at(square, mine, answer**2)
        return total, square

    total, square = more(np.full(len(number), FIRST))
    total, square, count = total + values[number], square + values[number] ** 2, np.full(len(number), 1.0 + FIRST)
    mean = total / count[:, None]
    variance = np.maximum(square / count[:, None] - mean**2, 0).max(1) * (1 + FIRST) / FIRST
    # Around for brightness as well: who is asked more because its own first answers were dark has them outvoted, and is biased.
    variance, bright = (_around(which.reshape(-1, 3), of) for of in (variance, np.abs(mean).max(1)))
    scale = np.maximum(np.maximum(bright, DARK * _means(owner, bright)), 1e-9)
    times = np.clip(variance / (noise * scale) ** 2 - count, 0, MOST)
    room = most - FIRST * len(number)
    if times.sum() > room:
        times *= room / times.sum()
    times = np.ceil(times).astype(int)
    further, _ = more(times)
    calmed = values.copy()
    calmed[number] = (total + further) / (count + times)[:, None]
    return calmed


def _around(triangles: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """(S,) averaged over the triangles (T, 3) around each sample."""
    count = np.bincount(triangles.ravel())
    for _ in range(SMOOTHED):
        of_triangle = np.repeat(variance[triangles].mean(1), 3)
        variance = np.bincount(triangles.ravel(), weights=of_triangle) / count
    return variance


def _means(owner: np.ndarray, bright: np.ndarray) -> np.ndarray:
    """(S,) mean brightness of each sample's owner."""
    return (np.bincount(owner, weights=bright) / np.maximum(np.bincount(owner), 1))[owner]
