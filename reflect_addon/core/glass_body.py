"""A solid body of glass as a part of an asset: its map by direction, and how much of the light in it finds no way out that is followed."""

from types import SimpleNamespace

import numpy as np

from . import convex_map, glass_optics
from .glass_shapes import OTHER, PANE, SOLID, Glass
from .kernel import evaluate, record_function

# Rays that tell what is left out: a share of a tenth is known to a hundredth.
ASKED = 1024


def part_of_asset(glass: Glass | None) -> dict[str, dict]:
    """images, uniforms and options to be joined with an asset's; empty for what does not refract."""
    if glass is None:
        return {"images": {}, "uniforms": {}, "options": {}}
    if glass.kind != SOLID:
        return {"images": {}, "uniforms": {}, "options": {"glass": glass.kind, "glass_reason": glass.reason}}
    made = convex_map.build(glass.corners, glass.shading)
    uniforms = {
        "glass_center": tuple(map(float, made.center)), "glass_shape": (made.size, float(convex_map.SIDE)), "glass_left": left_out(glass, made),
    }  # fmt: skip
    return {"images": made.images, "uniforms": uniforms, "options": {"glass": SOLID}}


def sentence(options: dict, uniforms: dict) -> str:
    """What is done for the glass of an asset, for its report; "" for what is no glass."""
    kind = options.get("glass")
    if kind == PANE:
        return "It is a pane: what is behind it is drawn through it."
    if kind == SOLID:
        return f"It is a solid body of glass: rays are bent twice; {uniforms['glass_left']:.0%} of what enters is left out."
    return f"Its glass does not refract here, as {options['glass_reason']}." if kind == OTHER else ""


def left_out(glass: Glass, made: convex_map.ConvexMap) -> float:
    """Share of the light that enters from all around, as much from each direction, that does not leave by the one way that is followed."""
    rng = np.random.default_rng(0)
    cross = np.cross(glass.corners[:, 1] - glass.corners[:, 0], glass.corners[:, 2] - glass.corners[:, 0])
    area = np.linalg.norm(cross, axis=-1)
    which = rng.choice(len(area), ASKED, p=area / area.sum())
    shares = rng.dirichlet(np.ones(3), ASKED)
    face = cross[which] / area[which, None]
    around = rng.normal(size=(ASKED, 3))
    out = face + around / np.linalg.norm(around, axis=-1, keepdims=True)  # by the cosine
    view = -out / np.maximum(np.linalg.norm(out, axis=-1, keepdims=True), 1e-12)
    way = followed(
        made, np.einsum("nk,nkc->nc", shares, glass.corners[which]), view, _unit(np.einsum("nk,nkc->nc", shares, glass.shading[which])),
        glass.material.ior,
    )  # fmt: skip
    entered = way["left"] + way["through"][:, 0]
    return float(way["left"].sum() / max(entered.sum(), 1e-9))


def followed(made: convex_map.ConvexMap, origin, view, normal, ior: float) -> dict[str, np.ndarray]:
    """glass_optics.body's outputs for rays (N, 3) that meet a body without a tint."""
    count = len(origin)
    values = {
        "origin": origin, "view": view, "normal": normal, "ior": ior, "tint": (1.0, 1.0, 1.0), "center": made.center,
        "shape": (made.size, made.images[glass_optics.IMAGES[0]].shape[0] - 2),
    }  # fmt: skip
    wide = {n: np.broadcast_to(np.asarray(v, np.float32), (count, *np.shape(v)[-1:]) if np.ndim(v) else count) for n, v in values.items()}
    program = record_function(glass_optics.body, glass_optics.BODY_INPUTS, glass_optics.IMAGES)
    return evaluate(program, wide, SimpleNamespace(images=made.images, uniforms={}))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)
