"""The ray map against analytic reflection, and at every scale and camera without a value that is not finite."""

import hand_scenes as scenes
import numpy as np
import pytest
import tolerances

from reflect_addon.core.snapshot import Material


@pytest.fixture
def renderer(device):
    from reflect_addon.gpu.renderer import Renderer

    return lambda *things: Renderer(scenes.snapshot(*things), {}, kernel=scenes.kernels)


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def mirrored(view, normal):
    return view - 2 * (view * normal).sum(-1, keepdims=True) * normal


def assert_finite(found):
    for name in ("origin", "direction", "normal", "width", "spread"):
        assert np.isfinite(getattr(found, name)).all(), name


@pytest.mark.parametrize("ortho", [None, 2.5])
@pytest.mark.parametrize("centre", [(0, 0, 0), (1000.0, -2000.0, 500.0)])
def test_sphere_against_analytic(renderer, ortho, centre):
    """Direction and normal on a mirror sphere, also far from the world's origin, where eye-relative matrices count."""
    centre = np.array(centre)
    camera = scenes.camera(centre + [1, -5, 2], centre, fov=0.5, ortho=ortho)
    found = renderer(("ball", scenes.sphere_mesh(256, 128), scenes.placed(centre), scenes.MIRROR)).ray_map(camera)
    mask = found.covered()
    assert 800 < mask.sum() < mask.size
    primary = camera.primary_rays()
    view = primary.direction.reshape(*mask.shape, 3)[mask].astype(np.float64)
    # Where the pixel's view ray meets the sphere: the origin of the reflected ray.
    offset = primary.origin.reshape(*mask.shape, 3)[mask].astype(np.float64) - centre
    if ortho is None:
        offset = np.broadcast_to(camera.world_from_camera[:3, 3] - centre, offset.shape)
    along = (offset * view).sum(-1)
    root = along**2 - (offset**2).sum(-1) + 1
    # Away from the silhouette, where a tessellated outline differs and grazing directions are lifted.
    inner = root > 0.05
    point = (offset + view * (-along - np.sqrt(np.maximum(root, 0)))[:, None])[inner]
    rounding = 1e-7 * np.abs(centre).max()
    assert np.abs(found.origin[mask][inner] - centre - point).max() < tolerances.SPHERE_FACETS + rounding
    # The normal of a faceted sphere is exact at the point on the facet, which is on the view ray.
    if np.abs(centre).max() == 0:
        on_facet = unit(found.origin[mask][inner].astype(np.float64))
        assert np.abs(found.normal[mask][inner] - on_facet).max() < tolerances.RAY_MAP
        expected = mirrored(view[inner], on_facet)
        assert np.abs(found.direction[mask][inner] - expected).max() < tolerances.RAY_MAP
    else:
        expected = mirrored(view[inner], point)
        assert np.abs(found.direction[mask][inner] - expected).max() < 10 * tolerances.SPHERE_FACETS


def test_flat_mirror(renderer):
    """A floor: the mirrored camera sees along every ray; footprint and spread are those of the pixel."""
    camera = scenes.camera((0, -3, 2), (0, 0, 0))
    found = renderer(("floor", scenes.quad_mesh(), scenes.placed(scale=10), scenes.MIRROR)).ray_map(camera)
    mask = found.covered()
    mirrored_eye = np.array([0, -3, -2.0])
    assert np.abs(found.direction[mask] - unit(found.origin[mask] - mirrored_eye)).max() < tolerances.RAY_MAP
    assert np.abs(found.origin[mask][:, 2]).max() < 1e-5
    # The centre pixel looks at 3.6 m distance: its width, and its angle (the mean over a 2x2 quad).
    pixel = 2 * np.tan(0.4) / 64
    assert found.width[32, 48] == pytest.approx(pixel * np.sqrt(13), rel=0.02)
    assert found.spread[32, 48] == pytest.approx(pixel, rel=0.05)


def test_orthographic_flat_mirror_does_not_spread(renderer):
    camera = scenes.camera((0, -3, 2), (0, 0, 0), ortho=2.0)
    found = renderer(("floor", scenes.quad_mesh(), scenes.placed(scale=10), scenes.MIRROR)).ray_map(camera)
    assert np.allclose(found.direction, unit(np.array([0, 3.0, 2.0])), atol=1e-6)
    assert np.allclose(found.width, 2.0 / 64) and found.spread.max() < 1e-6


def test_roughness_widens(renderer):
    rough = Material("rough", metallic=1.0, roughness=0.5, is_reflector=True)
    camera = scenes.camera((0, -3, 2), (0, 0, 0), ortho=2.0)
    found = renderer(("floor", scenes.quad_mesh(), scenes.placed(scale=10), rough)).ray_map(camera)
    assert np.allclose(found.spread, 4 * 0.25)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize("where", ["outside", "inside", "edge", "orthographic", "far"])
def test_finite_everywhere(renderer, scale, where):
    eye, target, ortho = {
        "outside": ((3, -4, 2), (0, 0, 0), None),
        "inside": ((0.2, 0.1, 0.3), (1, 0, 0), None),
        "edge": ((1, -1, 0.2), (0, 1, 0), None),  # on a cube edge, looking along faces
        "orthographic": ((0, -5, 0), (0, 0, 0), 3.0),
        "far": ((0, -1e4, 0), (0, 0, 0), None),
    }[where]
    camera = scenes.camera(
        np.array(eye) * scale, np.array(target) * scale, (64, 48),
        fov=3e-4 if where == "far" else 0.8, near=1e-3 * scale, far=1e5 * scale, ortho=ortho and ortho * scale,
    )  # fmt: skip
    for mesh in (scenes.sphere_mesh(), scenes.cube_mesh()):
        found = renderer(("thing", mesh, scenes.placed(scale=scale), scenes.MIRROR)).ray_map(camera)
        assert_finite(found)
        mask = found.covered()
        assert mask.any()
        assert np.allclose(np.linalg.norm(found.direction[mask], axis=-1), 1, atol=1e-5)
        assert np.allclose(np.linalg.norm(found.normal[mask], axis=-1), 1, atol=1e-5)
        # The normal faces the viewer, from inside as well.
        assert ((found.normal * found.direction).sum(-1)[mask] >= -1e-6).all()
        assert (found.width >= 0).all() and (found.spread <= 2.1).all()


def test_camera_inside_a_sphere_sees_its_inner_side(renderer):
    camera = scenes.camera((0, 0, 0), (1, 0.2, 0.1))
    found = renderer(("ball", scenes.sphere_mesh(), scenes.placed(), scenes.MIRROR)).ray_map(camera)
    assert found.covered().all()
    # From the centre every ray goes back.
    assert np.abs(found.direction + unit(found.origin)).max() < 0.01


def test_negative_scale_is_the_mirrored_mesh(renderer):
    camera = scenes.camera((1, -5, 2), (0, 0, 0))
    plain = renderer(("ball", scenes.sphere_mesh(), scenes.placed(), scenes.MIRROR)).ray_map(camera)
    flipped = renderer(("ball", scenes.sphere_mesh(), scenes.placed(scale=(-1, 1, 1)), scenes.MIRROR)).ray_map(camera)
    both = plain.covered() & flipped.covered()
    assert both.sum() > 0.99 * plain.covered().sum()
    assert np.abs(plain.normal - flipped.normal)[both].max() < 1e-4


def test_no_ray_goes_below_the_surface(renderer):
    """Shading normals tilted by 50 degrees on a floor; without normals; with normals that are not finite."""
    floor = scenes.quad_mesh()
    for normal in ((np.sin(0.87), 0, np.cos(0.87)), (0, 0, 0), (np.nan, 0, 1)):
        corner_normals = np.broadcast_to(np.array(normal, np.float32), (2, 3, 3)).copy()
        mesh = type(floor)(floor.positions, floor.triangles, corner_normals, floor.material_index)
        found = renderer(("floor", mesh, scenes.placed(scale=10), scenes.MIRROR)).ray_map(
            scenes.camera((-3, 0, 1), (0, 0, 0))
        )
        assert_finite(found)
        assert (found.direction[found.covered()][:, 2] > 0).all()


def test_what_is_hidden_gets_no_ray(renderer):
    """A matte wall in front of one of two mirrors; ids follow the snapshot's order of reflectors."""
    wall = scenes.placed((-1.5, -2, 0), (1.4, 0.01, 1.4))
    found = renderer(
        ("left", scenes.sphere_mesh(), scenes.placed((-1.5, 0, 0)), scenes.MIRROR),
        ("wall", scenes.cube_mesh(), wall, scenes.MATTE),
        ("right", scenes.sphere_mesh(), scenes.placed((1.5, 0, 0)), scenes.MIRROR),
    ).ray_map(scenes.camera((0, -30, 0), (0, 0, 0), fov=0.2))
    assert found.reflector_names == ("left", "right")
    assert set(np.unique(found.reflector)) == {-1, 1}
    assert (found.origin[found.reflector == 1][:, 0] > 0).all()


def test_materials_split_a_reflector(renderer, device):
    """Only the shiny faces of a cube get rays; a cube marked by hand, without any, gets them all."""
    from dataclasses import replace

    from reflect_addon.gpu.renderer import Renderer

    base = scenes.snapshot(("cube", scenes.cube_mesh(), scenes.placed(), scenes.MIRROR))
    camera = scenes.camera((3, -4, 3), (0, 0, 0))
    everything = Renderer(base, {}).ray_map(camera)
    slots = (1, 1, 1, 1, 0, 1)  # the top is the mirror
    split = replace(
        base, materials=(scenes.MIRROR, scenes.MATTE), instances=(replace(base.instances[0], materials=slots),)
    )
    found = Renderer(split, {}).ray_map(camera)
    top = everything.covered() & (everything.origin[..., 2] > 0.999)
    assert top.sum() > 100 and np.array_equal(found.covered(), top)
    marked = replace(split, instances=(replace(split.instances[0], materials=(1,) * 6),))
    assert np.array_equal(Renderer(marked, {}).ray_map(camera).covered(), everything.covered())
