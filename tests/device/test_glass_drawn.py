"""Glass drawn by `recursive` against rays bent by the book through Embree: panes straight through, solid bodies bent twice."""

from dataclasses import replace

import hand_scenes
import numpy as np
import pytest
import tolerances
import trimesh
from analytic import unit
from glass_rays import GLASS, fresnel, through_body
from mesh_scenes import MIRROR, snapshot, tracer, world_mesh
from mirror_rooms import baked, pane

from reflect_addon.core.glass_shapes import Pane
from reflect_addon.core.rays import Rays

CAMERA = hand_scenes.camera((0.3, -3.2, 1.3), (0.0, 0.2, 0.8), (64, 48), fov=0.8)
TINT = np.array(GLASS.base_color) ** 2


def waves(position, owner):
    """Slow ones, across what stands around."""
    return (0.6 + 0.4 * np.sin(position[:, :1] + 0.7 * position[:, 2:])) * [1.0, 0.8, 0.6]


def room(glass, material=GLASS, smooth=False, **more):
    glass.metadata.update(material=material, smooth=smooth)
    wall = trimesh.creation.box((12, 0.1, 8)).apply_translation((0, 2.5, 1.0))
    floor = trimesh.creation.box((12, 12, 0.1)).apply_translation((0, 0, -0.6))
    return replace(snapshot(glass, Wall=wall, Floor=floor, **more), light_hash="day")


def window(thickness, y=0.0):
    return trimesh.creation.box((2.0, thickness, 1.6)).apply_translation((0, y + thickness / 2, 0.8))


def renderer_of(scene):
    from reflect_addon.gpu.renderer import Renderer

    found = baked(scene, paint=waves)
    return Renderer(scene, found.assets, surfaces=found.surfaces)


def shown(scene, origin, direction):
    """What rays meet when there is no glass."""
    return tracer(scene, waves)(Rays(origin.astype("f"), direction.astype("f")), hide=("Mirror",), bounces=0).radiance


def looked(renderer):
    """(picture's pixels on the glass, their ray map's origin, view, normal, direction)."""
    picture, rays = renderer.picture(CAMERA)[..., :3], renderer.ray_map(CAMERA)
    mask = rays.covered() & (rays.reflector == 0)
    origin, normal = rays.origin[mask].astype(float), rays.normal[mask].astype(float)
    view = unit(origin - CAMERA.world_from_camera[:3, 3])
    return picture[mask], origin, view, normal, rays.direction[mask].astype(float)


@pytest.mark.parametrize("thickness", [0.0, 0.06], ids=["sheet", "plate"])
def test_a_pane_shows_what_is_behind_it(device, thickness):
    scene = room(window(thickness) if thickness else pane(2.0, 1.6, (0, 0, 0.8), (0, -1, 0)))
    renderer = renderer_of(scene)
    found, origin, view, normal, mirrored = looked(renderer)
    front = np.abs(normal[:, 1]) > 0.99
    found, origin, view, normal, mirrored = (v[front] for v in (found, origin, view, normal, mirrored))
    cosine = np.abs(view[:, 1:2])
    behind = origin + view * (0.05 + thickness)
    # The line is nearer along Y by t (1 - cos a / sqrt(n^2 - sin^2 a)).
    behind[:, 1:2] -= thickness * (1 - cosine / np.sqrt(1.5**2 - 1 + cosine**2))
    face = fresnel(cosine, 1.0, 1.5)
    through = TINT * (1 - face) / (1 + face)
    expected = shown(scene, behind, view) * through + shown(scene, origin + 1e-4 * normal, mirrored) * face * (1 + through)
    assert len(found) > 400 and np.abs(found - expected).mean() < tolerances.GLASS_PANE
    renderer.free()


@pytest.mark.parametrize("shape", ["ball", "cube"])
def test_a_body_bends_what_is_behind_it(device, shape):
    """And would be far off if it did not."""
    turned = trimesh.transformations.rotation_matrix(0.5, (0, 0, 1))
    smooth = shape == "ball"
    made = trimesh.creation.uv_sphere(radius=0.7, count=[24, 48]) if smooth else trimesh.creation.box((1, 1, 1)).apply_transform(turned)
    scene = room(made.apply_translation((0, 0, 0.8)), smooth=smooth)
    renderer = renderer_of(scene)
    found, origin, view, normal, mirrored = looked(renderer)
    eye = np.broadcast_to(CAMERA.world_from_camera[:3, 3], view.shape)
    mesh = world_mesh(scene, scene.instances[0])
    met, entry, at, out, way, share, _ = through_body(mesh, smooth, eye, view, 1.5)
    seen = shown(scene, out + 1e-4 * way, way) * share[:, None] * TINT
    face = fresnel(np.clip(-(view * normal).sum(1, keepdims=True), 0, 1), 1.0, 1.5)
    expected = seen + (shown(scene, origin + 1e-4 * normal, mirrored) * face)[met]
    straight = shown(scene, entry, view[met]) * share[:, None] * TINT
    off, without = np.abs(found[met] - expected).mean(), np.abs(straight - seen).mean()
    assert met.sum() > 200 and off < tolerances.GLASS_BODY and off < 0.5 * without, (off, without)
    renderer.free()


def test_panes_are_seen_through_in_mirrors(device):
    """A view through a pane within a mirror's view: what is behind the pane, as bright as the pane and the mirror leave it."""
    back = pane(3.0, 2.0, (0, 1.2, 0.8), (0, -1, 0))
    back.metadata.update(material=replace(MIRROR, base_color=(1.0, 1.0, 1.0)))
    scene = room(window(0.02, y=-1.5), Back=back, Far=trimesh.creation.box((12, 0.1, 8)).apply_translation((0, -3.5, 1.0)))
    view = hand_scenes.camera((0.0, -0.6, 1.0), (0.0, 1.2, 0.8), (64, 48), fov=1.0)
    renderer = renderer_of(scene)
    answer, rays = renderer.answer(view), renderer.ray_map(view)
    mask = rays.reflector == 1
    first = tracer(scene, waves)(Rays(rays.origin[mask] - np.float32([0, 1e-4, 0]), rays.direction[mask]), bounces=0)
    on_pane = first.object == 0
    start, way = first.position[on_pane].astype(float), rays.direction[mask][on_pane].astype(float)
    face = fresnel(np.abs(way[:, 1:2]), 1.0, 1.5)
    through = TINT * (1 - face) / (1 + face)
    # What the pane mirrors is the mirror, which shows the room behind the pane once more.
    bounced = way * (1, -1, 1)
    again = tracer(scene, waves)(Rays((start - 1e-3 * way).astype("f"), bounced.astype("f")), hide=("Mirror",), bounces=1).radiance
    expected = shown(scene, start + 0.03 * way, way) * through + again * face * (1 + through)
    off = np.abs(answer.radiance[mask][on_pane] - expected).mean()
    assert on_pane.sum() > 300 and off < tolerances.GLASS_PANE, off
    tree = renderer.mirrored_views
    assert [isinstance(tree.mirrors[node.mirror], Pane) for node in tree.nodes if node.depth == 2].count(True) == 1
    renderer.free()


def test_scenes_without_glass_pay_nothing(device):
    """No texture, no program, no line of a shader, no pass; with glass a window that stands still makes nothing new."""
    opaque, clear = (renderer_of(room(window(0.02), replace(GLASS, refracts=refracts))) for refracts in (False, True))
    made = []
    for renderer in (opaque, clear):
        renderer.prepare()
        renderer.picture(CAMERA)
        before = renderer.counts()
        renderer.picture(CAMERA)
        after = renderer.counts()
        assert all(after[name] == before[name] for name in ("uploads", "compiles", "allocations"))
        made.append((after["passes"] - before["passes"], renderer.bytes()))
    assert not opaque._answers.has_glass and not opaque._answers._bodies._made and not opaque.scene.resolve.plan.glass
    assert not any("through" in vars(target) for target in opaque._passes._targets.values())
    assert not any("through_tx" in text for _, text in opaque.scene.resolve._shared()[0])
    assert clear.scene.resolve.plan.glass and made[1][0] > made[0][0] and made[1][1] > made[0][1]
    opaque.free(), clear.free()
