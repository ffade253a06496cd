"""gpu/capture.py: the GPU's picture of surfaces with known radiance against Embree, and billboards' texels against traced
ones."""

from dataclasses import replace

import hand_scenes
import numpy as np
import pytest
import tolerances
import trimesh
from analytic import rotation, smooth
from mesh_scenes import first_hits, job, snapshot, tracer, world_mesh

from reflect_addon.core import surface_radiance
from reflect_addon.core.billboard_atlas import moved_row, pack, placed_of, table_row
from reflect_addon.core.billboard_capture import capture as traced_capture
from reflect_addon.core.billboard_fit import flat_quads, volume_quad
from reflect_addon.core.capture_camera import quad_camera
from reflect_addon.core.surface_asset import meshes_of

SURFACES = {**surface_radiance.DEFAULTS, "surface_samples": 1, "surface_tolerance": 0.02}
BALL = trimesh.creation.icosphere(3, 0.5).apply_translation([0.2, 0.1, 0.3])
PAINT = lambda position, owner: smooth(position) * 2.0  # noqa: E731


def turned(shape, rng, at=(1.8, 0.4, 0.2)):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation(rng), at
    return shape.apply_transform(matrix)


@pytest.fixture
def gpu_capture(device):
    """draw(scene, names, camera) -> (Captured, target, counts): surfaces baked with PAINT, from a camera."""
    from reflect_addon.gpu.capture import Capture, CaptureTarget, SurfaceBuffer
    from reflect_addon.gpu.counts import Counts
    from reflect_addon.gpu.state import drawing_state

    def draw(scene, names, camera, room=(0, 0)):
        counts = Counts()
        chosen = tuple(scene.named()[n] for n in names)
        meshes = meshes_of(surface_radiance.bake(scene, tracer(scene, PAINT), chosen, SURFACES))
        target = CaptureTarget(camera.width + room[0], camera.height + room[1], counts)
        with drawing_state():
            things = [(SurfaceBuffer(meshes[i.name], counts), i.world_from_object) for i in chosen]
            Capture(counts).draw(things, camera, target)
        return target.read(camera, counts), target, counts

    return draw


@pytest.mark.parametrize("ortho", [None, 2.5])
@pytest.mark.parametrize("away", [0.0, 1000.0])
def test_any_camera_sees_what_embree_sees(gpu_capture, rng, ortho, away):
    shape = turned(trimesh.creation.torus(0.6, 0.25), rng).apply_translation([away, 0, 0])
    scene = snapshot(BALL, Thing=shape)
    camera = hand_scenes.camera((away - 1, -3, 1), (away + 1.8, 0.4, 0.2), (64, 48), near=0.5, far=20, ortho=ortho)
    found, _, counts = gpu_capture(scene, ["Thing"], camera, room=(7, 3))
    rays = camera.primary_rays()
    mesh = world_mesh(scene, scene.instances[1])
    origin = np.asarray(rays.origin, np.float64)
    triangle, distance = first_hits(mesh, origin, rays.direction)
    met, seen = np.isfinite(distance), found.color[..., 3].ravel() == 1
    assert np.array_equal(found.color[..., 3], found.color[..., 3].round()) and counts.draws == 1
    assert np.mean(met != seen) < tolerances.CAPTURE_CONTOUR and 200 < met.sum() < 2500
    both = met & seen
    position = origin[both] + distance[both, None] * rays.direction[both]
    depth = (position - camera.world_from_camera[:3, 3]) @ -camera.world_from_camera[:3, 2]
    step = 1e-6 * (1 + away)  # the rays of the camera are float32
    np.testing.assert_allclose(found.depth.ravel()[both], depth, atol=20 * step)
    normal = np.array(scene.meshes[1].corner_normals[:, 0])[triangle[both]]
    other = np.abs(found.normal.reshape(-1, 3)[both] - normal).max(1) > 1e-4  # the facet beside: a pixel on their edge
    assert np.mean(other) < tolerances.CAPTURE_CONTOUR
    colour, truth = found.color.reshape(-1, 4)[both, :3], 2.0 * smooth(position)
    assert np.quantile(np.abs(colour - truth).max(1) / truth.max(1), 0.95) < 2 * SURFACES["surface_tolerance"]
    assert not found.color.reshape(-1, 4)[~seen].any() and not found.normal.reshape(-1, 3)[~seen].any()


def shapes(rng):
    return {
        "torus": turned(trimesh.creation.torus(0.4, 0.15), rng),
        "rock": turned(trimesh.creation.icosphere(3, 0.4), rng),
        "cone": turned(trimesh.creation.cone(0.3, 0.9, sections=64), rng),
        "cup": turned(trimesh.Trimesh(*(lambda m: (m.vertices, m.faces[m.face_normals[:, 2] < 0.9]))(
            trimesh.creation.cylinder(0.3, 0.6, sections=128)), process=False), rng),
    }  # fmt: skip


@pytest.mark.parametrize("name", ["torus", "rock", "cone", "cup"])
def test_a_volume_is_captured_as_it_is_traced(gpu_capture, rng, name):
    """Texels of billboard_capture (Embree, exact paint) against the GPU's: contour within a texel, radiance within what
    the surface was refined to."""
    scene = snapshot(BALL, Thing=shapes(rng)[name])
    settings = {"texels": 64, "samples": 1}
    work = job(scene, settings, paint=PAINT)
    quad = volume_quad(scene, scene.instances[1], work.center())
    traced = traced_capture(work, [quad])[0].radiance
    height, width = traced.shape[:2]
    points = scene.world_positions(scene.instances[1])
    found, _, _ = gpu_capture(scene, ["Thing"], quad_camera(quad, width, height, points))
    assert_same_texels(found.color, traced)


def assert_same_texels(found, traced):
    solid, wanted = found[..., 3] == 1, traced[..., 3] == 1
    odd = solid != wanted
    # Rounding alone: where they differ the contour passes, and few do.
    grown, shrunk = _dilated(wanted), ~_dilated(~wanted)
    assert not (odd & ~(grown & ~shrunk)).any() and odd.sum() <= tolerances.CAPTURE_CONTOUR * wanted.size
    both = solid & wanted
    off = np.abs(found[both, :3] - traced[both, :3]).max(1) / traced[both, :3].max(1)
    assert both.sum() > 100 and np.median(off) < tolerances.CAPTURE_RADIANCE[0]
    assert np.quantile(off, 0.95) < tolerances.CAPTURE_RADIANCE[1]


def _dilated(mask):
    padded = np.pad(mask, 1)
    h, w = mask.shape
    return np.any([padded[y : y + h, x : x + w] for y in range(3) for x in range(3)], axis=0)


def test_flat_quads_are_captured_along_their_normal(gpu_capture, rng):
    """An open lid: two sides, a contour, no eye."""
    disc = turned(trimesh.Trimesh(*(lambda m: (m.vertices, m.faces[m.face_normals[:, 2] > 0.9]))(
        trimesh.creation.cylinder(0.6, 0.2, sections=64)), process=False), rng)  # fmt: skip
    scene = snapshot(BALL, Thing=disc)
    quads, whole = flat_quads(scene, scene.instances[1])
    assert whole and len(quads) == 2
    for quad in quads:
        traced = traced_capture(job(scene, {"texels": 32, "samples": 1}, paint=PAINT), [quad])[0].radiance
        height, width = traced.shape[:2]
        camera = quad_camera(quad, width, height, scene.world_positions(scene.instances[1]))
        assert camera.is_orthographic
        found, _, _ = gpu_capture(scene, ["Thing"], camera)
        assert_same_texels(found.color, traced)
        assert np.allclose(found.normal[found.color[..., 3] == 1], quad.normal, atol=1e-4)


def test_blocks_are_the_packers(gpu_capture, device, rng):
    """Every texel of the block, borders and coarser levels, and no other texel of the atlas."""
    from reflect_addon.gpu.capture import AtlasBlock
    from reflect_addon.gpu.counts import Counts
    from reflect_addon.gpu.state import drawing_state
    from reflect_addon.gpu.upload import read_texture, texture_from

    scene = snapshot(BALL, Thing=shapes(rng)["torus"])
    images = [rng.random(size + (4,)).astype("f") for size in ((16, 16), (64, 32), (4, 64), (8, 8))]
    atlas, placed = pack(images)
    quad = volume_quad(scene, scene.instances[1], np.zeros(3))
    counts = Counts()
    for index, where in enumerate(placed):
        camera = quad_camera(quad, where.width, where.height, scene.world_positions(scene.instances[1]))
        found, target, _ = gpu_capture(scene, ["Thing"], camera, room=(5, 9))
        texture = texture_from("atlas_tx", atlas, counts)
        with drawing_state():
            AtlasBlock(texture, counts).fill(target.color_tx, where, 4.0)
        scaled = found.color / np.array([4, 4, 4, 1], "f")
        wanted, same = pack([scaled if k == index else image for k, image in enumerate(images)])
        assert same == placed
        np.testing.assert_allclose(read_texture(texture, counts), wanted, rtol=2 * tolerances.HALF, atol=1e-6)  # cut, not rounded


def test_mirrored_instances_keep_their_outside(gpu_capture, rng):
    """Blender's negative scale: the snapshot turns the triangles, and the matrix turns them back."""
    scene = snapshot(BALL, Thing=trimesh.creation.icosphere(3, 0.5))
    mesh = scene.meshes[1]
    turned_mesh = replace(mesh, triangles=mesh.triangles[:, ::-1].copy(), corner_normals=mesh.corner_normals[:, ::-1].copy())
    matrix = np.diag([-1.0, 1.0, 1.0, 1.0])
    matrix[:3, 3] = 2, 0, 0
    scene = replace(
        scene, meshes=(scene.meshes[0], turned_mesh), instances=(scene.instances[0], replace(scene.instances[1], world_from_object=matrix))
    )
    camera = hand_scenes.camera((2, -3, 0), (2, 0, 0), (32, 32), near=0.5, far=20)
    found, _, _ = gpu_capture(scene, ["Thing"], camera)
    seen = found.color[..., 3] == 1
    assert 110 < seen.sum() < 140 and found.depth[16, 16] == pytest.approx(2.5, abs=0.01)
    assert (found.normal[seen] @ [0, -1, 0] > 0).all()


def test_rows_move_as_their_quads_do(rng):
    """moved_row against the row of the quad moved by hand, far from the world's origin too."""
    for away in (0.0, 500.0):
        scene = snapshot(BALL, Thing=shapes(rng)["torus"].apply_translation([away, 0, 0]))
        quad = volume_quad(scene, scene.instances[1], np.array([away, 0, 0]))
        where, center = pack([np.zeros((8, 16, 4), "f")])[1][0], (away, 0.5, 0.0)
        motion = np.eye(4)
        motion[:3, :3], scale = rotation(rng), 1.7
        motion[:3, 3] = np.array([away, 0, 0]) - scale * motion[:3, :3] @ [away, 0, 0] + rng.normal(size=3)
        turn = motion[:3, :3].copy()
        motion[:3, :3] *= scale
        after = replace(
            quad, center=tuple(motion[:3, :3] @ quad.center + motion[:3, 3]), half_u=quad.half_u * scale, half_v=quad.half_v * scale,
            **{k: tuple(turn @ getattr(quad, k)) for k in ("u", "v", "normal")},
        )  # fmt: skip
        row = moved_row(table_row(quad, where, False, center), motion, center)
        np.testing.assert_allclose(row, table_row(after, where, False, center), rtol=1e-5, atol=2e-5)
        assert placed_of(row) == where
