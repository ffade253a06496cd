"""Snapshots against Blender's own evaluated data, against what trace() hits, and with broken input."""

import bpy
import numpy as np
import pytest
from blender_scenes import add_mesh, add_soup, emission, random_matrix, set_world
from mathutils import Matrix

from reflect_addon.core.rays import Rays
from reflect_addon.scene import properties
from reflect_addon.scene.raytrace import trace
from reflect_addon.scene.snapshot import render_visibility, take_snapshot


def snapshot(**options):
    return take_snapshot(bpy.context.evaluated_depsgraph_get(), **options)


def world_area_and_centre(snap, instance):
    """Total area, and area-weighted centre, of an instance's triangles in world space."""
    corners = snap.world_positions(instance)[snap.meshes[instance.mesh].triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    return area.sum(), (corners.mean(1) * area[:, None]).sum(0) / area.sum()


def nodes_with_instances(target):
    """A geometry-nodes modifier's tree that puts `target` on every point and keeps nothing else."""
    tree = bpy.data.node_groups.new("Copies", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    copies, info = tree.nodes.new("GeometryNodeInstanceOnPoints"), tree.nodes.new("GeometryNodeObjectInfo")
    info.inputs["Object"].default_value, info.inputs["As Instance"].default_value = target, True
    tree.links.new(start.outputs[0], copies.inputs["Points"])
    tree.links.new(info.outputs["Geometry"], copies.inputs["Instance"])
    tree.links.new(copies.outputs[0], end.inputs[0])
    return tree


def test_modified_mesh_equals_blenders_evaluated_one(fresh_file, rng):
    bpy.ops.mesh.primitive_monkey_add()
    obj = bpy.context.object
    obj.matrix_world = Matrix(random_matrix(rng).tolist())
    obj.modifiers.new("Subdivide", "SUBSURF").levels = 1
    obj.modifiers.new("Copy", "ARRAY").count = 2
    snap = snapshot()
    (instance,) = snap.instances
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.data
    mesh.calc_loop_triangles()
    world = [evaluated.matrix_world @ v.co for v in mesh.vertices]
    expected = np.array([[world[v] for v in t.vertices] for t in mesh.loop_triangles])
    ours = snap.world_positions(instance)[snap.meshes[instance.mesh].triangles]
    np.testing.assert_allclose(ours, expected, atol=2e-6)
    splits = np.array([[mesh.corner_normals[k].vector for k in t.loops] for t in mesh.loop_triangles])
    np.testing.assert_allclose(snap.meshes[instance.mesh].corner_normals, splits, atol=1e-5)


def test_instances_share_meshes_and_match_what_rays_hit(fresh_file, rng):
    """Every kind of instance: what trace() hits lies on a triangle of the instance of that name."""
    cube = add_mesh("Tri", rng.normal(0, 1, (30, 3)), np.arange(30).reshape(-1, 3))
    inner = bpy.data.collections.new("Inner")
    inner.objects.link(add_mesh("Piece", rng.normal(0, 1, (30, 3)), np.arange(30).reshape(-1, 3)))
    bpy.context.scene.collection.objects.unlink(bpy.data.objects["Piece"])
    for k in range(3):
        empty = bpy.data.objects.new(f"Dupli {k}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", inner
        empty.matrix_world = Matrix(random_matrix(rng, mirrored=k == 1).tolist())
        bpy.context.scene.collection.objects.link(empty)
    points = add_mesh("Points", rng.normal(0, 3, (4, 3)), [])
    points.modifiers.new("Copies", "NODES").node_group = nodes_with_instances(cube)
    bpy.ops.object.text_add(location=(0, 0, 2))
    bpy.context.object.data.extrude = 0.1
    snap = snapshot()
    assert [i.name for i in snap.instances if i.object_name == "Piece"] == ["Piece/1", "Piece/2", "Piece/3"]
    assert len({i.mesh for i in snap.instances if i.object_name == "Piece"}) == 2  # plain and mirrored
    copies = sorted(i.name for i in snap.instances if i.object_name == "Tri")
    assert copies == ["Tri", "Tri/1", "Tri/2", "Tri/3", "Tri/4"]
    assert [i.name for i in snap.instances if i.object_name == "Text"] == ["Text"]
    assert snap.warnings == ("Points is left out: it has no faces.",)

    low, high = snap.bounds()
    origin = rng.uniform(low, high, (3000, 3)).astype(np.float32)
    direction = rng.normal(size=(3000, 3)).astype(np.float32)
    hits = trace(Rays(origin, direction))
    for name in ("Piece", "Tri", "Text"):
        chosen = hits.position[hits.object == hits.object_names.index(name)].astype(float)
        assert len(chosen) >= 5, name
        planes = []
        for instance in (i for i in snap.instances if i.object_name == name):
            corners = snap.world_positions(instance)[snap.meshes[instance.mesh].triangles]
            normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            planes.append((corners[:, 0], normal / np.linalg.norm(normal, axis=1, keepdims=True)))
        first, normal = (np.concatenate(p) for p in zip(*planes))
        distance = np.abs(np.einsum("npk,pk->np", chosen[:, None] - first[None], normal)).min(1)
        assert distance.max() < 1e-5 * snap.diagonal()


@pytest.mark.parametrize("mirrored", [False, True])
def test_front_faces_wind_counter_clockwise_in_world_space(fresh_file, rng, mirrored):
    bpy.ops.mesh.primitive_uv_sphere_add()
    sphere = bpy.context.object
    bpy.ops.object.shade_smooth()
    sphere.matrix_world = Matrix(random_matrix(rng, mirrored).tolist())
    snap = snapshot()
    (instance,) = snap.instances
    mesh, matrix = snap.meshes[instance.mesh], instance.world_from_object
    corners = snap.world_positions(instance)[mesh.triangles]
    wound = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = corners.mean(1) - matrix[:3, 3]
    assert (np.einsum("ij,ij->i", wound, outward) > 0).all()
    normals = mesh.corner_normals @ np.linalg.inv(matrix[:3, :3])  # inverse transpose, as rows
    assert (np.einsum("tki,ti->tk", normals, outward) > 0).all()


def test_curves_texts_surfaces_and_metaballs_come_once(fresh_file):
    bpy.ops.object.text_add()
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.data.bevel_depth = 0.1
    bpy.ops.object.metaball_add(type="BALL")
    bpy.ops.object.metaball_add(type="BALL", location=(1, 0, 0))
    bpy.ops.surface.primitive_nurbs_surface_sphere_add(location=(3, 0, 0))
    bpy.ops.curve.primitive_nurbs_path_add()
    snap = snapshot()
    assert len(snap.instances) == 4 and len({i.name for i in snap.instances}) == 4
    ring = next(i for i in snap.instances if "Circle" in i.name)
    area, centre = world_area_and_centre(snap, ring)
    assert area == pytest.approx(4 * np.pi**2 * 0.1, rel=0.05)  # a torus (the fill cap of a circle is none)
    np.testing.assert_allclose(centre, 0, atol=1e-3)
    assert snap.warnings == ("NurbsPath is left out: it has no faces.",)


def test_visibility_of_renders(fresh_file, rng):
    for name in ("Both", "Only viewport", "Only render", "Eye closed"):
        add_soup(name, rng, 3, np.zeros(3), 1)
    bpy.data.objects["Only viewport"].hide_render = True
    bpy.data.objects["Only render"].hide_viewport = True
    bpy.data.objects["Eye closed"].hide_set(True)
    layer = bpy.context.view_layer

    def names(**options):
        return {i.name for i in snapshot(**options).instances}

    assert names() == {"Both", "Only viewport"}
    assert names(visibility="RENDER") == {"Both"}
    with pytest.raises(KeyError):
        with render_visibility(layer):
            assert names(visibility="RENDER") == {"Both", "Only render", "Eye closed"}
            raise KeyError
    assert names() == {"Both", "Only viewport"}
    assert bpy.data.objects["Eye closed"].hide_get() and bpy.data.objects["Only render"].hide_viewport


def test_reflectors_by_material_and_by_mark(fresh_file, rng):
    properties.register()
    try:
        chrome = bpy.data.materials.new("Chrome")
        shader = chrome.node_tree.nodes["Principled BSDF"]
        shader.inputs["Metallic"].default_value, shader.inputs["Roughness"].default_value = 1, 0.1
        marks = [("a", chrome, "AUTO"), ("b", chrome, "NO"), ("c", None, "AUTO"), ("d", None, "YES")]
        for name, material, mark in marks:
            obj = add_soup(name, rng, 3, np.zeros(3), 1)
            obj.data.materials.append(material)
            obj.reflect_mark = mark
        unused = add_soup("e", rng, 3, np.zeros(3), 1)
        unused.data.materials.append(None)
        unused.data.materials.append(chrome)  # in a slot that no face uses
        snap = snapshot()
        assert {i.name: i.is_reflector for i in snap.instances} == dict(a=True, b=False, c=False, d=True, e=False)
        assert [i.mark for i in snap.instances] == ["AUTO", "NO", "AUTO", "YES", "AUTO"]
    finally:
        properties.unregister()
    assert not hasattr(bpy.types.Object, "reflect_mark")
    assert {i.mark for i in snapshot().instances} == {"AUTO"}


def _build(rng):
    set_world((0.1, 0.2, 0.3))
    add_soup("Soup", rng, 5, np.zeros(3), 1).data.materials.append(emission("Glow", (1, 0, 0)))
    bpy.ops.object.light_add(type="POINT", location=(1, 2, 3))
    bpy.ops.object.camera_add()
    bpy.context.scene.camera = bpy.context.object


CHANGES = {
    "vertex": lambda d: setattr(d.meshes["Soup"].vertices[3], "co", (1, 2, 3)) or d.meshes["Soup"].update(),
    "place": lambda d: setattr(d.objects["Soup"], "location", (0, 0, 1e-4)),
    "material": lambda d: setattr(d.materials["Glow"].node_tree.nodes["Emission"].inputs[1], "default_value", 1.01),
    "lamp power": lambda d: setattr(d.lights[0], "energy", 11),
    "lamp place": lambda d: setattr(d.objects["Point"], "location", (1, 2, 3.01)),
    "world": lambda d: setattr(d.worlds["World"].node_tree.nodes["Background"].inputs[1], "default_value", 2),
    "bounces": lambda d: setattr(d.scenes[0].cycles, "diffuse_bounces", 1),
    "visibility": lambda d: setattr(d.objects["Soup"], "visible_glossy", False),
    "slot": lambda d: setattr(d.objects["Soup"].material_slots[0], "material", None),
}
NOT_CHANGES = {
    "camera": lambda d: setattr(d.objects["Camera"], "location", (5, 5, 5)),
    "selection": lambda d: d.objects["Soup"].select_set(True),
    "editor": lambda d: setattr(d.materials["Glow"].node_tree.nodes["Emission"], "location", (500, 0)),
    "frame": lambda d: d.scenes[0].frame_set(12),
    "exposure": lambda d: setattr(d.scenes[0].view_settings, "exposure", 2),
}


@pytest.mark.parametrize("name", [*CHANGES, *NOT_CHANGES])
def test_the_hash_changes_with_what_is_seen_and_with_nothing_else(fresh_file, rng, name):
    _build(rng)
    before = snapshot().geometry_hash
    assert snapshot().geometry_hash == before
    (CHANGES | NOT_CHANGES)[name](bpy.data)
    bpy.context.view_layer.update()
    assert (snapshot().geometry_hash != before) == (name in CHANGES)


def test_the_hash_outlives_saving_and_loading(fresh_file, rng, tmp_path):
    _build(rng)
    before = snapshot().geometry_hash
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"), copy=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    assert snapshot().geometry_hash == before


def test_the_hash_follows_images_content_not_their_place(fresh_file, rng, tmp_path):
    """A bake works on a copy of the file in another folder, to which Blender rewrites relative paths."""
    _build(rng)
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    file = tmp_path / "a" / "sky.hdr"

    def paint(value):
        image = bpy.data.images.new("Paint", 4, 4, float_buffer=True)
        image.pixels = np.full(64, value, np.float32)
        image.filepath_raw, image.file_format = str(file), "HDR"
        image.save()
        bpy.data.images.remove(image)

    paint(0.5)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a" / "a.blend"))
    tree = bpy.data.worlds["World"].node_tree
    sky = tree.nodes.new("ShaderNodeTexEnvironment")
    sky.image = bpy.data.images.load("//sky.hdr")
    tree.links.new(sky.outputs[0], tree.nodes["Background"].inputs[0])
    here = snapshot().geometry_hash
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "b" / "copy.blend"), copy=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "b" / "copy.blend"))
    assert bpy.data.images["sky.hdr"].filepath != "//sky.hdr"
    assert snapshot().geometry_hash == here
    paint(0.75)
    bpy.context.view_layer.update()
    assert snapshot().geometry_hash != here


def test_impossible_geometry_is_left_out_with_a_warning(fresh_file, rng):
    add_mesh("Nan", [(0, 0, 0), (1, 0, 0), (np.nan, 1, 0), (0, 0, 5)], [(0, 1, 2), (0, 1, 3)])
    add_mesh("Line", [(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)])
    add_mesh("Vast", np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)]) * 3e38, [(0, 1, 2)])
    add_mesh("Flat", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], np.diag([1, 0, 1, 1]))
    add_mesh("Bare", [(0, 0, 0), (1, 0, 0)], [])
    snap = snapshot()
    assert [i.name for i in snap.instances] == ["Nan"]
    assert snap.meshes[snap.instances[0].mesh].triangles.shape == (1, 3)
    assert np.isfinite(snap.bounds()).all()
    for name, words in dict(Nan="not finite", Line="no area", Vast="beyond", Flat="scale", Bare="no faces").items():
        assert any(name in w and words in w for w in snap.warnings), (name, snap.warnings)


def test_broken_models_never_crash_and_stay_finite(fresh_file, shared):
    importers = {
        ".obj": bpy.ops.wm.obj_import, ".stl": bpy.ops.wm.stl_import, ".ply": bpy.ops.wm.ply_import,
        ".glb": bpy.ops.import_scene.gltf, ".blend": bpy.ops.wm.open_mainfile,
    }  # fmt: skip
    files = sorted((shared / "models" / "broken").iterdir())
    assert len(files) >= 10
    for path in files:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        importers[path.suffix](filepath=str(path))
        snap = snapshot()
        for mesh in snap.meshes:
            assert np.isfinite(mesh.positions).all() and np.isfinite(mesh.corner_normals).all(), path
            assert mesh.triangles.max() < len(mesh.positions)
        assert np.isfinite(snap.diagonal()), path
        assert snap.instances or snap.warnings, path
