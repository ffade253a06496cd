"""Glass drawn by `recursive` against rays bent by the book through Embree: panes straight through, solid bodies bent twice."""

from dataclasses import replace

import hand_scenes
import numpy as np
import pytest
import tolerances
import trimesh
from analytic import unit
from mesh_scenes import first_hits, snapshot, tracer
from mirror_rooms import baked, pane

from reflect_addon.core.rays import Rays
from reflect_addon.core.snapshot import Material

GLASS = Material("glass", roughness=0.0, ior=1.5, base_color=(1.0, 0.9, 0.8), is_reflector=True, refracts=True)
CAMERA = hand_scenes.camera((0.3, -3.2, 1.3), (0.0, 0.2, 0.8), (64, 48), fov=0.8)


def stripes(position, owner):
    """Bright and dark, across what stands behind."""
    return (0.6 + 0.4 * np.sin(3.0 * position[:, :1] + 2.0 * position[:, 2:])) * [1.0, 0.8, 0.6]


def room(glass, **more):
    glass.metadata.update(material=GLASS)
    wall = trimesh.creation.box((12, 0.1, 8)).apply_translation((0, 2.5, 1.0))
    floor = trimesh.creation.box((12, 12, 0.1)).apply_translation((0, 0, -0.6))
    return replace(snapshot(glass, Wall=wall, Floor=floor, **more), light_hash="day")


def renderer_of(scene, **settings):
    from reflect_addon.gpu.renderer import Renderer

    found = baked(scene, paint=stripes, **settings)
    return Renderer(scene, found.assets, surfaces=found.surfaces)


def fresnel(cosine, ior):
    inner = np.sqrt(np.maximum(1 - (1 - cosine**2) / ior**2, 0))
    across, along = (cosine - ior * inner) / (cosine + ior * inner), (inner - ior * cosine) / (inner + ior * cosine)
    return (across**2 + along**2) / 2


@pytest.mark.parametrize("thickness", [0.0, 0.06])
def test_a_pane_shows_what_is_behind_it(device, thickness):
    glass = pane(2.0, 1.6, (0, 0, 0.8), (0, -1, 0))
    if thickness:
        glass = trimesh.creation.box((2.0, thickness, 1.6)).apply_translation((0, thickness / 2, 0.8))
    scene = room(glass)
    renderer = renderer_of(scene)
    picture, rays = renderer.picture(CAMERA)[..., :3], renderer.ray_map(CAMERA)
    mask = rays.covered() & (np.abs(rays.normal[..., 1]) > 0.99)
    eye = CAMERA.world_from_camera[:3, 3]
    view = unit(rays.origin[mask].astype(float) - eye)
    cosine = np.abs(view[:, 1:2])
    behind = rays.origin[mask] + view * (0.05 + thickness)
    # The line is nearer along Y by t (1 - cos a / sqrt(n^2 - sin^2 a)).
    behind[:, 1:2] -= thickness * (1 - cosine / np.sqrt(1.5**2 - 1 + cosine**2))
    ahead = tracer(scene, stripes)
    seen = ahead(Rays(behind.astype("f"), view.astype("f")), hide=("Mirror",), bounces=0).radiance
    mirrored = ahead(Rays((rays.origin[mask] + 1e-4 * rays.normal[mask]).astype("f"), rays.direction[mask]), hide=("Mirror",), bounces=0).radiance
    face, tint = fresnel(cosine, 1.5), np.array(GLASS.base_color) ** 2
    through = tint * (1 - face) / (1 + face)
    expected = seen * through + mirrored * face * (1 + through)
    off = np.abs(picture[mask] - expected)
    print(mask.sum(), np.median(off), off.mean(), off.max())
    assert mask.sum() > 400 and off.mean() < 0.02
    renderer.free()


def test_a_ball_bends(device):
    ball = trimesh.creation.uv_sphere(radius=0.7, count=[32, 64]).apply_translation((0, 0, 0.8))
    ball.metadata.update(smooth=True)
    scene = room(ball)
    renderer = renderer_of(scene)
    picture, rays = renderer.picture(CAMERA)[..., :3], renderer.ray_map(CAMERA)
    mask = rays.covered()
    eye = CAMERA.world_from_camera[:3, 3]
    print(mask.sum(), picture[mask].mean(0))
    np.save("/tmp/ball.npy", picture)
    renderer.free()
