"""A reflector's reflections as one shader node group, for EEVEE and Cycles: what a material, or an artist by hand, plugs in.

Problem. The overlay answers reflected rays while the add-on draws; a material must do it by itself.
Idea. The method's own kernel, asked with the mirror ray of the shaded point (core/surface_ray.py), and the reflectance that the overlay's resolve
pass uses (core/shading.py), both emitted as nodes (kernel_nodes.py).
Group: inputs Normal (nothing plugged in: the surface's own), Roughness, Base Color, Metallic, Specular Tint, IOR, Weight; outputs Radiance (what the mirror ray
brings), Distance (m), Coverage (0..1), Reflectance, Opacity (share of the surface's own light that the reflection replaces), Cosine (of the
mirror ray, for other reflectances) and Surface (Radiance times Reflectance times Coverage, as light).
"""

from collections.abc import Callable, Mapping

import bpy

from ..core import methods, shading
from ..core.asset import Asset
from ..core.kernel import record_function
from ..core.kernel.schedule import schedule
from ..core.surface_ray import record_surface
from .kernel_nodes import Alike, emit_nodes
from .node_tree import TreeBuilder

REFLECTANCE = "Reflect Reflectance"
# Outputs of the nested group that traces; nobody asks for the position but who judges it (native_draw.py), and what nobody asks is not compiled.
ANSWER = ("radiance", "distance", "coverage", "cosine", "position")
# Of the inputs that reflectance takes: name, type of socket, default (Principled's).
SURFACE = (
    ("Base Color", "Color", (0.8, 0.8, 0.8, 1.0)),
    ("Metallic", "Float", 0.0),
    ("Specular Tint", "Color", (1.0, 1.0, 1.0, 1.0)),
    ("IOR", "Float", 1.5),
    ("Weight", "Float", 1.0),
)


def reflection_group(
    asset: Asset, name: str, rough: bool = True, driven: Mapping[str, bpy.types.NodeTree] | None = None, alike: Alike | None = None,
    begun: Callable[[], object] = lambda: None,
) -> bpy.types.NodeTree:  # fmt: skip
    """A new node group that answers from the asset. Its nested groups are 'NAME Trace' and the shared REFLECTANCE.

    rough: the material may be rough: where stand-ins have outlines each sample sends one ray of the lobe. False costs less.
    driven: what says uniforms of the asset from frame to frame (native_follow.py). alike, begun: emit_nodes'."""
    program = record_surface(methods.get(asset.kind).trace, asset, asset.kind, rough)
    # What has no loop is small enough for both sides of its branches, and then Cycles can run it, too.
    trace = emit_nodes(program, asset, f"{name} Trace", ANSWER, not schedule(program, ANSWER).has_loops, driven, alike, begun)
    build = TreeBuilder(name)
    build.socket("Normal", "Vector", is_output=False)
    build.socket("Roughness", "Float", is_output=False)
    for label, kind, value in SURFACE:
        build.socket(label, kind, is_output=False, default=value)
    for label, kind in (("Radiance", "Color"), ("Distance", "Float"), ("Coverage", "Float"), ("Reflectance", "Color"), ("Opacity", "Float"), ("Cosine", "Float")):
        build.socket(label, kind, is_output=True)
    build.socket("Surface", "Shader", is_output=True)
    given = {s.name: s for s in build.inputs.outputs}
    place = build.finish(build.node("ShaderNodeNewGeometry"))
    seen = {s.name: s for s in place.outputs}
    ray = [seen["Position"], seen["Incoming"], given["Normal"], seen["Normal"], seen["True Normal"], given["Roughness"]]
    if "random" in program.inputs:
        # Of the position's bits: a renderer moves its samples within the pixel, so each has other numbers.
        noise = build.node("ShaderNodeTexWhiteNoise", "one ray of the lobe a sample", noise_dimensions="3D")
        build.plug(noise.inputs["Vector"], seen["Position"])
        ray.append(build.finish(noise).outputs["Color"])
    answer = build.group(trace, *ray)
    radiance, distance, coverage, cosine = answer[: ANSWER.index("position")]
    share = build.group(reflectance_group(), cosine, *(given[label] for label, _, _ in SURFACE))
    covered = build.vector("SCALE", share["Reflectance"], coverage)
    light = build.node("ShaderNodeEmission")
    build.plug(light.inputs["Color"], build.vector("MULTIPLY", radiance, covered))
    build.finish(light)
    build.results(radiance, distance, coverage, share["Reflectance"], share["Opacity"], cosine, light.outputs[0])
    return build.tree


def reflectance_group() -> bpy.types.NodeTree:
    """The file's REFLECTANCE group (cosine and SURFACE in, Reflectance and Opacity out), made once."""
    if (found := bpy.data.node_groups.get(REFLECTANCE)) is not None and found.library is None:
        return found
    options = {"has_metal": True, "has_dielectric": True}
    program = record_function(shading.reflectance, shading.REFLECTANCE_INPUTS, options=options)
    return emit_nodes(program, Asset("", "", {}), REFLECTANCE, ("reflectance", "opacity"), unrolled=True)
