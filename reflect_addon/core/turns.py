"""Angles in kernels: that of a direction, to choose a turn of a depth map by, and a turn's cosine and sine.

The kernel language has no trigonometry, since GPUs and CPUs do not agree on it; polynomials are the same everywhere.
"""

import math


def half_turns(k, x, y):
    """The angle of (x, y) modulo pi, over pi: 0..1; within 4e-6."""
    ax, ay = k.abs(x), k.abs(y)
    ratio = k.name("ratio", k.min(ax, ay) / k.max(k.max(ax, ay), 1e-30))
    # Abramowitz and Stegun 4.4.49's arctan(r) / r in r squared, here over pi.
    r2 = ratio * ratio
    series = (0.0208351, -0.0851330, 0.1801410, -0.3302995, 0.9998660)
    value = series[0] / math.pi
    for c in series[1:]:
        value = value * r2 + c / math.pi
    octant = k.name("octant", value * ratio)
    quarter = k.select(ay > ax, 0.5 - octant, octant)
    return k.select(x * y < 0.0, 1.0 - quarter, quarter)


def cosine_and_sine(k, turn, n: float):
    """(cos, sin) of pi turn / n, turn in 0..n; within 4e-6: a thousandth of a texel at a map's edge."""
    angle = k.name("from_upright", (turn * (1.0 / n) - 0.5) * math.pi)  # cos a = -sin(a - pi/2), sin a = cos(a - pi/2)
    a2 = angle * angle
    sine = angle * (1.0 + a2 * (-1 / 6 + a2 * (1 / 120 + a2 * (-1 / 5040 + a2 / 362880))))
    cosine = 1.0 + a2 * (-1 / 2 + a2 * (1 / 24 + a2 * (-1 / 720 + a2 * (1 / 40320 - a2 / 3628800))))
    return k.name("cos_turn", -sine), k.name("sin_turn", cosine)
