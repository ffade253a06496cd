"""Glass: what is recognised, light through a slab and a body against the book, and what is left out."""

from dataclasses import replace

import numpy as np
import pytest
import tolerances
import trimesh
from analytic import unit
from glass_rays import CLEAR, GLASS, fresnel, through_body
from mesh_scenes import snapshot
from mirror_rooms import pane
from mirror_views import camera

from reflect_addon.core import convex_map, glass_optics
from reflect_addon.core.glass_body import followed, left_out, part_of_asset, sentence
from reflect_addon.core.glass_shapes import OTHER, PANE, SOLID, glass_of, panes_of
from reflect_addon.core.kernel import evaluate, record_function
from reflect_addon.core.mirror_planes import planes_of
from reflect_addon.core.pane_view import shift, through
from reflect_addon.core.reflection_tree import DEPTH, FAINT, TreeSettings
from reflect_addon.core.tree_growth import grow

TURNED = trimesh.transformations.rotation_matrix(0.6, (0.3, 0.5, 0.8))


def scene_of(shape, material=CLEAR, smooth=False, **more):
    shape.metadata.update(material=material, smooth=smooth)
    return snapshot(shape, **more)


def found_in(shape, **options):
    scene = scene_of(shape, **options)
    return glass_of(scene, scene.instances[0])


BODIES = {
    "ball": (trimesh.creation.uv_sphere(radius=0.7, count=[24, 48]), True),
    "lens": (trimesh.creation.uv_sphere(radius=0.7, count=[24, 48]).apply_scale((1, 0.35, 1)), True),
    "cube": (trimesh.creation.box((1.0, 1.2, 0.8)).apply_transform(TURNED), False),
    "prism": (trimesh.creation.cylinder(0.6, 1.0, sections=3).apply_transform(TURNED), False),
}


@pytest.fixture(scope="module", params=BODIES)
def body(request):
    shape, smooth = BODIES[request.param]
    shape = shape.copy().apply_translation((3.0, -2.0, 1.0))
    glass = found_in(shape, smooth=smooth)
    assert glass.kind == SOLID
    return shape, smooth, glass, convex_map.build(glass.corners, glass.shading)


def rays_at(shape, rng, count=2000):
    """From all around, towards points within."""
    middle, size = shape.bounds.mean(0), np.ptp(shape.bounds, axis=0).max()
    start = middle + 3 * size * unit(rng.normal(size=(count, 3)))
    return start, unit(middle + 0.45 * size * rng.uniform(-1, 1, (count, 3)) * (0.9, 0.9, 0.9) - start)


def test_shapes_are_told_apart():
    assert found_in(pane(2, 1, (0, 0, 0), (0, 1, 1))).kind == PANE
    assert found_in(trimesh.creation.box((2, 0.02, 1)).apply_transform(TURNED)).kind == PANE
    bowl = trimesh.creation.icosphere(3, 1.0)
    bowl.vertices[bowl.vertices[:, 2] > 0.3, 2] *= -0.5
    open_ball = trimesh.creation.icosphere(3, 1.0)
    open_ball.update_faces(open_ball.triangles_center[:, 2] < 0.5)
    for shape, reason in ((trimesh.creation.torus(1, 0.3), "dents"), (bowl, "dents"), (open_ball, "open")):
        glass = found_in(shape)
        assert glass.kind == OTHER and reason in glass.reason
    assert "thin" in found_in(trimesh.creation.icosphere(2), material=replace(CLEAR, thin_wall=True)).reason
    assert found_in(trimesh.creation.icosphere(2), material=replace(CLEAR, refracts=False)) is None
    inside_out = trimesh.creation.icosphere(2)
    inside_out.invert()
    assert found_in(inside_out).kind == SOLID


def test_panes_have_two_sides_and_the_thickness_between():
    scene = scene_of(trimesh.creation.box((2, 0.02, 1)).apply_transform(TURNED), GLASS)
    one, other = panes_of(scene)
    assert np.allclose(one.normal, -other.normal) and one.thickness == pytest.approx(0.02, rel=1e-4)
    assert np.allclose(one.beyond.origin @ one.normal, other.origin @ one.normal, atol=1e-6)
    assert one.specular == pytest.approx(0.96 / 1.04)
    assert panes_of(scene_of(trimesh.creation.icosphere(2))) == ()


def faces(cosine, ior, tint):
    count = len(cosine)
    mirrored = np.repeat(fresnel(cosine, 1.0, ior)[:, None], 3, 1).astype(np.float32)
    program = record_function(glass_optics.pane, glass_optics.PANE_INPUTS)
    return mirrored[:, 0], evaluate(program, {"mirrored": mirrored, "tint": np.broadcast_to(np.float32(tint), (count, 3))})


def test_a_slab_lets_through_and_mirrors_the_whole_series():
    """Summed term by term; what is not coloured loses nothing."""
    cosine = np.linspace(0.01, 1, 50)
    one, both = faces(cosine, 1.5, (1.0, 0.7, 0.2))
    for k, tint in enumerate((1.0, 0.7, 0.2)):
        bounces = one[:, None] ** (2 * np.arange(2000))
        through = tint**2 * (1 - one) ** 2 * bounces.sum(1)
        back = one + tint**2 * (1 - one) ** 2 * one * bounces.sum(1)
        np.testing.assert_allclose(both["through"][:, k], through, rtol=tolerances.GLASS_SERIES)
        np.testing.assert_allclose(both["mirrored"][:, k], back, rtol=tolerances.GLASS_SERIES)
    total = both["through"] + both["mirrored"]
    assert (total <= 1 + 1e-6).all() and np.allclose(total[:, 0], 1, atol=1e-6)


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.0])
def test_the_way_through_a_slab(angle):
    """Two bends by Snell, against the shift that a view through a pane makes."""
    thickness, ior = 0.3, 1.5
    inner = np.arcsin(np.sin(angle) / ior)
    along = thickness * np.tan(inner)  # where it leaves, beside where it entered
    nearer = thickness - along / np.tan(angle) if angle else thickness * (1 - 1 / ior)
    assert shift(thickness, ior, np.cos(angle)) == pytest.approx(nearer)


def test_a_body_bends_rays_as_the_book_says(body, rng):
    """The NumPy kernel against Embree and Snell, from all around."""
    shape, smooth, _, made = body
    start, view = rays_at(shape, rng)
    met, entry, normal, out, way, share, took = through_body(shape, smooth, start, view, 1.5)
    found = followed(made, entry, view[met], normal, 1.5)
    leaves = took <= glass_optics.MOST_INSIDE
    assert met.sum() > 800 and leaves.mean() > 0.9
    assert (found["found"] == 1).all() and all(np.isfinite(v).all() for v in found.values())
    apart = np.degrees(np.arccos(np.clip((found["direction"] * way).sum(1), -1, 1)))[leaves]
    off = np.linalg.norm(found["origin"] - out, axis=1)[leaves] / made.size
    right = (apart < 0.5) & (off < 0.01)
    assert right.mean() > 1 - tolerances.GLASS_EDGES
    assert np.abs(found["through"][leaves, 0] - share[leaves])[right].max() < 0.02
    # Nothing is made: what goes through, what is mirrored and what is left out are all there is.
    entered = 1 - fresnel(np.clip(-(view[met] * normal).sum(1), 0, 1), 1.0, 1.5)
    assert np.allclose(found["through"][:, 0] + found["left"], entered, atol=1e-5) and (found["left"] >= -1e-6).all()


def test_a_ball_sends_rays_where_a_ball_does():
    """Off its middle by b it turns a ray by 2 (asin b - asin(b / n)) about the middle."""
    ball = trimesh.creation.icosphere(5, 1.0)
    glass = found_in(ball, smooth=True)
    made = convex_map.build(glass.corners, glass.shading)
    beside = np.linspace(0.02, 0.95, 60)
    entry = np.column_stack([beside, -np.sqrt(1 - beside**2), 0 * beside])
    found = followed(made, entry, np.broadcast_to([0.0, 1, 0], entry.shape), entry, 1.5)
    turned = np.arctan2(-found["direction"][:, 0], found["direction"][:, 1])
    np.testing.assert_allclose(turned, 2 * (np.arcsin(beside) - np.arcsin(beside / 1.5)), atol=np.radians(0.5))


def test_what_is_mirrored_whole_goes_on(rng):
    """Into the end of a long bar at a slant, whose sides are too grazing to leave by."""
    bar = trimesh.creation.box((0.5, 2.0, 0.5))
    glass = found_in(bar)
    made = convex_map.build(glass.corners, glass.shading)
    entry = np.column_stack([rng.uniform(-0.2, 0.2, 50), np.full(50, -1.0), rng.uniform(-0.2, 0.2, 50)])
    view = np.broadcast_to(unit(np.array([0.5, 1.0, 0.2])), entry.shape)
    found = followed(made, entry, view, np.broadcast_to([0.0, -1, 0], entry.shape), 1.5)
    np.testing.assert_allclose(found["origin"][:, 1], 1.0, atol=1e-3)
    np.testing.assert_allclose(np.abs(found["direction"]), np.abs(view), atol=1e-3)


def test_what_is_left_out_is_said():
    """Of a ball what Fresnel mirrors where light leaves, at the angle at which it entered: the mean over all directions."""
    ball = found_in(trimesh.creation.icosphere(4), smooth=True)
    made = convex_map.build(ball.corners, ball.shading, side=32)
    sine2 = (np.arange(2000) + 0.5) / 2000  # as much light from each share of the sine's square
    mirrored = fresnel(np.sqrt(1 - sine2), 1.0, 1.5)
    expected = ((1 - mirrored) * mirrored).mean() / (1 - mirrored).mean()
    assert left_out(ball, made) == pytest.approx(expected, abs=tolerances.GLASS_LEFT)
    parts = part_of_asset(ball)
    assert "bent twice" in sentence(parts["options"], parts["uniforms"]) and parts["images"].keys() == set(glass_optics.IMAGES)
    ring = part_of_asset(found_in(trimesh.creation.torus(1, 0.3)))
    assert not ring["images"] and sentence(ring["options"], ring["uniforms"]) == "Its glass does not refract here, as it has dents."
    assert part_of_asset(None)["options"] == {} and sentence({}, {}) == ""


def test_an_eye_inside_sees_no_body():
    glass = found_in(trimesh.creation.icosphere(3), smooth=True)
    made = convex_map.build(glass.corners, glass.shading, side=16)
    found = followed(made, np.array([[0.0, 1, 0]]), np.array([[0.0, 1, 0]]), np.array([[0.0, -1, 0]]), 1.5)
    assert found["found"] == 0


def test_a_view_through_a_pane_is_the_same_camera_behind_it():
    """Pixels keep their directions; what lies before the pane's other face is clipped."""
    scene = scene_of(trimesh.creation.box((2, 0.15, 2)))
    view = camera((0.3, -3, 0.2), (0, 0, 0), size=(64, 48))
    near, far = sorted(panes_of(scene), key=lambda pane: pane.normal[1])
    assert through(view, far) is None
    seen = through(view, near)
    np.testing.assert_allclose(seen.primary_rays().direction, view.primary_rays().direction, atol=1e-6)
    moved = seen.world_from_camera[:3, 3] - view.world_from_camera[:3, 3]
    np.testing.assert_allclose(moved, (0, 0.15 / 3, 0), atol=1e-6)
    for y, inside in ((0.07, False), (0.08, True)):
        clip = seen.clip_from_world() @ (0.1, y, 0.1, 1)
        assert (clip[2] > -clip[3]) == inside


def test_views_through_panes_are_counted():
    """A pane's view weighs what it lets through, ends by depth and energy like a mirror's, and two panes in a row are two levels."""
    one, other = (trimesh.creation.box((2, 0.02, 2)).apply_translation((0, y, 0)) for y in (0, 1))
    other.metadata.update(material=CLEAR)
    scene = scene_of(one, Other=other)
    planes, view = (*planes_of(scene), *panes_of(scene)), camera((0, -3, 0.1), (0, 0, 0), size=(64, 48))
    share = 0.96 / 1.04
    tree = grow(view, planes, TreeSettings(depth=3, least_energy=0.01))
    through_both = [n for n in tree.nodes if n.weight > 0.5]
    assert {n.depth: n.weight for n in through_both} == {1: pytest.approx(share, rel=1e-3), 2: pytest.approx(share**2, rel=1e-3)}
    short = grow(view, planes, TreeSettings(depth=1, least_energy=0.01))
    assert short.left_out[DEPTH] > 0.05 and short.levels == 1
    faint = grow(view, planes, TreeSettings(depth=3, least_energy=0.9))
    assert not faint.nodes and faint.left_out[FAINT] > 0.05
