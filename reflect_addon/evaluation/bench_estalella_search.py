"""Target E5 of estalella-2005, and what issue 5 asks of the search alone: how near, how often, in how many look-ups.

Everything is measured on reflectors from formulas, against points that share nothing with the search (known_reflectors.py), by the
NumPy run of the kernels in float32. Residuals are sines of the angle between bisector and normal. Both methods are compared as the
searches of lit vertices alone (first_search): what is looked up for hidden vertices is the same task for both.
"""

import numpy as np

from ..core import reflection_search, virtual_status
from ..core.kernel import Counts
from . import known_reflectors as known
from .bench_row import row

SIDE, TEXELS_OFF = 512, 3  # texels along a face's edge; how many a point is from an open rim at least
PAIRS, FEW = 100_000, 5_000
NEAR, SHARE = 1e-4, 0.999  # sizes; the issue's
RESOLUTIONS = (64, 128, 256, 512)
ANALYTIC = {
    "plane": known.plane(), "sphere": known.ellipsoid(1, 1, 1), "ellipsoid 1:0.5:0.7": known.ellipsoid(1, 0.5, 0.7), "paraboloid": known.paraboloid(),
}  # fmt: skip
STIFF = (1, 2, 5, 10, 20, 50)
GRAZING = (0.0, 0.02, 0.1, 0.3, 1.0)  # cosines between the eye's direction and the normal: classes
TEXELS = 8  # that a bilinear look-up of position and normal reads
NEWTON, MIDPOINT = (known.first_search(way) for way in (reflection_search.descend, reflection_search.follow))


def measure(progress) -> list[dict]:
    """Rows for targets.json. progress(share, text)."""
    rng = np.random.default_rng(5)
    rows = []
    for share, text, part in (
        (0.0, "look-ups", _looks_row), (0.1, "reflection points", _analytic_row), (0.6, "order", _order_row), (0.8, "stiffness", _stiff_row),
    ):  # fmt: skip
        progress(share, text)
        rows.append(part(rng))
    return rows


def _looks_row(rng) -> dict:
    """E5: from what two runs fetch whose steps differ by one."""
    reflector = ANALYTIC["sphere"]
    eye, vertex, _ = known.pairs_of_interest(rng, reflector, FEW)
    made = known.map_of(reflector, 64)

    def a_step(kernel):
        looks = []
        for steps in (2, 3):
            counts = Counts()
            known.search(kernel, made, eye, vertex, steps=steps, tolerance=-1.0, counts=counts)
            looks.append(counts.fetches_per_ray / TEXELS)
        return looks[1] - looks[0]

    theirs, ours = a_step(MIDPOINT), a_step(NEWTON)
    return row(
        "E5", [theirs, ours], [2, 1], abs(theirs - 2) < 1e-6 and ours <= 1 + 1e-6,
        "Map look-ups (position and normal) a step, counted by the kernel: midpoint's, and Newton's.", paper=2,
    )  # fmt: skip


def _analytic_row(rng) -> dict:
    shares, texts = [], []
    for name, reflector in ANALYTIC.items():
        made, margin = known.map_of(reflector, SIDE), 2 * TEXELS_OFF / SIDE
        eye, vertex, point = known.pairs_of_interest(rng, reflector, PAIRS, margin)
        answer = known.search(reflection_search.newton, made, eye, vertex)
        off, said = np.linalg.norm(answer["point"][:, :3] - point, axis=-1), answer["status"] == virtual_status.CONVERGED
        shares.append((said & (off <= NEAR)).mean())
        eye, vertex, point = known.pairs_of_interest(rng, reflector, FEW, 0.0, clear=0.0)
        every = known.search(reflection_search.newton, made, eye, vertex)
        near = np.linalg.norm(every["point"][:, :3] - point, axis=-1) <= NEAR
        all_of = (near & (every["status"] == virtual_status.CONVERGED)).mean()
        eye, vertex = known.random_pairs(rng, 4 * FEW)
        hidden = reflector.hidden(eye, vertex) & (reflector.height(eye) > 0)
        wrong = (known.search(reflection_search.newton, made, eye[hidden], vertex[hidden])["status"] == virtual_status.CONVERGED).sum()
        texts.append(
            f"{name} {shares[-1]:.5f} (median {np.median(off):.1e}, said to be found and farther off {(said & (off > NEAR)).mean():.1e}, "
            f"{answer['evaluations'].mean():.1f} look-ups; with rims and grazing pairs {all_of:.4f}; "
            f"{wrong} of {hidden.sum()} hidden pairs said to be reflected)"
        )
    return row(
        "I5-analytic", shares, [SHARE] * len(shares), min(shares) >= SHARE,
        f"Share of {PAIRS:,} random pairs of the region of interest whose point is found within {NEAR} of the size, {SIDE} texels; points "
        f"at least {TEXELS_OFF} texels from an open rim, eyes and vertices at least {known.CLEAR} sizes above the body: {'; '.join(texts)}.",
    )  # fmt: skip


def _order_row(rng) -> dict:
    orders, texts = [], []
    for name, reflector in list(ANALYTIC.items())[1:]:
        eye, vertex, point = known.pairs_of_interest(rng, reflector, FEW, 2 * TEXELS_OFF / RESOLUTIONS[0])
        errors = []
        for side in RESOLUTIONS:
            answer = known.search(reflection_search.newton, known.map_of(reflector, side), eye, vertex)
            errors.append(np.median(np.linalg.norm(answer["point"][:, :3] - point, axis=-1)))
        orders.append(-np.polyfit(np.log2(RESOLUTIONS), np.log2(errors), 1)[0])
        texts.append(f"{name} {', '.join(f'{e:.1e}' for e in errors)}")
    return row(
        "I5-order", orders, [1.8] * len(orders), min(orders) >= 1.8,
        f"Order in which the median error falls with the resolution ({', '.join(map(str, RESOLUTIONS))} texels): {'; '.join(texts)}. "
        "A plane's is rounding at any resolution.",
    )  # fmt: skip


def _stiff_row(rng) -> dict:
    texts, shares_of = [], {"Newton": [], "midpoint": []}
    for ratio in STIFF:
        reflector = known.ellipsoid(1, 1 / ratio, 1 / ratio)
        eye, vertex, point = known.pairs_of_interest(rng, reflector, FEW)
        made = known.map_of(reflector, SIDE)
        normal = reflector.surface(point / np.linalg.norm(point, axis=-1, keepdims=True))[1]
        cosine = ((eye - point) * normal).sum(-1) / np.linalg.norm(eye - point, axis=-1)
        for name, kernel, steps in (("Newton", NEWTON, 24), ("midpoint", MIDPOINT, 40)):
            answer = known.search(kernel, made, eye, vertex, steps=steps)
            good = answer["residual"] <= reflection_search.ACCEPTED
            by_angle = [good[(cosine > a) & (cosine <= b)] for a, b in zip(GRAZING, GRAZING[1:], strict=False)]
            shares = "/".join("-" if not len(g) else f"{g.mean():.3f}" for g in by_angle)
            shares_of[name].append(good.mean())
            texts.append(
                f"{ratio}:1 {name} {good.mean():.4f} (by angle {shares}), {answer['evaluations'].mean():.1f} look-ups, residual "
                f"median {np.median(answer['residual']):.1e}, 99 % {np.quantile(answer['residual'], 0.99):.1e}"
            )
    return row(
        "I5-stiff", [_up_to(shares) for shares in shares_of.values()], None, True,
        f"Largest ratio of half axes up to which 99 % end below {reflection_search.ACCEPTED} (0: none), of Newton in 24 and midpoint in 40 "
        f"steps; shares by cosine of the eye's angle, {', '.join(map(str, GRAZING))}: {'; '.join(texts)}. Needles of more than some 20:1 have "
        "tips of a few texels, whose normals jump: no search in such a map holds there, and they end as failed.",
    )  # fmt: skip


def _up_to(shares: list[float]) -> int:
    """The last ratio before the first whose share is below 0.99; 0 if that is the first."""
    held = np.cumprod(np.array(shares) >= 0.99).sum()
    return (0, *STIFF)[held]
