"""What a reflective billboard holds beside a picture: normals, and its own light without what it mirrors.

Problem. A captured mirror shows what it mirrors to the capture's rays, a second time once its own reflections are added.
Idea. Its radiance towards a ray is kept * own + reflectance * L, L being what comes along the mirrored ray
(second_order.mirror_terms). L is traced, so own = (radiance - reflectance * L) / kept: zero for a bare metal, the paint
below its varnish for a dielectric, so that own and second order together are what was captured.
Limits. For rough lobes L is one sharp ray, so their own light keeps the difference where it is positive. A metal's own
light is emission, which stands clear of the noise of both traces or does not count (EMITS).
"""

import numpy as np

from .billboard_atlas import ROW, pack
from .glossy import LEAST_KEPT, glossy_of, lobe_options
from .job import BakeJob
from .kernel import evaluate, record_function
from .mirrors import Mirror, mirror_of
from .rays import Hits, Rays
from .reflected_samples import LIFT, LIFT_ROUNDING
from .second_order import MIRROR_INPUTS, PAPERS_ORDER, mirror_terms
from .snapshot import Instance, Material

# A metal emits when the median of its own light is this share of all it shows.
EMITS = 0.5
# Of a cosine: planes that look in opposite directions, fitted to the same faces.
OPPOSITE = 1e-6
# A point belongs to the nearest of two surfaces that lie closer than this share of the distance to their ray's start.
SAME_SURFACE = 1e-5


def mirror_rows(job: BakeJob, stand_ins: list, captured: list):
    """((material, place of its normals) of each reflective stand-in, their image, the options of their kernel).

    stand_ins: quads or depth views; captured: their Texels, in the same order."""
    reflective = [(s, t.normals) for s, t in zip(stand_ins, captured, strict=True) if t.normals is not None]
    if not reflective:
        return [], {}, {}
    by_name = {i.name: i for i in job.scene.instances}
    mirrors = [_shiny(job, by_name[s.instance]) for s, _ in reflective]
    atlas, placed = pack([normals for _, normals in reflective])
    options = {
        "partly": not all(m.whole for m in mirrors),
        "order": int(job.settings.get("order", PAPERS_ORDER)),
        "relief": any(s.has_relief for s, _ in reflective),
        **lobe_options([m.material for m in mirrors]),
    }
    rows = [(m.material, where) for m, where in zip(mirrors, placed, strict=True)]
    return rows, {"normal_tx": atlas.astype(np.float16)}, options


def stand_off(job: BakeJob, rows: np.ndarray, stand_ins: list, captured: list) -> None:
    """Moves the two planes of a sheet that rays start on, the reflector's own or a mirror, off their surface, in place. rows: billboard_atlas's.

    A ray that leaves the one side must not meet the other where its start was rounded through both."""
    low, high = job.scene.bounds()
    lift = max(LIFT * job.scene.diagonal(), LIFT_ROUNDING * float(np.abs([low, high]).max()))
    planes = rows[: len(stand_ins), ROW["plane"]].copy()
    for i, (stand_in, texels) in enumerate(zip(stand_ins, captured, strict=True)):
        if stand_in.shared and (stand_in.instance == job.reflector.name or texels.normals is not None):
            other = np.array([s.shared and s.instance == stand_in.instance for s in stand_ins])
            turned = (planes[:, :3] @ planes[i, :3] < -1 + OPPOSITE) & (np.abs(planes[:, 3] + planes[i, 3]) < lift)
            rows[i, ROW["plane"], 3] += lift * (other & turned).any()


def _shiny(job: BakeJob, instance: Instance) -> Mirror:
    return mirror_of(job.scene, instance) or glossy_of(job.scene, instance)


def share_of(job: BakeJob, instance: Instance, mirror: Mirror, rays: Rays, distance: np.ndarray) -> np.ndarray:
    """(N,) share of what the rays meet of the instance at these distances that mirrors: 0 or 1."""
    if mirror.whole:
        return np.ones(len(rays))
    shiny = job.intersect(instance, rays, mirror.slots)
    return (shiny <= distance * (1 + SAME_SURFACE)).astype(float)


def mirrored(hits: Hits, direction: np.ndarray, lift: np.ndarray) -> tuple[Rays, np.ndarray]:
    """((N) rays from the hits along the mirror direction, (N,) cosine of the captured ray at the normal).

    direction (N, 3): of the rays that captured the hits; lift (N,) m: how far above the surface the rays start."""
    normal = hits.normal.astype(np.float64)
    toward = np.minimum(np.einsum("nx,nx->n", direction, normal), 0.0)
    out = direction - 2 * toward[:, None] * normal
    start = hits.position + normal * lift[:, None]
    return Rays(start.astype(np.float32), out.astype(np.float32)), -toward


def own_light(material: Material, captured: np.ndarray, cosine: np.ndarray, share: np.ndarray, arriving: np.ndarray):
    """(N, 3) radiance that the surface has of its own, for captured and arriving (N, 3), cosine and share (N,)."""
    rows = {
        "cosine": cosine, "base_color": material.base_color, "metallic": material.metallic, "share": share,
        "specular_tint": material.specular_tint, "ior": material.ior, "weight": material.specular_weight,
    }  # fmt: skip
    wide = {n: np.broadcast_to(v, (len(cosine), 3) if MIRROR_INPUTS[n] == "vec3" else len(cosine)) for n, v in rows.items()}
    terms = evaluate(record_function(mirror_terms, MIRROR_INPUTS, options=lobe_options([material])), wide)
    own = np.maximum(captured - terms["reflectance"] * arriving, 0.0) / np.maximum(terms["kept"], LEAST_KEPT)[:, None]
    if material.metallic * material.specular_weight > 1 - LEAST_KEPT and len(own):
        bare = share > 0
        if not np.median(own[bare]) > EMITS * np.median(captured[bare]):
            own[bare] = 0.0
    return own
