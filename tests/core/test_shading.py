"""Reflectance against analytic values and against Cycles' Principled node on a smooth sphere under a white world."""

import numpy as np
import pytest
import tolerances

from reflect_addon.core import shading
from reflect_addon.core.kernel import evaluate, record_function
from reflect_addon.core.snapshot import Material


def reflectance_of(material: Material, cosine: np.ndarray):
    """((N, 3) reflectance, (N,) opacity) by the NumPy emitter."""
    options = {"has_metal": material.metallic > 0, "has_dielectric": material.metallic < 1}
    program = record_function(shading.reflectance, shading.REFLECTANCE_INPUTS, options=options)
    count = len(cosine)
    inputs = {
        "cosine": cosine.astype(np.float32),
        "base_color": np.tile(np.float32(material.base_color), (count, 1)),
        "metallic": np.full(count, material.metallic, np.float32),
        "specular_tint": np.tile(np.float32(material.specular_tint), (count, 1)),
        "ior": np.full(count, material.ior, np.float32),
        "weight": np.full(count, material.specular_weight, np.float32),
    }
    found = evaluate(program, inputs)
    return found["reflectance"], found["opacity"]


def test_normal_incidence_and_grazing():
    glass = Material("glass", metallic=0.0, ior=1.5)
    found, _ = reflectance_of(glass, np.array([1.0, 0.0]))
    assert found[0] == pytest.approx(0.04, abs=1e-6) and found[1] == pytest.approx(1.0, abs=1e-6)
    gold = Material("gold", metallic=1.0, base_color=(1.0, 0.7, 0.3), specular_tint=(0.9, 0.8, 0.7))
    found, opacity = reflectance_of(gold, np.array([1.0, 0.0, 1 / 7]))
    assert found[0] == pytest.approx(gold.base_color, abs=1e-6) and found[1] == pytest.approx(1.0, abs=1e-5)
    # The definition of the model: at 82 degrees the tint times Schlick.
    schlick = np.array(gold.base_color) + (1 - np.array(gold.base_color)) * (6 / 7) ** 5
    assert found[2] == pytest.approx(schlick * gold.specular_tint, abs=1e-5)
    assert opacity == pytest.approx(1.0)


def test_brewster_and_total_reflection():
    """At Brewster's angle only the s-polarised half reflects; from the dense side past the critical angle, all."""
    brewster = np.cos(np.arctan(1.5))
    found, _ = reflectance_of(Material("glass", ior=1.5), np.array([brewster]))
    assert found[0, 0] == pytest.approx(0.5 * ((1.5**2 - 1) / (1.5**2 + 1)) ** 2, abs=1e-5)
    found, _ = reflectance_of(Material("inside", ior=1 / 1.5), np.array([0.3]))
    assert found[0, 0] == pytest.approx(1.0, abs=1e-6)


def test_never_out_of_range(rng):
    cosine = np.concatenate([[0, 1, -0.1, 1.1, 1e-8], rng.random(500)])
    for metallic in (0.0, 0.4, 1.0):
        for ior in (0.5, 1.0, 1.45, 4.0):
            material = Material(
                "m", metallic=metallic, ior=ior, base_color=tuple(rng.random(3)), specular_tint=tuple(rng.random(3))
            )
            found, opacity = reflectance_of(material, cosine)
            assert np.isfinite(found).all() and (found >= 0).all() and (found <= 1 + 1e-6).all()
            assert (opacity >= 0).all() and (opacity <= 1 + 1e-6).all()


def test_attenuation_halves():
    program = record_function(shading.attenuation, shading.ATTENUATION_INPUTS)
    found = evaluate(
        program,
        {"distance": np.float32([0, 2, 4, 1e9]), "half_distance": np.full(4, 2, np.float32)},
    )["attenuation"]
    assert found == pytest.approx([1, 0.5, 0.25, 0], abs=1e-6)


CYCLES = [
    Material("chrome", metallic=1.0, base_color=(0.8, 0.8, 0.8)),
    Material("gold", metallic=1.0, base_color=(1.0, 0.6, 0.2), specular_tint=(0.5, 0.7, 1.0)),
    Material("glassy", metallic=0.0, base_color=(0, 0, 0), ior=1.5),
    Material("dense", metallic=0.0, base_color=(0, 0, 0), ior=2.4, specular_tint=(1.0, 0.6, 0.2)),
    Material("mixed", metallic=0.5, base_color=(0, 0, 0), ior=1.5),
]


# Chrome is gold without a tint, glassy dense without one.
PLAIN = ("chrome", "glassy")


@pytest.mark.parametrize("material", [pytest.param(m, marks=pytest.mark.slow if m.name in PLAIN else (), id=m.name) for m in CYCLES])
def test_against_cycles(fresh_file, tmp_path, material):
    """An orthographic look at a smooth black-diffuse sphere: a pixel's radiance is the reflectance at its cosine."""
    bpy = fresh_file
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128, radius=1, location=(0, 0, 0))
    ball = bpy.context.object
    ball.data.shade_smooth()
    made = bpy.data.materials.new("m")
    node = next(n for n in made.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    node.inputs["Base Color"].default_value = (*material.base_color, 1)
    node.inputs["Metallic"].default_value = material.metallic
    node.inputs["Roughness"].default_value = 0.0
    node.inputs["IOR"].default_value = material.ior
    node.inputs["Specular Tint"].default_value = (*material.specular_tint, 1)
    ball.data.materials.append(made)
    world = bpy.data.worlds.new("w")
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    scene.world = world
    lens = bpy.data.cameras.new("c")
    lens.type, lens.ortho_scale = "ORTHO", 2.0
    camera = bpy.data.objects.new("c", lens)
    camera.location = (0, -5, 0)
    camera.rotation_euler = (np.pi / 2, 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 32
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    # Not BOX: Cycles ignores its width, and a pixel's average bends the curve by 0.03 at grazing angles.
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
    size = 64
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(tmp_path / "ball.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(tmp_path / "ball.exr"))
    pixels = np.empty(size * size * 4, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(size, size, 4)[..., :3]
    at = (np.arange(size) + 0.5) / size * 2 - 1
    cosine2 = 1 - at[None, :] ** 2 - at[:, None] ** 2
    inner = cosine2 > 0.02
    cosine = np.sqrt(cosine2[inner])
    expected, _ = reflectance_of(material, cosine)
    error = pixels[inner] - expected
    print(material.name, "max", np.abs(error).max(), "mean", np.abs(error).mean(), "bias", error.mean())
    assert np.abs(error).mean() <= tolerances.REFLECTANCE_MEAN
    # By cosine, so that noise averages out and a wrong curve does not hide.
    for low, high in zip(np.linspace(0.14, 0.9, 6), np.linspace(0.3, 1.0, 6)):
        ring = (cosine >= low) & (cosine < high)
        assert np.abs(error[ring].mean(0)).max() <= tolerances.REFLECTANCE_RING, (low, high)
