"""Which objects are glossy to mirrors: lit things whose lobe shows its highlights where the reflected ray sees them.

Problem. A capture shows a highlight where the capture's camera saw it, and it stays there for every reflected ray.
Idea. The light of such a surface is taken apart: what its lobe reflects (Cycles' glossy passes say how much) is left out of the
texel and computed again at the hit (lobe.py, second_order.py). As for mirrors, one material stands for all glossy ones of
an object, the one of the largest area; roughness, metalness and tints are its constants.
Limits. Textured roughness is its mean (scene/materials.py). Above ROUGHEST a lobe is so wide that the captured picture
shows it as well.
"""

import numpy as np

from .job import BakeJob
from .kernel import evaluate, record_function
from .mirrors import Mirror, mirror_of, part_of
from .rays import Hits
from .second_order import MIRROR_INPUTS, mirror_terms
from .snapshot import Instance, Material, SceneSnapshot

# Blender's roughness: half of what it reflects lies within 41 degrees of the mirror direction.
ROUGHEST = 0.6
# Least share of light reflected straight on, as scene/materials.py has it for reflectors: water's is wanted.
LEAST_REFLECTANCE = 0.015
# Less than this share of the surface's own light cannot be told from the lobe's, or a mirror's, noise.
LEAST_KEPT = 0.05


def is_on(job: BakeJob) -> bool:
    """Whether the bake asks for shading at the hit."""
    return bool(job.settings.get("view_dependent"))


def glossy_of(scene: SceneSnapshot, instance: Instance) -> Mirror | None:
    """The glossy part of the instance; None for a matte thing and for a mirror, whose lobe is one ray."""
    if not instance.materials or mirror_of(scene, instance) is not None:
        return None
    return part_of(scene, instance, _is_glossy)


def _is_glossy(material: Material) -> bool:
    dielectric = ((material.ior - 1) / (material.ior + 1)) ** 2 * max(material.specular_tint)
    straight = material.metallic * max(material.base_color) + (1 - material.metallic) * dielectric
    return material.roughness <= ROUGHEST and material.specular_weight * straight >= LEAST_REFLECTANCE


def lobe_options(materials: list[Material]) -> dict[str, bool]:
    """core/shading.py's options: which lobes these materials have."""
    return {
        "has_metal": any(m.metallic > 0 for m in materials),
        "has_dielectric": any(m.metallic < 1 for m in materials) or not materials,
    }


def matte(material: Material, hits: Hits, direction: np.ndarray, share: np.ndarray) -> np.ndarray:
    """(N, 3) radiance below the lobe, as from where the lobe mirrors nothing: what was captured less what glossy lobes
    reflected, over what they left of it. direction (N, 3): of the capture's rays; share (N,): of the surface that is glossy."""
    cosine = np.maximum(-np.einsum("nx,nx->n", direction, hits.normal.astype(np.float64)), 0.0)
    rows = {
        "cosine": cosine, "base_color": material.base_color, "metallic": material.metallic, "share": share,
        "specular_tint": material.specular_tint, "ior": material.ior, "weight": material.specular_weight,
    }  # fmt: skip
    wide = {n: np.broadcast_to(v, (len(cosine), 3) if MIRROR_INPUTS[n] == "vec3" else len(cosine)) for n, v in rows.items()}
    kept = evaluate(record_function(mirror_terms, MIRROR_INPUTS, options=lobe_options([material])), wide)["kept"]
    below = np.maximum(hits.radiance - hits.glossy * share[:, None], 0.0)
    return below / np.maximum(kept, LEAST_KEPT)[:, None]
