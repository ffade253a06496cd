"""scene/reflection_group.py: on a surface that EEVEE draws the group answers the ray that the ray map has there."""

import numpy as np
import pytest
import tolerances_nodes
from baked_methods import bake_all, scene_of_everything
from node_bench import prepare, rendered

from reflect_addon.core import cubemap, methods
from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import evaluate, record, run_numpy
from reflect_addon.core.rays import Hits, Rays
from reflect_addon.core.surface_ray import record_surface
from reflect_addon.scene.camera import camera_of
from reflect_addon.scene.node_report import describe_group, groups_of
from reflect_addon.scene.reflection_group import REFLECTANCE, reflection_group
from reflect_addon.scene.snapshot import take_snapshot

SIDE = 48
ROUGH = 0.4
SHOWN = {"Radiance": 3, "Distance": 1, "Coverage": 1, "Reflectance": 3}


@pytest.fixture
def smooth_world() -> Asset:
    """A cube map whose radiance is a smooth function of the direction, so that a ray's error is its colour's."""
    bundle = cubemap.bundle(np.zeros(3), 32)
    count = len(bundle)
    hits = Hits((1.0 + 0.9 * bundle.direction).astype("f"), 5 * bundle.direction, bundle.direction, np.zeros(count, int), np.ones(count, bool))
    image, uniforms = cubemap.assemble(np.zeros(3), 32, hits)
    return Asset("environment", "", {"radiance_tx": image}, uniforms | {"center": (0.0, 0.0, 0.0)})


@pytest.fixture(scope="module")
def everything_baked():
    return bake_all(scene_of_everything())


def ball_and_camera(bpy, tree, at=(0.0, 0.0, 0.0), **inputs):
    """A coarse smooth ball, so that shading normals are tilted against its triangles and grazing rays are lifted; its material is the group. (scene, a snapshot
    of it as a mirror)."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=1.0, location=at)
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler = (0.0, -3.0, 0.0), (np.pi / 2, 0, 0)
    scene = bpy.context.scene
    scene.collection.objects.link(camera)
    scene.camera = camera
    material = bpy.data.materials.new("native")
    ball.data.materials.append(material)
    nodes = material.node_tree.nodes
    mirror = next(n for n in nodes if n.type == "BSDF_PRINCIPLED")
    mirror.inputs["Metallic"].default_value, mirror.inputs["Roughness"].default_value = 1.0, 0.0
    snapshot = take_snapshot(bpy.context.evaluated_depsgraph_get())
    nodes.clear()
    group, output = nodes.new("ShaderNodeGroup"), nodes.new("ShaderNodeOutputMaterial")
    group.node_tree = tree
    for name, value in inputs.items():
        group.inputs[name].default_value = value
    material.node_tree.links.new(group.outputs["Surface"], output.inputs["Surface"])
    for name in SHOWN:
        aov, store = scene.view_layers[0].aovs.add(), nodes.new("ShaderNodeOutputAOV")
        aov.name = store.aov_name = f"g_{name}"
        aov.type = "COLOR"
        material.node_tree.links.new(group.outputs[name], store.inputs["Color"])
    return scene, snapshot


def picture(bpy, scene, path, engine="BLENDER_EEVEE", samples=1) -> dict[str, np.ndarray]:
    prepare(scene, engine, SIDE, SIDE)
    if samples > 1:  # all over the pixel
        scene.eevee.taa_render_samples, scene.render.filter_size = samples, 1.0
    channels = rendered(bpy, scene, path)
    return {name: np.stack([channels[f"g_{name}.{letter}"] for letter in "RGB"[:size]], -1) for name, size in SHOWN.items()}


@pytest.mark.parametrize("engine", ["BLENDER_EEVEE", "CYCLES"])
def test_a_ball_shows_what_the_ray_map_asks(engine, fresh_file, tmp_path, smooth_world):
    from reflect_addon.scene.raymap_numpy import numpy_ray_map  # needs Blender's mathutils

    tree = reflection_group(smooth_world, "Ball")
    scene, snapshot = ball_and_camera(fresh_file, tree, Metallic=1.0)
    found = picture(fresh_file, scene, tmp_path / "ball.exr", engine)
    rays = numpy_ray_map(snapshot, camera_of(scene, None, SIDE, SIDE))
    mask = (rays.reflector >= 0) & (found["Coverage"][..., 0] > 0)
    assert 0.98 * (rays.reflector >= 0).sum() < mask.sum() and mask.sum() > 300
    asked = Rays(rays.origin[mask], rays.direction[mask])
    wanted = run_numpy(record(methods.get("environment").trace, smooth_world), smooth_world, asked)
    error = np.abs(found["Radiance"][mask] - wanted.radiance).max(-1)
    assert np.mean(error > tolerances_nodes.GROUP_ON_A_BALL) < tolerances_nodes.GROUP_EDGES, np.sort(error)[-20:]
    assert np.all(found["Coverage"][mask] == 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("kind", methods.gathering())
def test_a_reflector_elsewhere_asks_from_where_it_is(kind, fresh_file, tmp_path, everything_baked):
    """As the overlay's rays do: of another size and place than the one that the asset was baked for, whatever the method."""
    from reflect_addon.scene.raymap_numpy import numpy_ray_map  # needs Blender's mathutils

    asset = everything_baked[kind]
    scene, snapshot = ball_and_camera(fresh_file, reflection_group(asset, "Moved", rough=False), (0.1, -0.1, 0.2), Metallic=1.0)
    found = picture(fresh_file, scene, tmp_path / "ball.exr")
    rays = numpy_ray_map(snapshot, camera_of(scene, None, SIDE, SIDE))
    mask = (rays.reflector >= 0) & (found["Coverage"][..., 0] > 0)
    assert mask.sum() > 300
    asked = Rays(rays.origin[mask], rays.direction[mask])
    wanted = run_numpy(record(methods.get(kind).trace, asset), asset, asked).radiance
    error = np.abs(found["Radiance"][mask] - wanted).max(-1)
    assert np.median(error) < tolerances_nodes.GROUP_ON_A_BALL
    assert np.mean(error > tolerances_nodes.GROUP_ON_A_BALL * (1 + wanted.max(-1))) < tolerances_nodes.MOVED_GROUP_EDGES


@pytest.mark.slow
def test_the_samples_of_a_rough_ball_have_the_mean_of_its_lobe(fresh_file, tmp_path, rng):
    """Billboards around the ball, whose outlines no footprint softens: 64 samples a pixel, whole picture against NumPy's draws."""
    from reflect_addon.scene.raymap_numpy import numpy_ray_map  # needs Blender's mathutils

    asset = bake_all(scene_of_everything())["billboards"]
    tree = reflection_group(asset, "Rough")
    assert any(n.bl_idname == "ShaderNodeTexWhiteNoise" for n in tree.nodes)
    assert not any(n.bl_idname == "ShaderNodeTexWhiteNoise" for n in reflection_group(asset, "Smooth", rough=False).nodes)
    scene, snapshot = ball_and_camera(fresh_file, tree, Metallic=1.0, Roughness=ROUGH)
    found = picture(fresh_file, scene, tmp_path / "rough.exr", samples=64)
    rays = numpy_ray_map(snapshot, camera_of(scene, None, SIDE, SIDE))
    mask = (rays.reflector >= 0) & (found["Coverage"][..., 0] == 1)
    count = mask.sum()
    incoming = camera_of(scene, None, SIDE, SIDE).world_from_camera[:3, 3] - rays.origin[mask]
    given = {"position": rays.origin[mask], "incoming": incoming / np.linalg.norm(incoming, axis=1, keepdims=True)}
    given |= {"normal": rays.normal[mask], "smooth_normal": rays.normal[mask], "face_normal": rays.normal[mask]}
    given["roughness"] = np.full(count, ROUGH)
    program = record_surface(methods.get("billboards").trace, asset, "billboards", rough=True)
    drawn = [evaluate(program, given | {"random": rng.random((count, 3))}, asset, ("radiance",))["radiance"] for _ in range(64)]
    wanted = np.mean(drawn, 0)
    assert np.abs(found["Radiance"][mask].mean(0) / wanted.mean(0) - 1).max() < tolerances_nodes.ROUGH_GROUP_MEAN
    spread = np.std(drawn, 0).mean() / 8
    assert np.abs(found["Radiance"][mask] - wanted).mean() < 3 * spread


def test_the_group_says_what_is_in_it(fresh_file, smooth_world):
    """What an artist wires by hand, one group for the reflectance of all, and for Cycles, too, where there are no loops."""
    one, two = (reflection_group(smooth_world, name) for name in ("One", "Two"))
    sockets = [(s.in_out, s.name) for s in one.interface.items_tree]
    assert [n for way, n in sockets if way == "INPUT"] == [
        "Normal", "Roughness", "Base Color", "Metallic", "Specular Tint", "IOR", "Weight",
    ]  # fmt: skip
    assert [n for way, n in sockets if way == "OUTPUT"] == ["Radiance", "Distance", "Coverage", "Reflectance", "Opacity", "Cosine", "Surface"]
    assert [g.name for g in groups_of(one) if g in groups_of(two)] == [REFLECTANCE]
    report = describe_group(one)
    assert report.cycles and len(report.images) == 1
    frames = [n.label for g in groups_of(one) for n in g.nodes if n.bl_idname == "NodeFrame"]
    assert any("no ray into the surface" in label for label in frames) and any("F82" in label for label in frames)
