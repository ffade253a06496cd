"""Curved mirrors drawn by one view for each picture that shows them, against reflected rays: what is before them, mirrors in mirrors, lamps, cost."""

from dataclasses import replace

import hand_scenes
import numpy as np
import pytest
import tolerances
from lamp_scenes import LIGHT, lit_scene, lit_tracer
from mesh_scenes import intersect, tracer
from mirror_rooms import SURFACES, baked, one_mirror, paint
from virtual_scenes import ball

from reflect_addon.core import surface_radiance
from reflect_addon.core.curved_views import CurvedMirror
from reflect_addon.core.lamp_hits import with_lamps
from reflect_addon.core.rays import Rays
from reflect_addon.core.spaces import STATUS_HIT

# Beside the pane, looked at from it: the second ball's view shows the pane, which shows both balls.
# The small one is nearly a point: what its middle sees in the pane is what its surface sees.
SCENE = one_mirror(Second=ball(0.35, (0.0, 0.1, 0.9), 3), Third=ball(0.3, (0.5, -0.7, 0.4), 3), Small=ball(0.03, (-0.6, -1.0, 0.8), 3))
CAMERA = hand_scenes.camera((-1.2, -0.6, 1.1), (0.0, 0.05, 0.87), (160, 120), fov=0.5)
CLOSE = hand_scenes.camera((-0.75, -1.04, 0.83), (-0.6, -1.0, 0.8), (96, 72), fov=0.5)
BALLS = ("Second", "Third")


@pytest.fixture(scope="module")
def found():
    return baked(SCENE, curved=True, curved_views=True)


def renderer_of(found, **settings):
    from reflect_addon.gpu.renderer import Renderer

    assets = {name: replace(asset, settings={**asset.settings, **settings}) for name, asset in found.assets.items()}
    return Renderer(found.scene, assets, surfaces=found.surfaces)


@pytest.fixture(scope="module")
def views(device, found):
    renderer = renderer_of(found)
    yield renderer
    renderer.free()


def rays_of(scene, ray_map):
    """Its covered pixels' rays, lifted off the surface."""
    mask, rays = ray_map.covered(), ray_map.rays()
    return mask, replace(rays, origin=(rays.origin + 2e-6 * scene.diagonal() * ray_map.normal[mask]).astype(np.float32))


def seen(views, camera, name):
    """(answers to lines, truth, which are drawn, whose rays meet the pane, whose meet a ball by the pane) of the pixels of one ball."""
    answer, ray_map = views.answer(camera, footprints=False), views.ray_map(camera)
    mask, rays = rays_of(SCENE, ray_map)
    mine = ray_map.reflector[mask] == ray_map.reflector_names.index(name)
    rays, shown, names = Rays(rays.origin[mine], rays.direction[mine]), tracer(SCENE, paint), [i.name for i in SCENE.instances]
    first = shown(rays, bounces=0)
    near = first.hit & (first.object == names.index("Mirror"))
    again = Rays((first.position[near] + [1e-5, 0, 0]).astype(np.float32), (rays.direction[near] * [-1, 1, 1]).astype(np.float32))
    met, second = shown(again, bounces=0), np.zeros(len(near), bool)
    second[near] = met.hit & np.isin(met.object, [names.index(b) for b in BALLS])
    fields = (getattr(answer, field)[mask][mine] for field in ("radiance", "position", "status"))
    radiance, position, status = fields
    return radiance, position, shown(rays, bounces=8), status == STATUS_HIT, near, second


def test_a_curved_mirror_shows_what_is_before_it(views):
    """A part of its pixels; places too. The others fall back."""
    radiance, position, truth, drawn, near, _ = seen(views, CAMERA, "Second")
    dull = drawn & ~near & truth.hit
    off = np.abs(radiance - truth.radiance).max(1)
    assert drawn.sum() > 500 and dull.sum() > 200 and (~drawn).sum() > 500 and np.isfinite(radiance).all()
    assert np.median(off[drawn]) < tolerances.CURVED_DRAWN
    assert np.median(np.linalg.norm(position - truth.position, axis=1)[dull]) < tolerances.CURVED_PLACE


def test_curved_in_planar_in_curved(views):
    """The view of a ball shows the pane, whose view shows balls, by their views."""
    radiance, _, truth, drawn, _, second = seen(views, CLOSE, "Small")
    kinds = {tuple(isinstance(views.mirrored_views.mirrors[m], CurvedMirror) for m in node.path) for node in views.mirrored_views.nodes}
    off = np.abs(radiance - truth.radiance).max(1)
    assert (True, False, True) in kinds and (drawn & second).sum() > 10
    assert np.median(off[drawn & second]) < tolerances.CURVED_DEEP


def test_views_are_counted_and_nothing_is_kept(views):
    """As many as the schedule has, in every frame, no face of a cube map and no new memory."""
    views.answer(CAMERA, positions=False)
    before = views.counts()
    views.answer(CAMERA, positions=False)
    after = views.counts()
    assert after["views"] - before["views"] == after["views_drawn"] - before["views_drawn"] == len(views.mirrored_views.nodes) > 3
    assert views.settled
    assert all(after[name] == before[name] for name in ("uploads", "compiles", "allocations")) and after["faces"] == 0


def test_nothing_is_made_where_it_is_not_asked_for(device, found):
    renderer = renderer_of(found, curved=False, curved_views=False)
    renderer.answer(CAMERA)
    assert not renderer.mirrors.shown.glossy and not any(isinstance(m, CurvedMirror) for m in renderer.mirrored_views.mirrors)
    assert renderer.counts()["faces"] == 0
    renderer.free()


def test_lamps_are_added_once(device):
    """To what is drawn, as the ray meets them; what falls back is answered with lamps and all by maps, which here know of none."""
    from reflect_addon.gpu.renderer import Renderer

    scene = lit_scene()
    made, surfaces = baked(scene, curved_views=True), surface_radiance.bake(scene, lit_tracer(scene), scene.lamps, SURFACES)
    within, beside = (hand_scenes.camera(eye, (0, 0, 0.5), (96, 72), fov=0.45) for eye in ((3, -0.5, 1.2), (0.3, -3, 1.0)))
    frames = []
    for lamps in (scene.lamps, ()):
        renderer = Renderer(replace(scene, lamps=lamps), made.assets, surfaces=surfaces)
        frames.append([(renderer.answer(view, footprints=False), renderer.ray_map(view)) for view in (within, beside)])
        renderer.free()
    counted = []
    for (lit, ray_map), (bare, _) in zip(*frames, strict=True):
        mask, rays = rays_of(scene, ray_map)
        traced = tracer(scene, paint)(rays)
        lamp = with_lamps(traced, rays, scene, intersect(scene)).object - len(traced.object_names)
        added, drawn = (lit.radiance - bare.radiance)[mask], bare.status[mask] == STATUS_HIT
        shown = drawn & (lamp >= 0)
        assert np.allclose(added[shown], np.array(list(LIGHT.values()))[lamp[shown]], atol=tolerances.CURVED_LAMP)
        assert not added[~drawn].any(), "none where nothing is drawn"
        counted.append((shown.sum(), (lamp[~drawn] >= 0).sum()))
    assert counted[0][0] > 50 and counted[1][1] > 20, counted
