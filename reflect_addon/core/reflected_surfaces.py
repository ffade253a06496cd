"""Whose surfaces are drawn by methods that draw the reflected scene (SURFACES): all that mirrors show, reflectors themselves as well."""

from .asset import Part
from .remake import part_of
from .scene_items import DRAWN, PRESENT, SHAPE, Items, shape_hash
from .snapshot import Instance, SceneSnapshot

# Of surface_radiance.py: as fine as the reflectors see them, cut along steps, and as free of noise as the eye asks. The same for all such methods,
# which share one asset. FLIP of one planar mirror (evaluation/bench_nielsen_planar.py) is 0.044; 0.091 with 16 samples and a tolerance of 0.1
# uncalmed, 0.057 uncalmed alone, 0.068 with a tolerance of 0.1 alone.
SETTINGS = {
    "surface_angle": 0.03, "surface_cuts": 4, "surface_levels": 8, "surface_triangles": 300_000, "surface_samples": 64,
    "surface_tolerance": 0.05, "surface_noise": 0.06,
}  # fmt: skip


def parts(scene: SceneSnapshot) -> tuple[Part, ...]:
    """The parts of an asset that say whose surface radiance is baked with it."""
    return tuple(part_of(scene, instance, "surface", row) for row, instance in enumerate(_seen(scene)))


def inputs_of(scene: SceneSnapshot, reflectors: tuple[Instance, ...]) -> Items:
    """What an asset depends on that holds the reflectors' shapes and whose surfaces are drawn, and nothing else."""
    return {SHAPE: {r.name: shape_hash(scene, r) for r in reflectors}, DRAWN: {i.name: PRESENT for i in _seen(scene)}}


def _seen(scene: SceneSnapshot) -> list[Instance]:
    return [i for i in (*scene.instances, *scene.lamps) if i.visible_glossy]
