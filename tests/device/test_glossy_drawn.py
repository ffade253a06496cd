"""Rough planar mirrors drawn from their views against GGX by Monte Carlo through Embree: contact, energy, edges, mirrors in mirrors."""

from dataclasses import replace

import hand_scenes
import numpy as np
import pytest
import tolerances
import trimesh
from mesh_scenes import MIRROR, snapshot, tracer
from mirror_rooms import baked, pane

from reflect_addon.core import glossy_window, lobe_rays
from reflect_addon.core.rays import Rays
from reflect_addon.core.spaces import STATUS_HIT

CAMERA = hand_scenes.camera((0.2, -3.2, 1.3), (0.0, 0.2, 0.2), (96, 72), fov=0.8)
SAMPLES = 512


def lit(position, owner):
    """A bright leg (1) before a dark wall (2); all else, and the sky, in between."""
    return np.choose(owner + 1, [0.2, 0.2, 1.0, 0.05, 0.4])[:, None] * np.ones(3)


def floor_and_leg(roughness, paint=lit, **more):
    floor = pane(8, 8, (0, 0, 0), (0, 0, 1), replace(MIRROR, roughness=roughness, base_color=(1.0, 1.0, 1.0)))
    leg = trimesh.creation.box((0.25, 0.25, 1.2)).apply_translation((0, 0, 0.6))
    wall = trimesh.creation.box((8, 0.1, 2)).apply_translation((0, 2.5, 1.0))
    return replace(snapshot(floor, Leg=leg, Wall=wall, **more), light_hash="day"), paint


def renderer_of(made, **options):
    from reflect_addon.gpu.renderer import Renderer

    scene, paint = made
    found = baked(scene, paint=paint)
    return Renderer(scene, found.assets, surfaces=found.surfaces, **{"most_rays": lobe_rays.MOST, **options})


def ggx(rays: Rays, normal, roughness, count, rng):
    """(N * count directions, weights): facets by their own distribution, weighted by what Smith's shadowing and the view leave of them; by
    the book [Walter et al. 2007], not as lobe_rays.py does."""
    alpha, n = roughness**2, np.asarray(normal, float)
    u, v = rng.random((2, len(rays), count))
    tangent2 = alpha**2 * u / (1 - u)
    up = 1 / np.sqrt(1 + tangent2)
    side = np.sqrt(np.maximum(1 - up**2, 0))
    angle = 2 * np.pi * v
    frame = np.linalg.svd(n[None])[2]
    half = (side * np.cos(angle))[..., None] * frame[1] + (side * np.sin(angle))[..., None] * frame[2] + up[..., None] * n
    d = np.asarray(rays.direction, float)
    viewer = (2 * (d @ n)[:, None] * n - d)[:, None]
    facing = (viewer * half).sum(-1)
    out = 2 * facing[..., None] * half - viewer

    def smith(cosine):
        return 2 / (1 + np.sqrt(1 + alpha**2 * np.maximum(1 - cosine**2, 0) / np.maximum(cosine, 1e-6) ** 2))

    below = out @ n
    weight = np.where((below > 0) & (facing > 0), smith(below) * smith(viewer @ n) * facing / up, 0.0)
    return out, weight / weight.sum(1, keepdims=True)


def reference(made, ray_map, mask, roughness, rng):
    """(pixels, 3) of the mirror pixels in mask."""
    scene, paint = made
    origin, direction, normal = ray_map.origin[mask], ray_map.direction[mask], ray_map.normal[mask][0]
    out, weight = ggx(Rays(origin, direction), normal, roughness, SAMPLES, rng)
    start = np.repeat((origin + 1e-5 * normal).astype(np.float32), SAMPLES, 0)
    shown = tracer(scene, paint)(Rays(start, out.reshape(-1, 3).astype(np.float32)), bounces=0).radiance
    return (shown.reshape(*weight.shape, 3) * weight[..., None]).sum(1)


def test_a_lobe_of_one_ray_is_the_sharp_picture(device):
    sharp, nearly = renderer_of(floor_and_leg(0.0)), renderer_of(floor_and_leg(1e-3))
    one, other = sharp.answer(CAMERA), nearly.answer(CAMERA)
    assert (one.status == STATUS_HIT).sum() > 1000 and np.array_equal(one.status, other.status)
    # A window that is wider by a pixel rounds a silhouette's pixels to the other side.
    same = (one.radiance == other.radiance).all(-1)
    assert same.mean() > 1 - tolerances.RECURSIVE_EDGE
    sharp.free(), nearly.free()


def test_sharp_mirrors_cost_what_they_did(device):
    """No program of a lobe, no pass more, a window no wider."""
    sharp, rough = renderer_of(floor_and_leg(0.0)), renderer_of(floor_and_leg(0.2))
    sharp.prepare(), rough.prepare()
    assert not sharp._answers.levels.shown.glossy and rough._answers.levels.shown.glossy
    counts = []
    for renderer in (sharp, rough):
        renderer.picture(CAMERA)
        before = renderer.counts()
        renderer.picture(CAMERA)
        after = renderer.counts()
        assert all(after[name] == before[name] for name in ("uploads", "compiles", "allocations"))
        counts.append(after["passes"] - before["passes"])
    assert counts[0] == counts[1]
    (node,) = sharp.mirrored_views.nodes
    assert node.drawn == node.window
    sharp.free(), rough.free()


@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.5])
def test_an_even_world_stays_even(device, roughness):
    """Nothing is lost at edges of things, of windows or of the picture."""
    renderer = renderer_of(floor_and_leg(roughness, lambda position, owner: np.full((len(owner), 3), 0.5)))
    answer = renderer.answer(CAMERA)
    shown = answer.radiance[answer.status == STATUS_HIT]
    assert len(shown) > 1000 and np.abs(shown - 0.5).max() < tolerances.GLOSSY_EVEN
    renderer.free()


@pytest.mark.parametrize("roughness", [0.1, 0.2, 0.35, 0.5])
def test_sharp_at_the_foot_and_soft_farther_away(device, rng, roughness):
    made = floor_and_leg(roughness)
    renderer = renderer_of(made)
    answer, ray_map = renderer.answer(CAMERA), renderer.ray_map(CAMERA)
    seen = ray_map.covered() & (np.abs(ray_map.origin[..., 0]) < 0.8)
    for low, high in ((-0.25, -0.15), (-0.7, -0.6), (-1.2, -1.1)):  # m before the leg
        mask = seen & (ray_map.origin[..., 1] > low) & (ray_map.origin[..., 1] < high)
        truth = reference(made, ray_map, mask, roughness, rng)
        assert mask.sum() > 20 and np.isfinite(answer.radiance[mask]).all()
        off = np.abs(answer.radiance[mask] - truth).mean()
        assert off < tolerances.GLOSSY_MEAN, (low, off)
        assert np.ptp(truth) > 0.1 or low < -1
    renderer.free()


def test_a_lobe_of_a_pixel_or_two_is_not_in_steps(device, rng, monkeypatch):
    """The leg's edges, whose rays fall on both sides: drawn with the picture's own pixels an edge is a pixel's."""
    made, errors = floor_and_leg(0.06), []
    for finest in (glossy_window.FINEST, 1):
        monkeypatch.setattr(glossy_window, "FINEST", finest)
        renderer = renderer_of(made)
        answer, ray_map = renderer.answer(CAMERA), renderer.ray_map(CAMERA)
        (node,) = renderer.mirrored_views.nodes
        assert (node.finer > 1) == (finest > 1) and node.camera.width == node.finer * CAMERA.width
        edge = np.abs(np.abs(ray_map.origin[..., 0]) - 0.12) < 0.08
        mask = ray_map.covered() & edge & (ray_map.origin[..., 1] < -0.2) & (ray_map.origin[..., 1] > -1.0)
        truth = reference(made, ray_map, mask, 0.06, rng)
        errors.append(np.sqrt(((answer.radiance[mask] - truth) ** 2).mean()))
        renderer.free()
    assert mask.sum() > 50 and errors[0] < tolerances.GLOSSY_FINER * errors[1]


def test_a_rough_floor_in_a_mirror_is_rough(device, rng):
    """Each level's picture is filtered before the next one shows it."""
    scene, paint = floor_and_leg(0.15, Glass=pane(3, 2, (-1.5, 0, 1.0), (1, 0, 0)))
    renderer = renderer_of((scene, paint))
    camera = hand_scenes.camera((1.4, -1.2, 1.5), (-1.5, 0.3, 0.4), (96, 72), fov=0.9)
    answer, ray_map = renderer.answer(camera), renderer.ray_map(camera)
    glass = scene.reflectors().index(scene.named()["Glass"])
    mask = ray_map.covered() & (ray_map.reflector == glass)
    first = tracer(scene, paint)(Rays(ray_map.origin[mask] + np.float32([1e-5, 0, 0]), ray_map.direction[mask]), bounces=0)
    on_floor = (first.object == 0) & (np.hypot(*first.position[:, :2].T) < 1.0)
    assert on_floor.sum() > 100
    chosen = np.flatnonzero(on_floor)[::7]
    d = ray_map.direction[mask][chosen] * np.float32([1, 1, -1])
    again = Rays(first.position[chosen], d)
    out, weight = ggx(again, (0, 0, 1), 0.15, SAMPLES, rng)
    start = np.repeat((first.position[chosen] + np.float32([0, 0, 1e-5])).astype(np.float32), SAMPLES, 0)
    shown = tracer(scene, paint)(Rays(start, out.reshape(-1, 3).astype(np.float32)), bounces=2).radiance
    truth = (shown.reshape(*weight.shape, 3) * weight[..., None]).sum(1)
    assert np.abs(answer.radiance[mask][chosen] - truth).mean() < tolerances.GLOSSY_MEAN
    renderer.free()


@pytest.mark.parametrize(
    "camera",
    [
        hand_scenes.camera((0.2, -0.6, 0.3), (0.0, 0.2, 0.1), (64, 48), fov=1.4),  # the floor fills the picture and goes on
        hand_scenes.camera((0.2, -3.2, 1.3), (0.0, 0.2, 0.2), (64, 48), ortho=2.0),
        hand_scenes.camera((0.2, -3.2, 0.004), (0.0, 0.2, 0.0), (64, 48), fov=0.8),  # grazing
        hand_scenes.camera((0.0, 0.0, 3.0), (0.0, 0.01, 0.0), (64, 48), fov=0.8),  # straight down, onto the leg
    ],
    ids=["near", "orthographic", "grazing", "down"],
)
def test_everything_is_finite(device, camera):
    renderer = renderer_of(floor_and_leg(0.4))
    answer = renderer.answer(camera)
    assert (answer.status == STATUS_HIT).any()
    assert np.isfinite(answer.radiance).all() and np.isfinite(answer.position).all()
    assert answer.radiance.max() <= 1.05
    renderer.free()
