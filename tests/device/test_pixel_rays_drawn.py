"""gpu/fill.py and fill_pixel.frag.glsl: what a pixel of a curved mirror shows is the mean of its rays (core/pixel_rays.py)."""

from dataclasses import replace

import hand_scenes as scenes
import numpy as np
import pytest
import tolerances

from reflect_addon.core import pixel_rays
from reflect_addon.core.kernel import Hit, record, run_numpy
from reflect_addon.core.rays import Rays
from reflect_addon.core.spaces import FAR, STATUS_HIT

CAMERA = scenes.camera((0, -4, 0.5), (0, 0, 0), size=(48, 48), fov=0.6)
BALL, FLOOR = scenes.sphere_mesh(), scenes.quad_mesh()
SUB = 8  # of a pixel along a side, of what is compared with


def stripes(k, asset, ray):
    """Dark and light by height, narrower than what a pixel of the rim sees: no map, so no level softens it."""
    up = ray.direction.z * 8.0
    light = k.abs(k.fract(up) * 2.0 - 1.0)
    return Hit(k.vec3(light, ray.width + ray.spread, 1.0), ray.origin + ray.direction * FAR, 1.0, STATUS_HIT)


def renderer_of(*things):
    from reflect_addon.gpu.renderer import Renderer

    snapshot = scenes.snapshot(*things)
    asset = replace(scenes.sky_asset(), kind="stripes", images={}, uniforms={})
    return Renderer(snapshot, {i.name: asset for i in snapshot.reflectors()}, kernel=lambda kind: stripes, most_along=pixel_rays.MOST), asset


def by_the_book(ray_map, asset):
    """((H, W, 3) radiance, (H, W) rays) of a ray map with one reflector, each pixel's rays one after another."""
    mask = ray_map.covered()
    (turned_x, moved_x), (turned_y, moved_y) = pixel_rays.differences(ray_map)
    pixel = pixel_rays.of_ray_map(ray_map)
    line, rays = pixel["line"], np.rint(pixel["rays"]).astype(int)
    turned, moved = (line[:, :1] * a + line[:, 1:] * b for a, b in ((turned_x, turned_y), (moved_x, moved_y)))
    total = np.zeros_like(turned)
    for i in range(pixel_rays.MOST):
        along = np.where(i < rays, (i + 0.5) / rays - 0.5, 0)[:, None].astype(np.float32)
        direction = ray_map.direction[mask] + along * turned
        direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
        one = run_numpy(record(stripes, asset), asset, Rays(ray_map.origin[mask] + along * moved, direction), pixel["width"], pixel["spread"])
        total += np.where((i < rays)[:, None], one.radiance, 0)
    shown, sent = np.zeros((*mask.shape, 3)), np.zeros(mask.shape, int)
    shown[mask], sent[mask] = total / rays[:, None], rays
    return shown, sent


def test_a_pixel_shows_the_mean_of_its_rays(device):
    renderer, asset = renderer_of(("ball", BALL, scenes.placed(), scenes.MIRROR))
    ray_map, found = renderer.ray_map(CAMERA), renderer.answer(CAMERA)
    told, rays = by_the_book(ray_map, asset)
    mask = ray_map.covered()
    off = np.abs(found.radiance - told)[mask].max(1)
    assert (off < tolerances.PIXEL_RAYS).mean() > tolerances.PIXEL_RAYS_ALIKE
    assert set(np.unique(rays[mask])) == {1, 3, 5, 7}
    # The middle ray says where, and whether: as without footprints.
    lines = renderer.answer(CAMERA, footprints=False)
    np.testing.assert_allclose(found.position[mask], lines.position[mask], rtol=1e-5, atol=1e3)
    assert np.array_equal(found.status, lines.status) and np.array_equal(found.coverage, lines.coverage)
    # Nearer to what a pixel sees than one ray is.
    ball = renderer.ray_map(CAMERA.finer(SUB))
    fine = run_numpy(record(stripes, asset), asset, ball.rays()).radiance[:, 0]
    whole = np.zeros(ball.covered().shape)
    whole[ball.covered()] = fine
    blocks = [image.reshape(mask.shape[0], SUB, mask.shape[1], SUB).sum((1, 3)) for image in (whole, ball.covered())]
    truth = blocks[0] / np.maximum(blocks[1], 1)
    several = rays > 1
    errors = [np.sqrt(((answer.radiance[..., 0] - truth)[several] ** 2).mean()) for answer in (found, lines)]
    assert errors[0] < tolerances.PIXEL_RAYS_ERROR * errors[1]
    renderer.free()


@pytest.mark.parametrize("mesh, place", [(FLOOR, scenes.placed((0, 0, -0.5), 2)), (scenes.cube_mesh(), scenes.placed())])
def test_what_is_flat_sends_one_ray(device, mesh, place):
    """Across its edges too, where neighbours' rays differ: to the bit what one ray shows."""
    renderer, asset = renderer_of(("mirror", mesh, place, scenes.MIRROR))
    found, lines = renderer.answer(CAMERA), renderer.answer(CAMERA, footprints=False)
    assert found.coverage.any() and not mesh.is_bent and BALL.is_bent
    np.testing.assert_array_equal(found.radiance[..., 0], lines.radiance[..., 0])
    renderer.free()
