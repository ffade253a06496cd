"""What nobody can see of a captured billboard takes its neighbours' colour: undersides, and floors under what stands there."""

import numpy as np

from reflect_addon.core import billboard_capture
from reflect_addon.core.billboard_fit import flat_quads
from reflect_addon.core.flat_parts import is_closed
from reflect_addon.core.job import BakeJob
from reflect_addon.core.methods import billboards
from reflect_addon.core.rays import Hits
from reflect_addon.core.snapshot import Instance, Mesh, SceneSnapshot

CUBE = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
SIDES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))], np.int32)


def mesh(positions, triangles):
    count = len(triangles)
    return Mesh(positions, triangles, np.zeros((count, 3, 3), np.float32), np.zeros(count, np.int32))


def _at(shift, scale):
    out = np.diag([scale, scale, scale, 1.0])
    out[:3, 3] = shift
    return out


def cube_distance(instance, rays):
    """Slab test of a ray with the cube of an instance, from inside or outside."""
    half, center = instance.world_from_object[0, 0], instance.world_from_object[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        a = (center - half - rays.origin) / rays.direction
        b = (center + half - rays.origin) / rays.direction
    enter, leave = np.minimum(a, b).max(-1), np.maximum(a, b).min(-1)
    first = np.where(enter > 0, enter, leave)
    return np.where((enter <= leave) & (leave > 0), first, np.inf)


def test_split_vertices_still_bound_a_volume():
    split = CUBE[SIDES].reshape(-1, 3)
    assert is_closed(CUBE, SIDES) and is_closed(split, np.arange(36).reshape(12, 3))
    assert not is_closed(CUBE, SIDES[:-1])


def test_unseen_texels_take_the_nearest_seen_colour():
    image = np.zeros((5, 7, 4), np.float32)
    image[:, 1:6, 3] = 1
    image[:, 1:6, :3] = 0.5
    image[:2, 1:6, :3] = 9  # two rows that nobody sees
    seen = np.ones((5, 7), bool)
    seen[:2] = False
    billboard_capture.fill_unseen(image, seen)
    assert np.allclose(image[:, 1:6, :3], 0.5) and (image[:, [0, 6]] == 0).all()
    before = image.copy()
    billboard_capture.fill_unseen(image, np.zeros((5, 7), bool))  # nothing is seen at all: it stays as captured
    assert np.array_equal(image, before)


def test_a_floor_under_a_box_is_not_dark():
    """Light reaches the floor everywhere but under the box, into which it is sunk a little."""
    floor = mesh(np.float32([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)]), np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    box, ball = Instance("Box", "Box", 0, _at((1, 1, 0.9), 1.0), ()), Instance("Ball", "Ball", 0, _at((-2, -2, 1), 0.5), ())
    ground = Instance("Floor", "Floor", 1, np.eye(4), ())
    scene = SceneSnapshot("s", 1, (mesh(CUBE, SIDES), floor), (), (ground, box, ball))

    def trace(rays, hide=(), samples=1):
        under = (np.abs(rays.origin[:, :2] - 1) < 1).all(1) & (rays.origin[:, 2] < 0.1)
        radiance = np.where(under, 0.0, 1.0)[:, None] * np.ones(3, np.float32)
        count = len(rays)
        return Hits(radiance.astype(np.float32), rays.origin, -rays.direction, np.zeros(count, np.int32), np.ones(count, bool))

    def intersect(instance, rays):
        if instance.name != "Floor":
            return cube_distance(instance, rays)
        return np.where(rays.direction[:, 2] != 0, -rays.origin[:, 2] / rays.direction[:, 2], np.inf)

    job = BakeJob(scene, ball, trace, intersect, {**billboards.DEFAULTS, "texels": 32})
    quads, _ = flat_quads(scene, ground)
    up = [q for q in quads if q.normal[2] > 0.9]
    image = billboard_capture.capture(job, up)[0].radiance
    assert (image[..., 3] == 1).all() and image[..., :3].min() > 0.99


def test_a_coarser_image_has_the_same_means(rng):
    image = rng.random((16, 64, 4)).astype(np.float32)
    small = billboard_capture._coarser(image, (4, 32))
    assert small.shape == (4, 32, 4) and np.allclose(small.mean((0, 1)), image.mean((0, 1)))
    assert np.array_equal(billboard_capture._coarser(image, (32, 64)), image), "never finer than it was traced"
