"""Light-field slabs: every ray through the cell is held, texels come back as they are, and slabs agree on what is smooth."""

import numpy as np
import pytest
import tolerances
from analytic import unit

from reflect_addon.core import light_field, light_field_focus, light_field_kernel, spaces
from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import Counts, Hit, record, run_numpy
from reflect_addon.core.light_field import MARGIN, Cell
from reflect_addon.core.light_field_kernel import BAND
from reflect_addon.core.light_field_slab import UNTRACED, Slab
from reflect_addon.core.rays import Rays

CUBE = Cell(np.zeros(3), np.ones(3), 8, 16)
FLAT = Cell(np.array([3.0, -2.0, 1.0]), np.array([2.0, 1.0, 0.25]), 8, 16)
# The general extension of section 5: slabs at the sides see 60 degrees up and down.
STEEP = Cell(np.zeros(3), np.ones(3), 8, 16, np.array([1.0, 1.0, 1 / np.tan(np.radians(60))]))
CELLS = pytest.mark.parametrize("cell", [CUBE, FLAT, STEEP], ids=["cube", "flat", "steep"])


def kernel(k, asset, ray):
    radiance, position, coverage = light_field_kernel.answer(k, asset, ray)
    return Hit(radiance, position, coverage, spaces.STATUS_HIT)


def asset_of(cell, atlas, depth=False, focus=0.0):
    options = {"views": cell.views, "texels": cell.texels, "columns": cell.columns(), "depth": depth, "coded": False}
    uniforms = {**cell.uniforms(), "light_scale": 1.0, "focus": (focus,) * 3, "focus_back": (focus,) * 3}
    return Asset("light_field", "", {"light_field_tx": atlas}, uniforms, options)


def answer(cell, atlas, rays, counts=None, **more):
    asset = asset_of(cell, atlas, **more)
    return run_numpy(record(kernel, asset), asset, rays, counts=counts)


def through(cell, rng, count):
    """Rays from inside the cell, and a tenth of them from its sides, to everywhere."""
    start = rng.uniform(-1, 1, (count, 3))
    side = rng.integers(0, 3, count // 10)
    start[np.arange(len(side)), side] = np.sign(start[np.arange(len(side)), side])
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    return Rays((cell.center + start * cell.half).astype("f"), direction.astype("f"))


def filled(cell, value_of):
    """The atlas whose traced texels hold value_of(rays) -> (N, 4); the others are far too bright."""
    atlas = np.full((*cell.shape(), 4), tolerances.FAR_TOO_BRIGHT, np.float32)
    atlas[..., 3] = UNTRACED
    for face in cell.slabs:
        rays, used = light_field.bundle(cell, face)
        slab_of(cell, atlas, face)[used] = value_of(rays, face) * [1, 1, 1, cell.size()]
    return atlas


def slab_of(cell, atlas, face):
    x, y = cell.origin(face)
    return atlas[y : y + cell.slab_side(), x : x + cell.slab_side()]


@CELLS
def test_slabs_are_three_times_as_long_as_the_cell_at_45_degrees(cell):
    for axis in range(3):
        others = [(axis + 1) % 3, (axis + 2) % 3]
        slope = cell.weight[axis] / cell.weight[others]
        assert np.allclose(cell.side(axis), cell.half[others] + 2 * cell.half[axis] * slope)
    assert np.allclose(CUBE.side(0), 3.0)
    # l / tan(theta) for the slabs above and below, on either side.
    assert np.allclose(STEEP.side(2) - 1, 2 / np.tan(np.radians(60)))


@CELLS
@pytest.mark.parametrize("depth", [False, True])
def test_no_ray_through_the_cell_is_missed(cell, depth, rng):
    """Target Y5. Untraced texels are far too bright: one that was read, at any weight, would show."""
    atlas = filled(cell, lambda rays, face: np.tile([1.0, 1.0, 1.0, 0.0], (len(rays), 1)))
    for _ in range(2):
        found = answer(cell, atlas, through(cell, rng, 200_000 // (1 + depth)), depth=depth)
        assert np.abs(found.radiance - 1).max() < tolerances.LIGHT_FIELD_ONE


def test_what_passes_the_cell_is_not_traced():
    traced = sum(light_field.bundle(CUBE, face)[1].mean() for face in range(6)) / 6
    assert 0.2 < traced < 0.7


@CELLS
@pytest.mark.parametrize("depth", [False, True])
def test_a_ray_that_a_view_holds_returns_its_texel(cell, depth, rng):
    atlas = filled(cell, lambda rays, face: np.c_[rng.random((len(rays), 3)), np.zeros(len(rays))])
    for face in range(light_field.SLABS):
        rays, used = light_field.bundle(cell, face)
        axis, wanted = face // 2, slab_of(cell, atlas, face)[used][:, :3]
        # Those in the cell itself that belong to this slab alone.
        slopes = rays.direction[:, [(axis + 1) % 3, (axis + 2) % 3]] / rays.direction[:, [axis]]
        own = (np.abs(slopes) < cell.steepest(axis) * (1 - BAND - 1e-6)).all(-1) & cell.contains(rays.origin)
        assert own.sum() > 100
        found = answer(cell, atlas, Rays(rays.origin[own], rays.direction[own]), depth=depth)
        assert np.abs(found.radiance - wanted[own]).max() < tolerances.LIGHT_FIELD_TEXEL


def test_a_ray_costs_four_bilinear_look_ups(rng):
    """Target Y4: of four texels each; a ray that two slabs answer, where they meet, costs twice that."""
    rays, atlas = through(CUBE, rng, 20_000), np.ones((*CUBE.shape(), 4), np.float32)
    least, middle, most = np.sort(np.abs(rays.direction), -1).T
    slabs = 1 + (middle > most * (1 - BAND)) + (least > most * (1 - BAND))
    for asked in (1, 2, 3):
        counts, some = Counts(), slabs == asked
        answer(CUBE, atlas, Rays(rays.origin[some], rays.direction[some]), counts=counts)
        assert counts.fetches_per_ray == asked * 4 * 4
    assert np.mean(slabs) < tolerances.SLABS_PER_RAY


def test_nothing_jumps_at_the_seams(rng):
    """Slabs that disagree completely: across a seam, and at the corner of three, the answer changes as gradually as anywhere."""
    atlas = filled(CUBE, lambda rays, face: np.tile([face % 2, face // 2, 1.0, 0.0], (len(rays), 1)))
    start = unit(rng.normal(size=(2000, 3)))
    start[:1000] = unit(np.sign(start[:1000]) * (1 + 0.02 * rng.normal(size=(1000, 3))))
    step = 1e-4
    found = [answer(CUBE, atlas, Rays(np.zeros((2000, 3), "f"), d.astype("f"))).radiance for d in (start, unit(start + step * unit(rng.normal(size=(2000, 3)))))]
    assert np.abs(found[0] - found[1]).max() < tolerances.SEAM_SLOPE * step / BAND


class Ball:
    """The inside of a ball around the cell, painted smoothly."""

    def __init__(self, cell, radius):
        self.cell, self.radius = cell, radius

    def distance(self, rays):
        start, direction = rays.origin - self.cell.center, rays.direction.astype(float)
        along = (start * direction).sum(-1)
        return -along + np.sqrt(along**2 + self.radius**2 - (start**2).sum(-1))

    def paint(self, points):
        return 0.5 + 0.5 * np.sin(8.0 * (points - self.cell.center) / self.radius)

    def texels(self, rays, face):
        points = rays.origin + rays.direction * self.distance(rays)[:, None]
        axis, sign = face // 2, 1 - 2 * (face % 2)
        z = sign * (points[:, axis] - self.cell.center[axis]) + self.cell.half[axis]
        return np.c_[self.paint(points), 1 / z]


def errors(cell, radius, rng, **more):
    ball, rays = Ball(cell, radius), through(cell, rng, 20_000)
    found = answer(cell, filled(cell, ball.texels), rays, **more)
    hit = rays.origin + rays.direction * ball.distance(rays)[:, None]
    off = np.linalg.norm(found.position - hit, axis=-1) / radius
    return np.sqrt(np.square(found.radiance - ball.paint(hit)).mean()), np.median(off)


@CELLS
def test_depths_place_what_is_near(cell, rng):
    """With them the views see a ball of four times the cell's size as from the best focal plane; from the sky's, its paint is
    blurred."""
    radius = 4 * cell.half.max()
    (plain, _), (best, _) = (errors(cell, radius, rng, focus=q) for q in (0.0, 1 / radius))
    corrected, off = errors(cell, radius, rng, depth=True)
    assert corrected < tolerances.LIGHT_FIELD_DEPTH_RMSE * plain
    assert corrected < best * (1 + tolerances.LIGHT_FIELD_DEPTH_HIT)
    assert off < tolerances.LIGHT_FIELD_DEPTH_HIT


def test_any_size_is_the_same():
    found = []
    for size in (1.0, 1e-3, 1e4):
        cell = Cell(np.zeros(3), size * np.array([1.0, 0.8, 1.2]), 8, 16)
        found.append(errors(cell, 5 * size, np.random.default_rng(4), depth=True))
    assert np.allclose(found, found[0], rtol=tolerances.LIGHT_FIELD_SIZES)


def test_the_focal_plane_is_found():
    """A painted wall in front of each slab: its own depth is the best plane."""
    cell, far = Cell(np.zeros(3), np.ones(3), 6, 32), 5.0

    def wall(rays, face):
        axis, sign = face // 2, 1 - 2 * (face % 2)
        t = (sign * far - rays.origin[:, axis]) / rays.direction[:, axis]
        points = rays.origin + rays.direction * t[:, None]
        return np.c_[0.5 + 0.5 * np.sin(2.0 * points[:, [1, 2, 0]]) * np.sin(2.0 * points), np.full(len(t), 1 / (far + 1))]

    atlas = filled(cell, wall)
    for face in range(light_field.SLABS):
        found = light_field_focus.focus(cell, face, Slab(slab_of(cell, atlas, face), 1.0))
        assert abs(found * (far + 1) - 1) < tolerances.FOCUS


def test_a_bare_sky_has_no_focal_plane():
    texels = np.ones((CUBE.slab_side(), CUBE.slab_side(), 4), np.float16) * np.float16([1, 1, 1, 0])
    assert light_field_focus.focus(CUBE, 0, Slab(texels, 1.0)) == 0.0


@pytest.mark.parametrize("depth", [False, True])
def test_extreme_rays_are_answered(depth, rng):
    """Along the axes, on seams between slabs, without a direction, from the cell's corners, and at the brightest half float."""
    ones = np.array([[1, 0, 0], [0, -1, 0], [1, 1, 0], [1, 1, 1], [-1, 1, -1], [0, 0, 0], [0, 1, 1e-30]], "f")
    direction = np.repeat(ones / np.maximum(np.linalg.norm(ones, axis=-1, keepdims=True), 1e-30), 3, 0).astype("f")
    start = np.tile(np.array([[0, 0, 0], [1, 1, 1], [-1, 1, -1]], "f"), (len(ones), 1))
    bright = filled(CUBE, lambda rays, face: np.tile([7e4, 1.0, 0.0, 1.0], (len(rays), 1)))
    found = answer(CUBE, bright, Rays(start, direction), depth=depth, focus=1.0)
    assert np.isfinite(found.radiance).all() and np.isfinite(found.position).all()
    assert found.radiance.max() <= 7e4 * 1.0001


@CELLS
def test_slopes_beyond_the_slab_are_held(cell):
    """What lies near is seen by neighbouring views past the slab's limit."""
    for face in range(light_field.SLABS):
        _, direction = light_field.lines(cell, face)
        axis = face // 2
        assert np.allclose(np.abs(direction[..., (axis + 1) % 3]).max(), cell.steepest(axis)[0] * (1 + MARGIN))


@pytest.mark.parametrize("bad", [{"views": 1}, {"texels": 1}, {"half": np.array([1.0, 0.0, 1.0])}, {"weight": np.array([1.0, -1.0, 1.0])}])
def test_a_cell_without_room_is_refused(bad):
    with pytest.raises(ValueError):
        Cell(**{"center": np.zeros(3), "half": np.ones(3), "views": 4, "texels": 4, **bad})
