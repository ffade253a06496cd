"""Which objects are mirrors to other mirrors [popescu-2006 section 3: "the reflection of an object that happens to be a
reflector"], and how many second-order reflections a scene so has: R (R - 1) for R of them.

An object is one when it is a reflector (by its materials or marked by hand) and one of the materials that it shows has
a mirror-like lobe. A mark alone makes no mirror: what a dull surface shows is in its texels already.
Limits. One material stands for all mirror-like ones of an object, the one of the largest area. Above ROUGHEST the lobe
is so wide that the captured radiance shows it as well as one ray would; such objects count as lit, not as mirrors.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .snapshot import Instance, Material, SceneSnapshot

# Blender's roughness: half of what it reflects lies within 4.6 degrees of the mirror direction.
ROUGHEST = 0.2


@dataclass(frozen=True)
class Mirror:
    """The mirror-like (or glossy: glossy.py) part of an instance."""

    material: Material
    slots: tuple[int, ...]  # of the instance's materials, those that do
    whole: bool  # all of its surface does


def mirror_of(scene: SceneSnapshot, instance: Instance) -> Mirror | None:
    """The part of the instance that mirrors, None for a lit thing."""
    if not instance.is_reflector or not instance.materials:
        return None
    return part_of(scene, instance, _mirrors)


def part_of(scene: SceneSnapshot, instance: Instance, chosen: Callable[[Material], bool]) -> Mirror | None:
    """The part of the instance that shows the chosen materials, the one of the largest area standing for all; None: nothing."""
    slots = scene.slots(instance)
    triangles = scene.world_positions(instance)[scene.meshes[instance.mesh].triangles]
    area = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=-1)
    shown = np.bincount(slots, weights=area, minlength=len(instance.materials))
    mirrors = [s for s in np.unique(slots).tolist() if chosen(scene.materials[instance.materials[s]])]
    if not mirrors:
        return None
    largest = max(mirrors, key=lambda s: shown[s])
    return Mirror(
        scene.materials[instance.materials[largest]], tuple(mirrors), len(mirrors) == len(np.unique(slots))
    )  # fmt: skip


def second_order_pairs(scene: SceneSnapshot) -> tuple[tuple[str, str], ...]:
    """(reflector, mirror that it shows) by name: one for each second-order reflection of the scene, R (R - 1) of them."""
    mirrors = [i for i in scene.instances if i.visible_glossy and mirror_of(scene, i)]
    return tuple((r.name, m.name) for r in scene.reflectors() for m in mirrors if m.name != r.name)


def _mirrors(material: Material) -> bool:
    return material.is_reflector and material.roughness <= ROUGHEST
