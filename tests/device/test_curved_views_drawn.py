"""Curved mirrors drawn by one view for each picture that shows them, against reflected rays: what is before them, mirrors in mirrors, lamps, cost."""

from dataclasses import replace

import hand_scenes
import numpy as np
import pytest
import tolerances
from lamp_scenes import lit_scene, lit_tracer
from mesh_scenes import intersect, tracer
from mirror_rooms import SURFACES, baked, one_mirror, paint
from virtual_scenes import ball

from reflect_addon.core import surface_radiance
from reflect_addon.core.curved_views import CurvedMirror
from reflect_addon.core.lamp_hits import with_lamps
from reflect_addon.core.rays import Rays
from reflect_addon.core.spaces import STATUS_HIT

# Beside the pane, looked at from it: the second ball's view shows the pane, which shows both balls.
SCENE = one_mirror(Second=ball(0.35, (0.0, 0.1, 0.9), 3), Third=ball(0.3, (0.5, -0.7, 0.4), 3))
CAMERA = hand_scenes.camera((-1.2, -0.6, 1.1), (0.1, -0.1, 0.75), (96, 72), fov=0.9)
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


@pytest.fixture(scope="module")
def frame(views):
    """(answer to lines, mask, truth, which pixels are of a ball and drawn, whether their rays meet the pane and by it a ball)."""
    answer, ray_map = views.answer(CAMERA, footprints=False), views.ray_map(CAMERA)
    mask, rays = rays_of(SCENE, ray_map)
    shown, names = tracer(SCENE, paint), [i.name for i in SCENE.instances]
    truth, first = shown(rays, bounces=8), shown(rays, bounces=0)
    near = first.hit & (first.object == names.index("Mirror"))
    again = Rays((first.position[near] + [1e-5, 0, 0]).astype(np.float32), (rays.direction[near] * [-1, 1, 1]).astype(np.float32))
    second = np.zeros(len(near), bool)
    met = shown(again, bounces=0)
    second[near] = met.hit & np.isin(met.object, [names.index(b) for b in BALLS])
    of_ball = np.isin(ray_map.reflector[mask], [ray_map.reflector_names.index(b) for b in BALLS])
    return answer, mask, truth, of_ball & (answer.status[mask] == STATUS_HIT), near, second


def test_a_curved_mirror_shows_what_is_before_it(frame):
    """A third of its pixels; places too. The others fall back."""
    answer, mask, truth, drawn, near, _ = frame
    dull = drawn & ~near & truth.hit
    off = np.abs(answer.radiance[mask] - truth.radiance).max(1)
    assert drawn.sum() > 300 and dull.sum() > 30 and np.isfinite(answer.radiance).all()
    assert np.median(off[drawn]) < tolerances.CURVED_DRAWN
    place = np.linalg.norm(answer.position[mask] - truth.position, axis=1)
    assert np.median(place[dull]) < tolerances.CURVED_PLACE
    back = answer.status[mask] != STATUS_HIT
    assert back.sum() > 100, "what is behind and beside"


def test_curved_in_planar_in_curved(views, frame):
    """The picture of a ball shows the pane, which shows balls."""
    answer, mask, truth, drawn, _, second = frame
    kinds = [tuple(isinstance(views.mirrored_views.mirrors[m], CurvedMirror) for m in node.path) for node in views.mirrored_views.nodes]
    assert (True, False, True) in kinds and (False, True) not in kinds, "the pane itself is not seen"
    mine = drawn & second
    off = np.abs(answer.radiance[mask] - truth.radiance).max(1)
    assert mine.sum() > 30 and np.median(off[mine]) < tolerances.CURVED_DEEP


def test_views_are_counted_and_nothing_is_kept(views):
    """As many as the schedule has, in every frame, no face of a cube map and no new memory."""
    views.answer(CAMERA, positions=False)
    before = views.counts()
    views.answer(CAMERA, positions=False)
    after = views.counts()
    assert after["views"] - before["views"] == len(views.mirrored_views.nodes) > 3 and views.settled
    assert all(after[name] == before[name] for name in ("uploads", "compiles", "allocations")) and after["faces"] == 0


def test_nothing_is_made_where_it_is_not_asked_for(device, found):
    renderer = renderer_of(found, curved=False, curved_views=False)
    renderer.answer(CAMERA)
    assert not renderer.mirrors.shown.glossy and not any(isinstance(m, CurvedMirror) for m in renderer.mirrored_views.mirrors)
    assert renderer.counts()["faces"] == 0
    renderer.free()


def test_lamps_are_added_once(device):
    """To what is drawn. What falls back is answered by maps, which here know of none."""
    from reflect_addon.gpu.renderer import Renderer

    scene, view = lit_scene(), hand_scenes.camera((3, -0.5, 1.2), (0, 0, 0.5), (96, 72), fov=0.45)
    made = baked(scene, curved_views=True)
    surfaces = surface_radiance.bake(scene, lit_tracer(scene), (*scene.instances, *scene.lamps), SURFACES)
    renderer = Renderer(scene, made.assets, surfaces=surfaces)
    answer, ray_map = renderer.answer(view, footprints=False), renderer.ray_map(view)
    renderer.free()
    mask, rays = rays_of(scene, ray_map)
    traced = lit_tracer(scene)(rays)
    lit = with_lamps(traced, rays, scene, intersect(scene)).object >= len(traced.object_names)
    drawn = answer.status[mask] == STATUS_HIT
    off = np.abs(answer.radiance[mask] - traced.radiance).max(1)
    assert (lit & drawn).sum() > 50 and (off[drawn & lit] < 0.5).mean() > 0.9 and (off[drawn & ~lit] < 0.5).mean() > 0.95
    assert (answer.radiance[mask][~drawn & lit].max(1) < 2.0).all(), "none where nothing is drawn"
