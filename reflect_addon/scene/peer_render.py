"""EEVEE's own picture of a frame, for comparison: runs in a process of its own, on a copy of the file that nobody saves.

What is wanted is the radiance that EEVEE reflects, before Fresnel and tint, along the mirror ray of each pixel. EEVEE's
"specular light" pass is that, as long as a surface has one reflecting layer. So materials keep their look, since other
reflectors show them, and lose only what would turn or spread the mirror ray: roughness, anisotropy and normal maps. A
material with several reflecting layers, with refraction or without nodes becomes a white mirror, which `render` tells.

A probe sits at the centre of each of the reflectors named. It acts on that reflector's surroundings (the first one's on the
whole scene) and takes the scene to lie on a sphere that just holds it. Reflectors with a probe are hidden from all probes,
since each would see nothing but itself.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter

import bpy

from .ray_scene import plain_output

ENGINE = "BLENDER_EEVEE"
SPECULAR_LIGHT = "use_pass_glossy_direct"  # EEVEE has one pass for direct and indirect light
# Sockets of shader nodes that turn or spread the mirror ray, and their values without it.
STRAIGHT = {"Roughness": 0.0, "Anisotropic": 0.0, "Anisotropy": 0.0, "Normal": None}
ONE_LAYER = {"BSDF_PRINCIPLED", "BSDF_GLOSSY", "BSDF_METALLIC", "EEVEE_SPECULAR"}
REFRACTS = {"BSDF_GLASS", "BSDF_REFRACTION"}
MARGIN = 1.05  # of an influence or a proxy around what it should hold
NEAREST = 1e-3  # m, from where a probe sees


@dataclass(frozen=True)
class Probe:
    """Where a sphere probe sits, in metres, world."""

    centre: tuple[float, float, float]
    reflector: float  # radius that holds the reflector
    scene: float  # radius that holds the scene


@dataclass(frozen=True)
class Job:
    """Everything that the picture depends on beside the file."""

    scene: str
    camera: str
    frame: int
    size: tuple[int, int]
    samples: int
    probe_side: int  # texels of a probe's cube face, a power of two
    materials: tuple[str, ...]  # the shiny ones
    marked: tuple[str, ...]  # objects that reflect all over although no material of theirs is shiny
    hidden: tuple[str, ...]  # objects that probes do not see
    probes: tuple[Probe, ...]
    settings: tuple[dict, ...]  # {"screen_tracing": bool, "sphere_probe": bool}: one picture each

    def plain(self) -> dict:
        return asdict(self)

    @staticmethod
    def from_plain(values: dict) -> "Job":
        lists = {k: tuple(v) for k, v in values.items() if isinstance(v, list)}
        probes = tuple(Probe(**{**p, "centre": tuple(p["centre"])}) for p in values["probes"])
        return Job(**{**values, **lists, "probes": probes})


def render(job: Job, folder: Path, say: Callable[[float, str], object]) -> dict:
    """Writes folder/picture<k>.exr for each setting; returns {"replaced": material names, "seconds": [...]}.

    Changes the open file at will: call it in a process that ends after it.
    """
    scene = bpy.data.scenes[job.scene]
    scene.frame_set(job.frame)
    scene.camera = bpy.data.objects[job.camera]
    scene.camera.data.dof.use_dof = False
    replaced = straighten(job.materials, job.marked)
    for obj in bpy.data.objects:
        obj.hide_probe_sphere = obj.hide_probe_sphere or obj.name in job.hidden
    probes = [_add_probe(scene, p, everywhere=i == 0) for i, p in enumerate(job.probes)]
    settings(scene, job)
    seconds = []
    for number, setting in enumerate(job.settings):
        say(number / len(job.settings), f"EEVEE draws picture {number + 1} of {len(job.settings)}")
        scene.eevee.use_raytracing = bool(setting["screen_tracing"])
        for probe in probes:
            probe.hide_render = not setting["sphere_probe"]
        scene.render.filepath = str(folder / f"picture{number}.exr")
        start = perf_counter()
        bpy.ops.render.render(write_still=True, scene=scene.name)
        seconds.append(perf_counter() - start)
    return {"replaced": replaced, "seconds": seconds}


def settings(scene: bpy.types.Scene, job: Job) -> None:
    """The best of EEVEE's screen tracing, no filter between the pixel's centre and the file; the rest is the user's."""
    scene.animation_data_clear()
    scene.timeline_markers.clear()  # a marker would bind another camera
    plain_output(scene)
    render, eevee, tracing = scene.render, scene.eevee, scene.eevee.ray_tracing_options
    render.engine = ENGINE
    render.resolution_x, render.resolution_y = job.size
    render.filter_size = 0.0  # all samples through the pixel's centre
    eevee.taa_render_samples, eevee.gi_cubemap_resolution = job.samples, str(job.probe_side)
    eevee.ray_tracing_method, tracing.resolution_scale, tracing.screen_trace_quality = "SCREEN", "1", 1.0
    eevee.clamp_surface_direct = eevee.clamp_surface_indirect = 0.0
    eevee.use_overscan = False
    layer = next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    for world in {scene.world, layer.world_override} - {None}:
        # Else EEVEE cuts the world at this radiance and makes a lamp of the rest, whose image in a mirror is a single pixel
        # a thousand times too bright.
        world.sun_threshold = 0.0
    for other in scene.view_layers:
        other.use = other == layer
    layer.samples = 0
    for name in [p.identifier for p in layer.bl_rna.properties if p.identifier.startswith("use_pass_")]:
        setattr(layer, name, False)
    layer.use_pass_combined = True
    setattr(layer, SPECULAR_LIGHT, True)


def straighten(materials: tuple[str, ...], marked: tuple[str, ...]) -> list[str]:
    """Makes the shiny materials reflect along the mirror ray only; returns the names of those that became white mirrors."""
    replaced = []
    for material in [m for m in bpy.data.materials if m.name in materials]:
        nodes = list(_nodes(material.node_tree))
        shiny = [n for n in nodes if n.type in ONE_LAYER]
        if len(shiny) == 1 and not any(_refracts(n) or _has_coat(n) for n in nodes):
            _straighten_node(shiny[0])
        else:
            replaced.append(material.name)
            _make_mirror(material)
    mirror = None
    for obj in [bpy.data.objects[name] for name in marked]:
        mirror = mirror or _make_mirror(bpy.data.materials.new("Reflect mirror"))
        if not obj.material_slots:
            obj.data.materials.append(mirror)
        for slot in obj.material_slots:
            slot.link, slot.material = "OBJECT", mirror
        replaced.append(f"all of {obj.name}")
    return replaced


def _nodes(tree, depth: int = 0):
    for node in tree.nodes if tree is not None and depth < 16 else ():
        yield node
        if node.type == "GROUP":
            yield from _nodes(node.node_tree, depth + 1)


def _refracts(node) -> bool:
    return node.type in REFRACTS or node.type == "BSDF_PRINCIPLED" and _is_on(node.inputs["Transmission Weight"])


def _has_coat(node) -> bool:
    return node.type == "BSDF_PRINCIPLED" and _is_on(node.inputs["Coat Weight"])


def _is_on(socket) -> bool:
    return socket.is_linked or socket.default_value > 0


def _straighten_node(node) -> None:
    for name, value in STRAIGHT.items():
        socket = node.inputs.get(name)
        for link in list(socket.links) if socket else ():
            node.id_data.links.remove(link)
        if socket and value is not None:
            socket.default_value = value


def _make_mirror(material):
    tree = material.node_tree
    output = tree.get_output_node("EEVEE") or tree.nodes.new("ShaderNodeOutputMaterial")
    node = tree.nodes.new("ShaderNodeBsdfGlossy")
    node.inputs["Color"].default_value, node.inputs["Roughness"].default_value = (1, 1, 1, 1), 0.0
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def _add_probe(scene: bpy.types.Scene, probe: Probe, everywhere: bool) -> bpy.types.Object:
    data = bpy.data.lightprobes.new("Reflect probe", "SPHERE")
    data.influence_type = data.parallax_type = "ELIPSOID"
    data.influence_distance = MARGIN * (probe.scene if everywhere else probe.reflector)
    data.falloff = 0.0
    data.use_custom_parallax, data.parallax_distance = True, MARGIN * probe.scene
    data.clip_start, data.clip_end = NEAREST, 4 * probe.scene
    obj = bpy.data.objects.new("Reflect probe", data)
    obj.location = probe.centre
    scene.collection.objects.link(obj)
    return obj

