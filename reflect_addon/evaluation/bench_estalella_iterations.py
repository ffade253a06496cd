"""Target E4 of estalella-2005: what each step of a search is worth, in residuals and on the screen.

The paper shows pictures after 3, 5, 7 and 9 iterations, and that more gain nothing. Here both searches run for so many steps and for more,
around an ellipsoid of which all is known (known_reflectors.py). The residual is the sine of the angle between bisector and normal. Pixels
are what the virtual vertex is displaced by on the screen of a camera at the eye, in which the reflector is WIDE pixels wide: the angle at
the eye between the vertex mirrored at the point that was found and at the true one, times the pixels of a radian in the middle of the
picture. So what a map of that many texels errs by is in it, and is where the curves end.
The searches are those of lit vertices alone (known_reflectors.first_search), and are not ended by their residual.
"""

import numpy as np

from ..core import reflection_search
from . import known_reflectors as known
from .bench_row import row
from .exhibit import Exhibit
from .plot import curves

STEPS = (3, 5, 7, 9, 12, 16, 24)  # the paper's iterations, and more
AXES = (1, 0.5, 0.7)  # half axes of the ellipsoid: its widest is the size
SIDE, PAIRS, SEED = 512, 5_000, 5  # texels along a face's edge; pairs of eye and vertex
WIDE = 200.0  # px
QUANTILES = (0.5, 0.95, 0.999)
NAMES = ("median", "95 %", "99.9 %")
LOOKS = {"midpoint": 2, "newton": 1}  # of the map, a step; target E5 counts them
SEARCHES = {"midpoint": known.first_search(reflection_search.follow), "newton": known.first_search(reflection_search.descend)}


def measure(progress) -> list:
    """A row for targets.json, and an Exhibit of the table and the curves."""
    found = {}
    for number, name in enumerate(SEARCHES):
        progress(number / 2, f"iterations: {name}")
        found[name] = iterations(name, range(1, max(STEPS) + 1) if name == "newton" else STEPS)
    return [_row(found), _shown(found)]


def iterations(name: str, steps, pairs: int = PAIRS, side: int = SIDE) -> np.ndarray:
    """(n, 2, 3) residuals (0) and pixels (1) of these QUANTILES of the pairs, after each of the steps (n,)."""
    reflector = known.ellipsoid(*AXES)
    eye, vertex, point = known.pairs_of_interest(np.random.default_rng(SEED), reflector, pairs)
    made = known.map_of(reflector, side)
    normal = reflector.surface(point / np.linalg.norm(point, axis=-1, keepdims=True))[1]
    true = mirrored(vertex, point, normal)
    out = []
    for count in steps:
        answer = known.search(SEARCHES[name], made, eye, vertex, steps=count, tolerance=0.0)
        shown = mirrored(vertex, answer["point"].astype(np.float64), answer["normal"].astype(np.float64))
        pixels = displacement(eye, shown, true, max(AXES))
        out.append([np.quantile(values, QUANTILES) for values in (answer["residual"], pixels)])
    return np.array(out)


def mirrored(vertex: np.ndarray, point: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(N, 3) virtual vertices: mirrored about the planes through points with unit normals."""
    return vertex - normal * (2 * ((vertex - point) * normal).sum(-1, keepdims=True))


def displacement(eye: np.ndarray, shown: np.ndarray, true: np.ndarray, half: float) -> np.ndarray:
    """(N,) px between two points as seen from each eye (N, 3), where a reflector of this half width about the origin is WIDE wide."""
    a, b = (p - eye for p in (shown, true))
    angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(-1))
    return angle * np.linalg.norm(eye, axis=-1) * WIDE / (2 * half)


def as_good(theirs: np.ndarray, ours: np.ndarray) -> np.ndarray:
    """(n,) how many of our steps (rows of ours (m, q), from 1 on) it takes until no quantile is above theirs (n, q); inf: more."""
    reached = (ours[None] <= theirs[:, None]).all(-1)
    return np.where(reached.any(1), reached.argmax(1) + 1.0, np.inf)


def _row(found: dict) -> dict:
    looks = np.array(STEPS) * LOOKS["midpoint"]
    ours = [as_good(found["midpoint"][:, kind][:, [0, 2]], found["newton"][:, kind][:, [0, 2]]) * LOOKS["newton"] for kind in (0, 1)]
    at = found["midpoint"][STEPS.index(9)][:, 1], found["midpoint"][-1][:, 1]
    never = 1e9  # JSON knows no infinity
    return row(
        "E4", np.minimum(ours[0] / looks, never).tolist(), 0.5, bool((ours[0] <= 0.5 * looks).all()),
        f"Newton's look-ups over midpoint's at equal residual (median and 99.9 %), after {', '.join(map(str, STEPS))} of the paper's steps, "
        f"{PAIRS} pairs around an ellipsoid {':'.join(map(str, AXES))}, {SIDE} texels: {_numbers(ours[0])} for {_numbers(looks)}. At equal pixels: "
        f"{_numbers(ours[1])}. From 9 of the paper's steps to {STEPS[-1]} the 95th percentile falls from a residual of {at[0][0]:.1e} and "
        f"{at[0][1]:.2g} px to {at[1][0]:.1e} and {at[1][1]:.2g} px; {WIDE:.0f} px are the reflector's width. The table is an exhibit.",
    )  # fmt: skip


def _numbers(values) -> str:
    return ", ".join(f"{value:.0f}" if np.isfinite(value) else "more" for value in values)


def _shown(found: dict) -> Exhibit:
    newton = found["newton"][[n - 1 for n in STEPS]]
    heads = ("steps", *(f"{name}, {what} {q}" for name in ("midpoint", "Newton") for what in ("residual", "px") for q in NAMES))
    rows = tuple(
        (str(n), *(f"{value:.1e}" if kind == 0 else f"{value:.3g}" for one in (a, b) for kind in (0, 1) for value in one[kind]))
        for n, a, b in zip(STEPS, found["midpoint"], newton, strict=True)
    )
    pictures = []
    for kind, label in ((0, "residual: sine of the angle between bisector and normal"), (1, "px off on the screen")):
        series = {
            f"{name}, {NAMES[q]}": [(LOOKS[name] * n, values[kind, q]) for n, values in zip(steps, found[name], strict=True)]
            for q in (2, 0) for name, steps in (("midpoint", STEPS), ("newton", range(1, max(STEPS) + 1)))
        }  # fmt: skip
        pictures.append((f"{label}, over look-ups in the map", curves(series, "look-ups in the map", label)))
    return Exhibit(
        "Iterations of the searches",
        f"After each number of steps, of {PAIRS:,} pairs of eye and vertex around an ellipsoid {':'.join(map(str, AXES))}; px where the ellipsoid "
        f"is {WIDE:.0f} px wide. A step of the paper's midpoint search looks twice into the map, one of Newton's once.",
        heads, rows, tuple(pictures),
    )  # fmt: skip
