"""The sample scenes: the committed files are what their scripts build, small, and what they claim."""

import importlib
import math
from pathlib import Path

import numpy as np
import pytest
import scenes
import tolerances

from sample_blends.describe import describe
from sample_blends.teapot_data import patches, tessellate

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "sample_blends"
NAMES = ("teapots", "columns", "contact", "kitchen")
MIRRORS = {"teapots": 4, "columns": 1, "contact": 1, "kitchen": 12}  # fewest perfect or nearly perfect metal objects


def open_sample(bpy, name):
    bpy.ops.wm.open_mainfile(filepath=str(SAMPLES / f"{name}.blend"))
    return bpy.context.scene


@pytest.mark.parametrize("name", NAMES)
def test_the_script_builds_the_committed_file(fresh_file, name):
    committed = describe(open_sample(fresh_file, name))
    importlib.import_module(f"sample_blends.build_{name}").build()
    fresh_file.context.view_layer.update()
    built = describe(fresh_file.context.scene)
    for part in built:
        assert built[part] == committed[part], (
            f"{name}.blend: {part} differ; run ./dev python sample_blends/build_all.py {name}"
        )


@pytest.mark.parametrize("name", NAMES)
def test_files_are_small_and_need_no_other_file(fresh_file, name):
    assert (SAMPLES / f"{name}.blend").stat().st_size < 300_000
    open_sample(fresh_file, name)
    outside = [
        image.name
        for image in fresh_file.data.images
        if image.users and image.source == "FILE" and not image.packed_file
    ]
    assert outside == [] and len(fresh_file.data.libraries) == 0


@pytest.mark.parametrize("name", NAMES)
def test_every_sample_has_mirrors_and_a_camera(fresh_file, name):
    scene = open_sample(fresh_file, name)
    assert scene.camera is not None
    mirrors = 0
    for made in scene.objects:
        for slot in made.material_slots:
            inputs = slot.material.node_tree.nodes["Principled BSDF"].inputs
            mirrors += inputs["Metallic"].default_value == 1.0 and inputs["Roughness"].default_value <= 0.25
    assert mirrors >= MIRRORS[name]


@pytest.mark.parametrize("name", NAMES)
def test_every_script_states_a_claim(name):
    assert "Claim:" in importlib.import_module(f"sample_blends.build_{name}").__doc__


def test_the_mirror_sphere_moves_through_the_columns(fresh_file):
    """In the room and clear of every column at each frame, so that its picture is never a hole."""
    scene = open_sample(fresh_file, "columns")
    ball = scene.objects["Mirror sphere"]
    columns = [made for made in scene.objects if made.name.startswith("Column")]
    places = []
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        place = np.array(ball.matrix_world.translation)
        places.append(place)
        assert place[2] >= 0.55
        for column in columns:
            assert math.dist(place[:2], column.location[:2]) > 0.55 + 0.24, (frame, column.name)
    assert scene.frame_end == 60 and np.ptp(places, axis=0)[0] > 1.0


def test_the_two_suzannes_cut_into_each_other(fresh_file):
    from mathutils.bvhtree import BVHTree

    scene = open_sample(fresh_file, "contact")
    depsgraph = fresh_file.context.evaluated_depsgraph_get()
    trees = []
    for name in ("Suzanne mirror", "Suzanne matt"):
        made = scene.objects[name].evaluated_get(depsgraph)
        mesh = made.to_mesh()
        points = [made.matrix_world @ vertex.co for vertex in mesh.vertices]
        trees.append(BVHTree.FromPolygons(points, [tuple(face.vertices) for face in mesh.polygons]))
    assert len(trees[0].overlap(trees[1])) > 20


def test_teapot_is_newells():
    """32 patches; known corners: rim, lid tip, spout and handle; closed where the original is."""
    grid = patches()
    assert grid.shape == (32, 4, 4, 3)
    vertices, faces = tessellate(8)
    assert np.allclose(vertices.max(axis=0)[1:], (2.0, 3.15)) and np.allclose(vertices.min(axis=0), (-3.0, -2.0, 0.0))
    tip = np.flatnonzero(np.linalg.norm(vertices - (0, 0, 3.15), axis=1) < 1e-9)
    assert len(tip) == 1, "the lid's tip is one vertex"
    assert sum(tip[0] in face for face in faces) == 4 * 8


def test_teapot_faces_have_area_and_face_outwards():
    vertices, faces = tessellate(8)
    triangles = np.array([(face[0], face[i], face[i + 1]) for face in faces for i in range(1, len(face) - 1)])
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    assert np.linalg.norm(normals, axis=1).min() / 2 > tolerances.TEAPOT_TRIANGLE_AREA
    # An edge used twice in the same direction means two neighbours that disagree about outside.
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    _, uses = np.unique(edges, axis=0, return_counts=True)
    assert uses.max() == 1
    # The divergence theorem: a surface that faces outwards encloses a positive volume.
    assert (np.einsum("ij,ij->i", a, normals).sum() / 6) > 20


def test_teapot_lies_on_the_model_others_use(shared):
    from mathutils import Vector
    from mathutils.bvhtree import BVHTree

    lines = (shared / "models" / "teapot.obj").read_text().splitlines()
    points = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], float)
    points = np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1)  # its y is up
    vertices, faces = tessellate(16)
    tree = BVHTree.FromPolygons([tuple(vertex) for vertex in vertices], faces)
    away = np.array([tree.find_nearest(Vector(point))[3] for point in points])
    assert away.max() < tolerances.TEAPOT_DISTANCE


def test_fixture_room_is_closed_and_faces_inwards(fresh_file):
    made = scenes.sphere_in_box_room()
    middle = (made["box_min"] + made["box_max"]) / 2
    for wall in made["walls"]:
        (face,) = wall.data.polygons
        assert np.dot(middle - np.array(face.center), face.normal) > 0, wall.name
    total = sum(wall.data.polygons[0].area for wall in made["walls"])
    x, y, z = made["box_max"] - made["box_min"]
    assert total == pytest.approx(2 * (x * y + y * z + z * x))


def test_fixture_pictures_face_the_mirror(fresh_file):
    made = scenes.pictures_around_mirror(7)
    fresh_file.context.view_layer.update()
    assert len(made["pictures"]) == 7
    for picture in made["pictures"]:
        towards = -np.array(picture.location)
        normal = np.array(picture.matrix_world.to_3x3() @ picture.data.polygons[0].normal)
        assert normal[:2] @ towards[:2] / np.linalg.norm(towards[:2]) == pytest.approx(1.0, abs=1e-5)
