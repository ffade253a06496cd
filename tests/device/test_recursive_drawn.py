"""Planar mirrors drawn by mirrored views against Embree: places pixel for pixel, mirrors in mirrors, edges, and what a frame costs."""

from dataclasses import replace

import hand_scenes
import numpy as np
import pytest
import tolerances
from analytic import rotation
from mesh_scenes import tracer
from mirror_rooms import baked, one_mirror, paint, pane, two_mirrors
from virtual_scenes import ball

from reflect_addon.core.methods import recursive, virtual_objects
from reflect_addon.core.spaces import FAR, STATUS_FELL_BACK, STATUS_HIT

CAMERA = hand_scenes.camera((1.2, -1.0, 1.3), (-1.5, 0.2, 0.7), (128, 96), fov=0.9)
SCENE = one_mirror()


def renderer_of(found, scene=None):
    from reflect_addon.gpu.renderer import Renderer

    return Renderer(scene or found.scene, found.assets, surfaces=found.surfaces)


@pytest.fixture(scope="module")
def one_baked():
    return baked(SCENE)


@pytest.fixture(scope="module")
def two_baked():
    """Two mirrors that face each other."""
    return baked(two_mirrors())


def asking(found, **settings):
    """The same assets with other settings, of those that are read when a frame is drawn."""
    return replace(found, assets={name: replace(a, settings={**a.settings, **settings}) for name, a in found.assets.items()})


@pytest.fixture
def drawn(device, one_baked):
    renderer = renderer_of(one_baked)
    yield renderer
    renderer.free()


class Seen:
    """A frame beside its truth, for the covered pixels."""

    def __init__(self, renderer, scene, camera=CAMERA, bounces=6):
        self.answer, self.map = renderer.answer(camera), renderer.ray_map(camera)
        self.mask = self.map.covered()
        rays = self.map.rays()
        lifted = (rays.origin + 2e-6 * scene.diagonal() * self.map.normal[self.mask]).astype(np.float32)
        self.truth = tracer(scene, paint)(replace(rays, origin=lifted), bounces=bounces)
        self.status = self.answer.status[self.mask]
        self.radiance, self.position = self.answer.radiance[self.mask], self.answer.position[self.mask]
        self.sky = np.abs(self.position).max(-1) > FAR / 2
        self.off = np.linalg.norm(self.position - self.truth.position, axis=1) / scene.diagonal()
        self.error = np.abs(self.radiance - self.truth.radiance).max(-1)

    def check(self):
        """Every pixel is drawn, and shows what its ray meets; pixels that an edge cuts may fall on either side."""
        assert self.mask.sum() > 100 and (self.status == STATUS_HIT).all()
        same = self.sky == ~self.truth.hit
        assert same.mean() > 1 - tolerances.RECURSIVE_EDGE
        both = self.truth.hit & ~self.sky
        assert np.percentile(self.off[both], 99) < tolerances.RECURSIVE_PLACE
        assert np.isfinite(self.radiance).all() and np.isfinite(self.position).all()


def test_a_mirror_shows_what_its_rays_meet(drawn):
    seen = Seen(drawn, SCENE)
    seen.check()
    assert seen.truth.hit.sum() > 1000 and np.median(seen.error) < tolerances.RECURSIVE_RADIANCE


def test_an_orthographic_camera_too(drawn):
    Seen(drawn, SCENE, hand_scenes.camera((1.2, -1.0, 1.3), (-1.5, 0.2, 0.7), (128, 96), ortho=2.0)).check()


def test_the_mirrors_back_shows_what_is_behind(drawn):
    """An open pane mirrors on both sides; each is a mirror of its own."""
    Seen(drawn, SCENE, hand_scenes.camera((-3.0, 0.6, 1.2), (-1.5, 0, 0.9), (128, 96), fov=0.9)).check()


@pytest.mark.parametrize("other", [((1.5, 0, 1.0), (-1, 0, 0)), ((0, 1.5, 1.0), (0, -1, 0))], ids=["facing", "at an angle"])
def test_two_levels_are_two_reflections(device, other):
    """Of rays that meet the other mirror first and then a thing: its radiance."""
    scene = two_mirrors(*other)
    renderer = renderer_of(baked(scene, depth=4))
    seen = Seen(renderer, scene)
    seen.check()
    mirrors = [i.name for i in scene.instances].index("Other")
    second = seen.truth.object == mirrors
    assert second.sum() > 100 and np.median(seen.error[second]) < tolerances.RECURSIVE_RADIANCE
    renderer.free()


def test_without_an_end_the_last_level_is_black(device, two_baked):
    """As the paper's, and as a renderer with that many bounces; with one it is answered by what gathers."""
    scene = two_baked.scene
    second = [i.name for i in scene.instances].index("Other")
    for endless in (False, True):
        renderer = renderer_of(asking(two_baked, depth=1, endless=endless))
        seen = Seen(renderer, scene)
        shown = seen.radiance[seen.truth.object == second]
        assert (shown.max() > 0.1) == endless
        renderer.free()


def test_depth_of_bounces_is_depth_of_levels(device, two_baked):
    for depth in (1, 2, 3, 6):
        renderer = renderer_of(asking(two_baked, depth=depth, endless=False))
        seen = Seen(renderer, two_baked.scene, bounces=depth - 1)
        assert np.mean(seen.error > 10 * tolerances.RECURSIVE_RADIANCE) < tolerances.RECURSIVE_EDGE
        renderer.free()


def test_a_camera_uploads_compiles_and_allocates_nothing(device, two_baked):
    renderer = renderer_of(two_baked)
    renderer.prepare()
    before = renderer.counts()
    renderer.picture(CAMERA)
    after = renderer.counts()
    assert after["uploads"] == before["uploads"] and after["compiles"] <= before["compiles"] + 3  # the picture's own passes
    before = renderer.counts()
    eyes = ((0.5, -0.5, 1.0), (1.0, 1.2, 1.4), (-1.0, -1.0, 0.8))
    for turn in range(2):
        if turn:  # by then targets are as large as these views need
            before = renderer.counts()
        for eye in eyes:
            renderer.picture(hand_scenes.camera(eye, (-1.5, 0.2, 0.7), (128, 96), fov=0.9))
        assert renderer.counts()["uploads"] == before["uploads"] and renderer.counts()["compiles"] == before["compiles"]
    after = renderer.counts()
    assert after["views"] > before["views"] and all(after[n] == before[n] for n in ("uploads", "compiles", "allocations"))
    renderer.free()


def test_one_set_of_targets_a_level(device):
    """However many mirrors a level has."""
    more = {f"M{k}": pane(0.5, 0.8, (-1.0 + 0.6 * k, 1.5, 0.9), (0, -1, 0)) for k in range(4)}
    sizes = {}
    for name, scene in (("one", one_mirror()), ("five", one_mirror(**more))):
        renderer = renderer_of(baked(scene, depth=1))
        renderer.picture(hand_scenes.camera((1.2, -1.4, 1.2), (-0.6, 1.0, 0.8), (128, 96), fov=1.3))
        views = renderer.mirrored_views
        sizes[name] = len(views.nodes), renderer.counts()["allocations"], len(renderer._answers.levels.targets.by_depth)
        renderer.free()
    assert sizes["five"][0] >= 4 and sizes["five"][1:] == sizes["one"][1:] and sizes["one"][2] == 1


def test_targets_are_as_large_as_what_is_seen(device, two_baked):
    """Deep in a row of mirrors that face each other little is; and what is shown is the same, to the pixel."""
    renderer = renderer_of(asking(two_baked, depth=6))
    picture = renderer.picture(CAMERA)
    levels = renderer._answers.levels.targets.by_depth
    assert len(levels) == renderer.mirrored_views.levels > 2
    assert levels[max(levels)].bytes < 0.5 * levels[1].bytes
    fresh = renderer_of(asking(two_baked, depth=6))  # whose targets were larger before
    fresh.picture(hand_scenes.camera((0.5, -0.5, 1.0), (-1.5, 0.2, 0.7), (128, 96), fov=1.5))
    np.testing.assert_allclose(fresh.picture(CAMERA), picture, atol=2e-3)
    renderer.free(), fresh.free()


def test_what_moves_needs_no_bake(drawn, rng):
    """A mirror that turns, a thing that moves: the picture is the scene's as it is, and nothing goes up."""
    drawn.picture(CAMERA)
    turn = np.eye(4)
    turn[:3, :3] = rotation(rng)
    about = np.array([0.4, 0.7, 0.5])
    turn[:3, 3] = about - turn[:3, :3] @ about + [0.1, -0.3, 0.2]
    tilt = np.eye(4)
    tilt[:2, :2] = [[np.cos(0.2), -np.sin(0.2)], [np.sin(0.2), np.cos(0.2)]]
    moves = {"Torus": turn, "Mirror": tilt}
    instances = tuple(replace(i, world_from_object=moves.get(i.name, np.eye(4)) @ i.world_from_object) for i in SCENE.instances)
    scene = replace(SCENE, instances=instances)
    before = drawn.counts()
    drawn.scene.update(scene)
    drawn.picture(CAMERA)
    after = drawn.counts()
    assert all(after[name] == before[name] for name in ("uploads", "compiles"))
    Seen(drawn, scene).check()


def test_planes_are_looked_for_when_a_reflector_moves(drawn, monkeypatch):
    from reflect_addon.core.methods import recursive

    looked = []
    found = recursive.drawn_mirrors
    monkeypatch.setattr(recursive, "drawn_mirrors", lambda scene: looked.append(scene) or found(scene))
    shift = np.eye(4)
    shift[0, 3] = 0.1
    for name, times in (("Torus", 0), ("Mirror", 1)):
        moved = tuple(replace(i, world_from_object=shift @ i.world_from_object) if i.name == name else i for i in SCENE.instances)
        drawn.scene.update(replace(SCENE, instances=moved))
        assert len(looked) == times
    Seen(drawn, drawn.scene.snapshot).check()


def test_a_curved_mirror_in_a_planar_one_is_answered_by_its_own_kernel(device):
    scene = one_mirror(Second=ball(0.3, (0.0, 0.1, 0.9), 4))
    renderer = renderer_of(baked(scene))
    seen = Seen(renderer, scene)
    mine = seen.truth.object == [i.name for i in scene.instances].index("Second")
    direct = seen.map.reflector[seen.mask] == 1
    assert (seen.status[direct] == STATUS_FELL_BACK).all()
    mine &= ~direct
    assert mine.sum() > 50 and np.median(seen.error[mine]) < 0.1 < seen.truth.radiance[mine].mean()
    renderer.free()


def test_virtual_objects_in_a_mirrored_view(device):
    """Each reflector by its own method; the next frames need no other memory, though the ball is drawn into two targets."""
    scene = one_mirror(Second=ball(0.3, (0.0, 0.1, 0.9), 4))
    found, shown = baked(scene), baked(scene, method=virtual_objects)
    both = replace(found, assets={**found.assets, "Second": shown.assets["Second"]})
    renderer = renderer_of(both)
    seen = Seen(renderer, scene)
    direct = seen.map.reflector[seen.mask] == 1
    through = ~direct & (seen.truth.object == [i.name for i in scene.instances].index("Second"))
    assert (seen.status[direct & seen.truth.hit] == STATUS_HIT).mean() > 1 - 2 * tolerances.VIRTUAL_MISSED
    assert through.sum() > 50 and np.median(seen.error[through]) < 0.1 < seen.truth.radiance[through].mean()
    renderer.answer(CAMERA, positions=False)
    before = renderer.counts()
    renderer.answer(CAMERA, positions=False)
    assert all(renderer.counts()[name] == before[name] for name in ("allocations", "uploads", "compiles"))
    renderer.free()


def test_targets_do_not_pop_and_are_given_back(device, two_baked, monkeypatch):
    """A camera that sways makes no new ones once it has been everywhere; one that stays away lets go of them."""
    from reflect_addon.gpu import level_targets

    monkeypatch.setattr(level_targets, "PATIENCE", 5)
    renderer = renderer_of(asking(two_baked, depth=3))
    made = []
    for frame in range(16):
        x = 1.0 + 0.3 * np.sin(1.3 * frame)
        renderer.picture(hand_scenes.camera((x, -1.0, 1.3), (-1.5, 0.2, 0.7), (128, 96), fov=0.9))
        made.append(renderer.counts()["allocations"])
    assert made[-1] == made[6]
    large, level = renderer.mirrors.targets.bytes(), renderer.mirrored_views.levels
    for _ in range(8):
        renderer.picture(hand_scenes.camera((14.0, -9.0, 8.0), (-1.5, 0.2, 0.7), (128, 96), fov=0.9))
    assert renderer.mirrors.targets.bytes() < 0.5 * large and level >= renderer.mirrored_views.levels > 0
    renderer.free()


def test_what_is_culled_is_not_seen(device):
    """Each culling switched off, the picture is the same; no fewer views, triangles, pixels nor bytes are drawn, and for some more."""
    found, work, shown = baked(two_mirrors((1.5, 0.4, 1.0), (-1, -0.2, 0)), depth=3), {}, {}
    for name in ("", *(name for name in recursive.DEFAULTS if name.startswith("cull_"))):
        renderer = renderer_of(asking(found, **({name: False} if name else {})))
        shown[name] = renderer.picture(CAMERA)
        counts, tree = renderer.counts(), renderer.mirrored_views
        work[name] = np.array([counts["views"], counts["triangles"], tree.pixels, renderer.mirrors.targets.bytes()])
        renderer.free()
        assert (work[""] <= work[name]).all() and work[""].min() > 0
        assert np.abs(shown[""] - shown[name])[..., :3].max(-1).mean() < tolerances.RECURSIVE_CULLED
    assert all((work[""] < work[f"cull_{name}"]).any() for name in ("frustum", "scissor", "size"))


def test_fifty_mirrors_are_bounded_work(device, one_baked, rng):
    """Panes all over the room, some through each other and edge to edge, to depth 8."""
    panes = {}
    for k in range(50):
        panes[f"M{k}"] = pane(*rng.uniform(0.2, 0.8, 2), rng.uniform((-1.3, -1.5, 0.3), (0.8, 1.5, 1.6)), rng.normal(size=3))
    from reflect_addon.gpu.renderer import Renderer

    asset = one_baked.assets["Mirror"]
    asset = replace(asset, settings={**asset.settings, "depth": 8})
    renderer = Renderer(one_mirror(**panes), {"": asset}, surfaces=one_baked.surfaces)
    answer, views = renderer.answer(CAMERA), renderer.mirrored_views
    assert len(views.nodes) <= 64 and views.levels <= 8 and views.culled["most"] > 0  # what is left out is answered by maps
    assert np.isfinite(answer.radiance).all() and np.isfinite(answer.position).all() and (answer.status == STATUS_HIT).sum() > 1000
    renderer.free()


@pytest.mark.parametrize("x", [-1.5, -1.5 + 1e-7, -1.5 - 1e-7])
def test_an_eye_in_the_mirrors_plane(drawn, x):
    picture = drawn.answer(hand_scenes.camera((x, -3.0, 1.0), (x + 0.2, 0, 0.9), (96, 64)))
    assert np.isfinite(picture.radiance).all() and np.isfinite(picture.position).all()


def test_a_mirror_of_a_pixel(drawn):
    """Too far to matter: a small number of views, nothing that is not finite."""
    answer = drawn.answer(hand_scenes.camera((40.0, 6.0, 20.0), (-1.5, 0, 1), (32, 24)))
    assert 0 < (answer.status > 0).sum() < 12 and np.isfinite(answer.radiance).all()


def test_a_mirror_that_the_near_plane_cuts(drawn):
    Seen(drawn, SCENE, hand_scenes.camera((-1.35, -0.6, 1.0), (-1.55, 0.4, 0.8), (96, 64), fov=1.4)).check()


@pytest.mark.parametrize("scale", [1e-4, 1e5])
def test_any_size_shows_the_same(device, scale):
    """Scenes of 0.6 mm and of 600 km: the same statuses and places, to rounding."""
    def scaled(scene):
        grow = np.diag([scale, scale, scale, 1.0])
        return replace(scene, instances=tuple(replace(i, world_from_object=grow @ i.world_from_object) for i in scene.instances))

    found = baked(SCENE)
    asked = {name: replace(a, parts=()) for name, a in found.assets.items()}
    from reflect_addon.gpu.renderer import Renderer

    first, second = Renderer(SCENE, asked, surfaces=found.surfaces), Renderer(scaled(SCENE), asked, surfaces=found.surfaces)
    small = hand_scenes.camera(np.array([1.2, -1.0, 1.3]) * scale, np.array([-1.5, 0.2, 0.7]) * scale, (128, 96), 0.9, 0.05 * scale, 1000 * scale)
    one, other = first.answer(CAMERA), second.answer(small)
    same = (one.status == other.status) & (np.abs(one.radiance - other.radiance).max(-1) < 1e-3)
    assert same.mean() > 1 - tolerances.RECURSIVE_EDGE
    near = np.abs(one.position).max(-1) < FAR / 2
    assert np.percentile(np.abs(one.position - other.position / scale)[near & same], 99) < tolerances.RECURSIVE_PLACE * SCENE.diagonal()
    first.free(), second.free()


def test_what_gathers_is_as_it_was(drawn):
    """A renderer without surfaces draws no view, and answers as distance maps do."""
    from reflect_addon.gpu.renderer import Renderer

    plain = Renderer(SCENE, drawn.scene.assets)
    assert plain.mirrored_views is None and set(np.unique(plain.answer(CAMERA).status)) <= {0.0, STATUS_FELL_BACK}
    plain.free()


def test_on_the_floor_places_are_those_of_the_eyes_image(drawn):
    """Its rays met with z = 0."""
    answer, ray_map = drawn.answer(CAMERA), drawn.ray_map(CAMERA)
    eye = CAMERA.world_from_camera[:3, 3] * [-1, 1, 1] + [-3.0, 0, 0]
    mask = ray_map.covered() & (np.abs(answer.position[..., 2]) < 1e-6)
    toward = ray_map.origin[mask].astype(np.float64) - eye
    met = eye + toward * (-eye[2] / toward[:, 2:3])
    assert mask.sum() > 500 and np.abs(answer.position[mask] - met).max() < 2e-5


def test_the_viewport_shows_the_picture(device):
    """Two levels drawn while another framebuffer is bound, whose state they leave alone."""
    renderer = renderer_of(baked(two_mirrors()))
    screen = device.types.GPUOffScreen(CAMERA.width, CAMERA.height, format="RGBA16F")
    with screen.bind():
        framebuffer = device.state.active_framebuffer_get()
        framebuffer.clear(color=(0, 0, 0, 0), depth=1.0)
        renderer.draw_overlay(CAMERA)
        shown = np.array(framebuffer.read_color(0, 0, CAMERA.width, CAMERA.height, 4, 0, "FLOAT").to_list(), np.float32)
    picture = renderer.picture(CAMERA)
    inside = picture[..., 3] > 0.5
    assert inside.sum() > 1000 and np.array_equal(shown[..., 3] > 0.5, inside)
    assert np.allclose(shown[inside][:, :3], np.clip(picture[inside][:, :3], 0, 1), atol=2e-3)
    assert renderer.mirrored_views.levels > 1
    screen.free()
    renderer.free()


def test_attenuation_fades_mirrors_in_mirrors(device):
    """Each reflection by its own distance: what is far in a mirror is darker with a half distance than without."""
    from reflect_addon.gpu.renderer import Renderer

    found = baked(two_mirrors())
    plain, faded = Renderer(found.scene, found.assets, surfaces=found.surfaces), Renderer(found.scene, found.assets, attenuation=1.0, surfaces=found.surfaces)
    one, other = plain.picture(CAMERA), faded.picture(CAMERA)
    lit = one[..., :3].max(-1) > 0.05
    assert lit.sum() > 500 and (other[lit][:, :3].max(-1) < one[lit][:, :3].max(-1)).all()
    plain.free(), faded.free()
