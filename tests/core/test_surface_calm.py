"""core/surface_calm.py: as many paths as the noise asks for, where it is, and an unbiased mean."""

import numpy as np
import trimesh
from mesh_scenes import snapshot
from test_surface_radiance import BALL, floor
from tolerances import CALMED_NOISE, CALMED_QUESTIONS

from reflect_addon.core import surface_radiance
from reflect_addon.core.surface_calm import FIRST, MOST, calm

NOISE = 0.05
NOISY, QUIET = 0, 1  # owners
TRUTH = 0.7


def two_floors():
    """A floor whose answers are noisy and one whose answers are not."""
    beside = trimesh.Trimesh(floor(12).vertices + [0, 0, -1], floor(12).faces, process=False)
    scene = snapshot(BALL, Thing=floor(24), Beside=beside)
    return surface_radiance.soup_of(scene, scene.instances[1:])


class Asked:
    """Answers whose relative standard deviation is `spread` on the noisy floor, and how many each floor was asked for."""

    def __init__(self, rng, spread):
        self.rng, self.spread, self.count = rng, spread, np.zeros(2, int)

    def __call__(self, points, towards, owner, face):
        self.count += np.bincount(owner, minlength=2)
        off = self.rng.choice([-1.0, 1.0], len(points)) * self.spread * (owner == NOISY)
        return np.repeat(TRUTH * (1 + off)[:, None], 3, 1)


def first(soup, ask):
    """What refinement knows: one answer a sample."""
    owner = np.zeros(soup.sample.max() + 1, int)
    owner[soup.sample] = soup.owner[:, None]
    values = ask(np.zeros((len(owner), 3)), None, owner, None)
    ask.count[:] = 0
    return values, owner


def test_noise_is_what_was_wished_for_and_the_mean_stays(rng):
    soup, ask = two_floors(), Asked(rng, 0.2)
    values, owner = first(soup, ask)
    found = calm(soup, values, ask, NOISE, 1 << 30)
    noisy = found[owner == NOISY, 0] / TRUTH
    assert abs(np.std(noisy) / NOISE - 1) < CALMED_NOISE
    assert abs(noisy.mean() - 1) < 4 * NOISE / np.sqrt(len(noisy))
    np.testing.assert_allclose(found[owner == QUIET], TRUTH, rtol=1e-12)
    wished = (0.2 / NOISE) ** 2 - 1
    assert abs(ask.count[NOISY] / (owner == NOISY).sum() / wished - 1) < CALMED_QUESTIONS
    assert ask.count[QUIET] == FIRST * (owner == QUIET).sum(), "what has no noise is asked no more than it takes to see that"


def test_questions_are_bounded(rng):
    soup, ask = two_floors(), Asked(rng, 0.9)
    values, owner = first(soup, ask)
    calm(soup, values, ask, 1e-3, 1 << 30)
    assert ask.count[NOISY] == (FIRST + MOST) * (owner == NOISY).sum()
    ask.count[:] = 0
    room = 5 * len(values)
    calm(soup, values, ask, 1e-3, room)
    assert 0.9 * room < ask.count.sum() <= room + len(values), "each sample's share is rounded up"


def test_it_costs_nothing_where_nothing_is_wished_or_possible(rng):
    soup, ask = two_floors(), Asked(rng, 0.2)
    values, _ = first(soup, ask)
    for noise, room in ((0.0, 1 << 30), (NOISE, len(values))):
        np.testing.assert_array_equal(calm(soup, values, ask, noise, room), values)
    assert not ask.count.any()


def test_what_is_black_is_asked_no_more(rng):
    """Its noise is judged against the thing's mean, not against nothing."""
    soup, ask = two_floors(), Asked(rng, 0.0)
    values, _ = first(soup, ask)
    found = calm(soup, 0 * values, lambda *of: 0 * ask(*of), NOISE, 1 << 30)
    assert ask.count.sum() == FIRST * len(values) and not found.any()
