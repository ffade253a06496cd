"""The light probes of EEVEE's own pictures, set up as its manual says.

Sphere probes see what reflectors mirror: one at the centre of each reflector named, whose parallax is a sphere that holds the scene, and in a
room one in the room's middle whose parallax is the room's box. Plane probes draw what planar mirrors show. In a room a volume probe over the
scene carries light that arrives by way of other surfaces: without one a sphere probe sees only what lamps and world light directly, and in
`columns`, whose lamps face down, its ceiling was black. In open scenes it darkens what the other probes bring (docs/decisions.md), and there is none.
"""

import bpy
from mathutils import Matrix

from ..core.errors import ReflectError
from .eevee_job import Probe

MARGIN = 1.05  # of an influence or a proxy around what it should hold
NEAREST = 1e-3  # m, from where a sphere probe sees
# Of the volume probe: cells a side (Blender's default is 4), rays a cell (2048), and the most surface samples along the scene's longest side. In
# `columns`, 6 m wide, the ceiling had 22 % of Cycles' radiance by 6 cells and 6 samples a metre, 34 % by Blender's 20 a metre, and 53 % by 12 cells
# as well, in three times as long.
CELLS, RAYS, ALONG = 12, 256, 120
DENSEST = 20  # surface samples a metre, Blender's default


def add_probe(scene: bpy.types.Scene, probe: Probe) -> bpy.types.Object:
    data = bpy.data.lightprobes.new("Reflect probe", "PLANE" if probe.kind == "PLANE" else "SPHERE")
    scale = probe.half
    if probe.kind == "PLANE":
        data.influence_distance = probe.influence
        data.clip_start = NEAREST
        scale = (*probe.half[:2], 1.0)
    else:
        box = probe.kind == "BOX"
        data.influence_type = data.parallax_type = "BOX" if box else "ELIPSOID"
        data.influence_distance = MARGIN if box else MARGIN * probe.influence
        data.use_custom_parallax, data.parallax_distance = True, 1.0 if box else MARGIN * probe.reach
        data.falloff = 0.0
        data.clip_start, data.clip_end = NEAREST, 4 * probe.reach
    axes = Matrix(probe.axes).transposed().to_4x4()
    return _placed(scene, data, Matrix.Translation(probe.centre) @ axes @ Matrix.Diagonal((*scale, 1.0)))


def add_volume(scene: bpy.types.Scene, low, high) -> None:
    """Bakes a volume probe over the box."""
    data = bpy.data.lightprobes.new("Reflect volume", "VOLUME")
    sides = [max(h - lo, 1e-3) for lo, h in zip(low, high, strict=True)]
    data.resolution_x = data.resolution_y = data.resolution_z = CELLS
    data.bake_samples, data.capture_distance = RAYS, 2 * sum(sides)
    data.surfel_density = int(min(max(ALONG / max(sides), 1), DENSEST))
    data.capture_world = True
    middle = [(lo + h) / 2 for lo, h in zip(low, high, strict=True)]
    obj = _placed(scene, data, Matrix.Translation(middle) @ Matrix.Diagonal((*(MARGIN * side / 2 for side in sides), 1.0)))
    view = next(layer for layer in scene.view_layers if layer.use)
    with bpy.context.temp_override(scene=scene, view_layer=view, active_object=obj, object=obj, selected_objects=[obj]):
        if bpy.ops.object.lightprobe_cache_bake(subset="ALL") != {"FINISHED"}:
            raise ReflectError("EEVEE did not bake its volume probe.", "Leave eevee out of the methods.")


def _placed(scene: bpy.types.Scene, data, matrix: Matrix) -> bpy.types.Object:
    obj = bpy.data.objects.new(data.name, data)
    obj.matrix_world = matrix
    scene.collection.objects.link(obj)
    return obj
