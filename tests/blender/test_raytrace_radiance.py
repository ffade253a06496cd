"""What trace() and primary() see, against an ordinary Cycles camera and against a mirror that Cycles draws."""

import bpy
import numpy as np
import pytest
from blender_scenes import add_mesh, add_soup, emission, random_matrix, set_world
from mathutils import Euler
from tolerances import EMISSION_RELATIVE

from reflect_addon.core.camera import Camera
from reflect_addon.core.rays import Rays
from reflect_addon.scene.exr import read_exr, stacked
from reflect_addon.scene.raytrace import primary, trace

SIZE = 48


def pixel_camera(scene, size=SIZE):
    """A perspective camera and the same as numbers, worked out by Blender."""
    data = bpy.data.cameras.new("View")
    eye = bpy.data.objects.new("View", data)
    eye.location, eye.rotation_euler = (0, -6, 2), Euler((1.25, 0, 0.05))
    scene.collection.objects.link(eye)
    scene.camera = eye
    scene.render.resolution_x = scene.render.resolution_y = size
    bpy.context.view_layer.update()
    projection = eye.calc_matrix_camera(bpy.context.evaluated_depsgraph_get(), x=size, y=size)
    return Camera(np.array(eye.matrix_world, float), np.array(projection, float), size, size)


def cycles_picture(scene, path, samples=1):
    """The scene's own camera through Cycles, (H, W, 3) linear, bottom row first, rays through the pixel centres."""
    scene.render.engine, scene.cycles.samples = "CYCLES", samples
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01  # BOX would ignore its width
    image = scene.render.image_settings
    image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth, image.exr_codec = "OPEN_EXR_MULTILAYER", "32", "NONE"
    image.use_exr_interleave = True
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True, scene=scene.name)
    return stacked(read_exr(path), "Combined", "RGB")


def glowing_scene(rng):
    scene = bpy.context.scene
    set_world((0.2, 0.4, 0.9), 1.5)
    for k in range(5):
        soup = add_soup(f"Soup {k}", rng, 30, rng.normal(0, 1, 3), 0.7, random_matrix(rng))
        soup.data.materials.append(emission(f"Glow {k}", rng.uniform(0.1, 1, 3), 3))
    return scene


def lit_scene():
    """Diffuse floor and monkey under a world and an area lamp."""
    scene = bpy.context.scene
    set_world((0.4, 0.5, 0.6))
    bpy.ops.mesh.primitive_plane_add(size=20)
    bpy.ops.mesh.primitive_monkey_add(location=(0, 0, 1.2))
    bpy.ops.object.light_add(type="AREA", location=(2, -2, 4))
    bpy.context.object.data.energy = 200
    return scene


def test_a_glowing_scene_is_the_same_picture_through_trace_and_a_camera(fresh_file, rng, tmp_path):
    scene = glowing_scene(rng)
    camera = pixel_camera(scene)
    ours = trace(camera.primary_rays(), as_reflection=False).radiance.reshape(SIZE, SIZE, 3)
    theirs = cycles_picture(scene, tmp_path / "truth.exr")
    same = np.abs(ours - theirs).max(-1) <= EMISSION_RELATIVE * theirs.max(-1)
    assert len(np.unique(theirs.reshape(-1, 3).round(4), axis=0)) >= 6
    # A pixel whose ray meets an edge within rounding may fall to either side.
    assert (~same).mean() < 2e-3, f"{(~same).sum()} pixels differ"


def test_a_lit_scene_is_the_same_picture_within_its_noise(fresh_file, tmp_path):
    scene = lit_scene()
    camera = pixel_camera(scene)
    ours = trace(camera.primary_rays(), samples=64, as_reflection=False).radiance.reshape(SIZE, SIZE, 3)
    again = trace(camera.primary_rays(), samples=64, seed=1, as_reflection=False).radiance.reshape(SIZE, SIZE, 3)
    theirs = cycles_picture(scene, tmp_path / "truth.exr", 64)
    noise = np.sqrt(((ours - again) ** 2).mean())
    assert 0 < noise < 0.1 * ours.mean(), "two seeds must differ, but little"
    assert np.sqrt(((ours - theirs) ** 2).mean()) < 1.3 * noise
    assert abs(ours.mean() - theirs.mean()) < 3 * noise / np.sqrt(ours.size) + 1e-3 * ours.mean()


def test_the_same_seed_gives_the_same_radiance(fresh_file, monkeypatch):
    from reflect_addon.scene import raytrace

    monkeypatch.setattr(raytrace, "PATHS_PER_RENDER", 4 * 500)
    scene = lit_scene()
    rays = pixel_camera(scene).primary_rays()
    first, second = (trace(rays, samples=4, seed=3).radiance for _ in range(2))
    np.testing.assert_array_equal(first, second)
    # And its parts do not repeat one noise: equal rays in two parts get different light.
    same = Rays(np.repeat(rays.origin[700:701], 2000, 0), np.repeat(rays.direction[700:701], 2000, 0))
    radiance = trace(same, samples=4).radiance
    assert np.abs(radiance[:500] - radiance[500:1000]).max() > 0


def test_the_users_view_film_and_border_settings_do_not_matter(fresh_file, rng):
    scene = glowing_scene(rng)
    rays = pixel_camera(scene).primary_rays()
    plain = trace(rays).radiance
    scene.view_settings.exposure, scene.view_settings.view_transform = 3, "AgX"
    scene.cycles.film_exposure, scene.render.film_transparent = 4, True
    scene.render.resolution_percentage, scene.render.use_border, scene.render.border_max_x = 50, True, 0.5
    scene.render.use_motion_blur, scene.cycles.use_denoising, scene.render.use_stamp = True, True, True
    scene.render.pixel_aspect_x, scene.view_layers[0].samples = 2, 1
    np.testing.assert_array_equal(trace(rays).radiance, plain)


def test_the_working_space_does_not_matter(fresh_file, rng):
    scene = glowing_scene(rng)
    rays = pixel_camera(scene).primary_rays()
    plain = trace(rays).radiance
    bpy.ops.wm.set_working_color_space(working_space="ACEScg")
    # Blender rounds the colours it converts to five decimals.
    np.testing.assert_allclose(trace(rays).radiance, plain, atol=5e-4)


def test_hidden_objects_are_seen_through_but_cast_shadows(fresh_file):
    set_world((0, 0, 0))
    bpy.context.scene.cycles.max_bounces = 0
    white = bpy.data.materials.new("White")
    add_mesh("Floor", [(-5, -5, 0), (5, -5, 0), (5, 5, 0), (-5, 5, 0)], [(0, 1, 2, 3)], material=white)
    add_mesh("Lid", [(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)], [(0, 1, 2, 3)], material=white)
    bpy.ops.object.light_add(type="SUN")
    down = np.float32([[0, 0, -1]] * 2)
    rays = Rays(np.float32([[0.1, 0.2, 3], [3, 3, 3]]), down)
    seen, through = trace(rays, samples=4), trace(rays, hide=("Lid",), samples=4)
    names = through.object_names
    assert [names[i] for i in seen.object] == ["Lid", "Floor"]
    assert [names[i] for i in through.object] == ["Floor", "Floor"]
    np.testing.assert_allclose(through.position[:, 2], 0, atol=1e-6)
    assert seen.radiance[0].min() > 0.1
    assert through.radiance[1].min() > 0.1
    assert through.radiance[0].max() == 0, "the lid's shadow went with it"


@pytest.mark.parametrize("case", ["plain", "glossy_off", "camera_off", "lamp", "lamp_without_mis", "world", "holdout"])
def test_rays_see_what_a_mirror_in_cycles_sees(fresh_file, rng, tmp_path, case):
    """The picture in a flat mirror, once reflected by Cycles and once traced by us from the mirror's points."""
    scene = glowing_scene(rng)
    scene.cycles.sample_clamp_indirect = 0  # would clamp what a mirror shows and not what a traced ray sees
    ceiling = add_mesh("Ceiling", [(-40, -9, 5), (0, -9, 5), (0, 90, 5), (-40, 90, 5)], [(0, 1, 2, 3)])
    ceiling.data.materials.append(emission("Light", (0.9, 0.8, 0.1), 2))
    if case == "glossy_off":
        ceiling.visible_glossy = False
    if case == "camera_off":
        ceiling.visible_camera = False
    if case == "holdout":
        ceiling.is_holdout = True
    if case == "world":
        scene.world.cycles_visibility.glossy = False
    if case.startswith("lamp"):
        bpy.ops.object.light_add(type="AREA", location=(9, 16, 4.5))
        bpy.context.object.data.size, bpy.context.object.data.energy = 18, 2000
        bpy.context.object.data.cycles.use_multiple_importance_sampling = case == "lamp"
    mirror = bpy.data.materials.new("Mirror")
    shader = mirror.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (1, 1, 1, 1)
    shader.inputs["Metallic"].default_value, shader.inputs["Roughness"].default_value = 1, 0
    add_mesh("Mirror", [(-9, -9, -2), (9, -9, -2), (9, 9, -2), (-9, 9, -2)], [(0, 1, 2, 3)], material=mirror)
    camera = pixel_camera(scene)
    theirs = cycles_picture(scene, tmp_path / "truth.exr", 16).reshape(-1, 3)
    seen = primary(camera, 1)
    on_mirror = (seen.object == seen.object_names.index("Mirror")).ravel()
    assert on_mirror.sum() > 500
    origin = seen.position.reshape(-1, 3)[on_mirror]
    direction = camera.primary_rays().direction[on_mirror] * np.float32([1, 1, -1])

    def different(**options):
        ours = trace(Rays(origin, direction), hide=("Mirror",), samples=4, **options).radiance
        return (np.abs(ours - theirs[on_mirror]).max(-1) > 0.01 * theirs[on_mirror].max(-1) + 1e-4).mean()

    assert different() < 0.01
    if case not in {"plain", "lamp_without_mis"}:  # without, neither mirrors nor cameras see the lamp itself
        assert different(as_reflection=False) > 0.1, "the case changes nothing that this test could see"


def test_the_users_pixel_filter_does_not_matter(fresh_file, rng):
    scene = glowing_scene(rng)
    rays = pixel_camera(scene).primary_rays()
    plain = trace(rays, samples=8)
    scene.cycles.filter_width, scene.cycles.use_pixel_jitter = 10, True
    again = trace(rays, samples=8)
    np.testing.assert_array_equal(again.radiance, plain.radiance)
    np.testing.assert_array_equal(again.position, plain.position)


def test_primary_splits_off_the_glossy_part(fresh_file):
    scene = lit_scene()
    chrome = bpy.data.materials.new("Chrome")
    shader = chrome.node_tree.nodes["Principled BSDF"]
    shader.inputs["Metallic"].default_value, shader.inputs["Roughness"].default_value = 1, 0.1
    bpy.data.objects["Suzanne"].data.materials.append(chrome)
    dull = bpy.data.materials.new("Dull")
    dull.node_tree.nodes["Principled BSDF"].inputs["Specular IOR Level"].default_value = 0
    bpy.data.objects["Plane"].data.materials.append(dull)
    picture = primary(pixel_camera(scene), 8)
    names = np.array([*picture.object_names, ""])[picture.object]
    monkey, floor, sky = names == "Suzanne", names == "Plane", names == ""
    assert monkey.sum() > 50 and floor.sum() > 50 and sky.sum() > 50
    np.testing.assert_allclose(picture.glossy[monkey], picture.combined[monkey], rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(picture.glossy[floor | sky], 0, atol=1e-6)
    np.testing.assert_allclose(picture.combined[sky], np.tile([0.4, 0.5, 0.6], (sky.sum(), 1)), rtol=1e-5)
