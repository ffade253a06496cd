"""The ground's box against what it saves: the same picture from five quads [popescu-2006 3.2, target P20].

"The billboard and the transition walls form a box, which is intersected with a ray more efficiently than 5 individual
quads; the aggregate cost is comparable to that of 3 individual quads." Here the five quads are rows of billboards' own
table, met by billboards' own loop; what is shown at the nearest is the box's own kernel. So the two differ in how
ground and walls are met, and in nothing else.
"""

from dataclasses import replace

import numpy as np

from ..core import billboard_kernel, ground_box, spaces
from ..core.asset import Asset
from ..core.billboard_atlas import Placed, table_rows
from ..core.billboard_fit import Quad
from ..core.kernel import Hit
from ..core.methods import environment
from ..core.row_search import Span


def alone(asset: Asset) -> Asset:
    """A billboards' asset with a ground, without its quads: the ground's box and the environment map."""
    return replace(asset, options={**asset.options, "count": 0, "mirrors": 0, "glossy": 0, "lamps": 0})


def five_quads(asset: Asset) -> Asset:
    """The same picture as `alone`, to be drawn with the kernel `trace` below: ground, and walls as high as H."""
    u = asset.uniforms
    axes = np.array([u["ground_x"], u["ground_y"], u["ground_z"]])
    low, high, morph = np.array(u["ground_low"]), np.array(u["ground_high"]), u["ground_morph"]
    top = low[2] + morph
    middle = (low + [high[0], high[1], top]) / 2
    half = ([high[0], high[1], top] - low) / 2
    center = np.asarray(u["center"])

    def quad(at, across: int, up: int, normal, half_v: float) -> Quad:
        u_axis, v_axis = axes[across], axes[up]
        place = np.asarray(at) @ axes + center
        return Quad("", tuple(place), tuple(u_axis), tuple(v_axis), tuple(normal), half[across], half_v, None, 0.0, 0.0, True)

    quads = [quad([middle[0], middle[1], low[2]], 0, 1, axes[2], half[1])]
    for axis, other in ((0, 1), (1, 0)):
        for side, sign in ((low, 1.0), (high, -1.0)):
            at = middle.copy()
            at[axis] = side[axis]
            quads.append(quad(at, other, 2, sign * axes[axis], half[2]))
    rows = table_rows(quads, [Placed(0, 0, 1, 1, 1)] * 5, [True] * 5, center)
    return replace(
        asset, images={"radiance_tx": asset.images["radiance_tx"], "billboard_buf": rows},
        options={**asset.options, "count": 5, "mirrors": 0, "glossy": 0, "lamps": 0, "contours": False},
    )  # fmt: skip


def ground_alone(asset: Asset) -> Asset:
    """For `trace` too: the ground ends where its quad ends, in the environment map (Fig. 6)."""
    five = five_quads(asset)
    return replace(five, options={**five.options, "count": 1})


def trace(k, asset, ray) -> Hit:
    """The nearest of ground and walls by the loop over quads; row 0 is the ground, v is a wall's height."""
    start = k.name("start", ray.origin - asset.uniforms["center"])
    distance, row, _, v = billboard_kernel.nearest(k, asset, ray, start, [Span(0, asset.options["count"])])

    def met():
        share = k.select(row < 0.5, 0.0, v * 0.5 + 0.5)
        here, along = ground_box.to_box(k, asset, start), ground_box.to_box(k, asset, ray.direction)
        return ground_box.shown(k, asset, ray, here + along * distance, along, distance, share)

    def missed():
        hit = environment.answer(k, asset, ray.direction, ray.spread, spaces.STATUS_FELL_BACK)
        return hit.radiance, hit.position, spaces.STATUS_FELL_BACK

    radiance, position, status = k.branch(distance < spaces.FAR, met, missed)
    return Hit(radiance=radiance, position=position, coverage=1.0, status=status)
