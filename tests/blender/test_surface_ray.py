"""core/surface_ray.py: the mirror ray of a surface point is the ray map's, and one ray a sample has the mean of the overlay's several."""

import numpy as np
import pytest
import tolerances
import tolerances_nodes
from analytic import directions, unit

from reflect_addon.core import lobe_rays
from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import Hit, evaluate, record_function
from reflect_addon.core.shading import ROUGHNESS_SPREAD
from reflect_addon.core.surface_ray import mirror_ray, ray_of_lobe, record_surface


def surfaces(rng, count: int) -> dict[str, np.ndarray]:
    """Points of a ball's triangles from both sides: shading normals tilted by up to 0.5, a third of them seen at grazing."""
    face = directions(rng, count)
    normal = unit(face + 0.5 * rng.uniform(0, 1, (count, 1)) * directions(rng, count))
    incoming = directions(rng, count)
    grazing = slice(0, count // 3)
    incoming[grazing] -= face[grazing] * (np.sum(incoming * face, 1, keepdims=True)[grazing] - rng.uniform(-0.03, 0.03, (count // 3, 1)))
    return {"incoming": unit(incoming), "normal": normal, "face_normal": face}


def test_the_mirror_ray_is_the_ray_maps(fresh_file, rng):
    """scene/raymap_numpy.py on one triangle a point; tests/gpu compares that with the shader of the ray map."""
    from reflect_addon.scene.raymap_numpy import _mirror  # needs Blender's mathutils

    given = surfaces(rng, 20_000)
    program = record_function(lambda k, s, **g: dict(zip(("direction", "cosine"), mirror_ray(k, **g))), {n: "vec3" for n in given})
    found = evaluate(program, given, dtype=np.float64)
    across = unit(np.cross(given["face_normal"], rng.normal(size=given["normal"].shape)))
    corners = np.stack([np.zeros_like(across), across, np.cross(given["face_normal"], across)], 1)
    soup = {"corners": corners, "normals": np.repeat(given["normal"][:, None], 3, 1)}
    picks = np.arange(len(corners))
    direction, normal = _mirror(soup, picks, np.full((len(corners), 3), 1 / 3), -given["incoming"])
    assert np.abs(found["direction"] - direction).max() < tolerances.FLOAT32
    assert np.abs(found["cosine"] - np.sum(normal * direction, 1)).max() < tolerances.FLOAT32
    low = np.sum(direction * given["face_normal"], 1) * np.sign(np.sum(given["incoming"] * given["face_normal"], 1))
    assert 0.02 < np.mean(low < 0.0101) < 0.9 and low.min() >= 0


@pytest.mark.parametrize("roughness, degrees", [(0.2, 30), (0.5, 30), (0.5, 75), (0.8, 60)])
def test_one_ray_a_sample_has_the_mean_of_the_overlays_rays(roughness, degrees, rng):
    """Of a smooth function of the direction: rays, weights and footprint as gpu/glsl/fill_rough.frag.glsl has them."""
    added = ROUGHNESS_SPREAD * roughness**2
    tilt = np.radians(degrees)
    mirrored, normal = np.array([np.sin(tilt), 0, np.cos(tilt)]), np.array([0.0, 0, 1])

    def shown(d):
        return np.stack([d[:, 0], d[:, 2] ** 2, np.exp(3 * d[:, 1])], -1)

    count = evaluate(record_function(lobe_rays.count, lobe_rays.COUNT_INPUTS), {"spread": np.array([added]), "most": np.array([64.0])})
    rays = int(count["rays"][0])
    turns = rng.uniform(0, 2 * np.pi, 400)[:, None] + np.arctan2(*lobe_rays.turns()[:rays].T[::-1])
    share = np.tile((np.arange(rays) + 0.5) / rays, len(turns))
    many = {"mirrored": mirrored, "normal": normal, "alpha": added * lobe_rays.ALPHA}
    many = {n: np.broadcast_to(v, (turns.size, *np.shape(v))) for n, v in many.items()}
    many |= {"turn": np.stack([np.cos(turns), np.sin(turns)], -1).reshape(-1, 2), "share": share}
    overlay = evaluate(record_function(lobe_rays.direction, lobe_rays.DIRECTION_INPUTS), many)
    weight = overlay["weight"][:, None]
    wanted = (shown(overlay["direction"]) * weight).sum(0) / weight.sum()

    inputs = {"direction": "vec3", "normal": "vec3", "added": "float", "random": "vec3"}
    program = record_function(lambda k, s, **g: dict(zip(("direction", "spread"), ray_of_lobe(k, s, **g))), inputs)
    given = {"direction": mirrored, "normal": normal, "added": added, "random": rng.random((100_000, 3))}
    given = {n: np.broadcast_to(v, (100_000, *np.shape(v)[-1:])) for n, v in given.items()}
    one = evaluate(program, given)
    values = shown(one["direction"])
    noise = values.std(0) / np.sqrt(len(values))
    assert np.all(np.abs(values.mean(0) - wanted) < 5 * noise + tolerances_nodes.LOBE_DRAWS)
    assert one["spread"] == pytest.approx(added / np.sqrt(rays), rel=tolerances.FLOAT32)


def test_a_mirror_and_what_has_no_outlines_draw_nothing(rng):
    """No other input, and with roughness 0 the very same ray."""

    def trace(k, asset, ray):
        return Hit(ray.direction, ray.origin + ray.direction, ray.spread, 1.0)

    plain, outlined = Asset("a", "", {}), Asset("a", "", {}, {}, {"count": 1})
    assert "random" not in record_surface(trace, plain, "a", rough=True).inputs
    assert "random" not in record_surface(trace, outlined, "a", rough=False).inputs
    given = surfaces(rng, 500)
    zero, random = np.zeros(500), rng.random((500, 3))
    given |= {"position": np.zeros((500, 3)), "smooth_normal": given["normal"], "normal": np.zeros((500, 3)), "roughness": zero}
    rough = evaluate(record_surface(trace, outlined, "a", rough=True), given | {"random": random}, outlined)
    mirror = evaluate(record_surface(trace, outlined, "a", rough=False), given, outlined)
    assert all(np.array_equal(rough[name], mirror[name]) for name in mirror)
