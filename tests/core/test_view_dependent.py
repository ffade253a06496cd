"""core/view_dependent.py without Blender: a glossy plane, a ball and a lamp seen in a mirror, against sums over the lamp."""

from dataclasses import replace

import numpy as np
import pytest
import tolerances
import trimesh
from analytic import directions, unit
from mesh_scenes import job, smooth_mirror, snapshot
from test_lobe import summed

from reflect_addon.core import billboard_follow, glossy, surface_radiance
from reflect_addon.core.kernel import emit_glsl, record, run_numpy
from reflect_addon.core.methods import billboards, depth_maps
from reflect_addon.core.rays import Rays
from reflect_addon.core.snapshot import Material
from reflect_addon.core.surface_asset import meshes_of

SATIN = Material("satin", metallic=1.0, roughness=0.3, base_color=(1.0, 1.0, 1.0))
DULL = Material("dull", specular_weight=0.0)
PLASTIC = Material("plastic", roughness=0.3)
SETTINGS = {"resolution": 32, "samples": 1, "texels": 32, "sky_error": 0, "maps": 1, "points": 6, "self_reflections": False}
SURFACES = {**surface_radiance.DEFAULTS, "surface_samples": 1, "surface_tolerance": 0.05}
BRIGHT, SIDE, LAMP = 50.0, 0.2, np.array([2.0, 0.0, 2.5])


def ball(at=(0.0, 0.0, 0.0), radius=0.5) -> trimesh.Trimesh:
    return smooth_mirror(trimesh.creation.icosphere(3, radius).apply_translation(at))


def sheet(half, at, material=DULL, up=True) -> trimesh.Trimesh:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [half, half, 0] + at
    shape = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]] if up else [[0, 2, 1], [0, 3, 2]], process=False)
    shape.metadata["material"] = material
    return shape


def scene_of(material=SATIN, **more):
    """A table of the material below a mirror ball, and a lamp beside the ball."""
    return snapshot(ball(), Table=sheet(4, (0, 0, -1.0), material), Lamp=sheet(SIDE, LAMP, up=False), **more)


def work(scene, view_dependent=True, **settings):
    index = [i.name for i in scene.instances].index("Lamp")
    names = {**billboards.DEFAULTS, **depth_maps.DEFAULTS, **SETTINGS, "view_dependent": view_dependent, **settings}
    return job(scene, names, paint=lambda p, owner: np.where((owner == index)[:, None], BRIGHT, 0.3 + 0 * p))


def to_the_table(rng, count: int):
    """(rays from the ball that meet the table, where)."""
    out = unit(directions(rng, 40 * count) + [0.6, 0, -1.2])
    origin = 0.501 * out
    direction = unit(out + 0.5 * directions(rng, len(out)) + [0, 0, -0.3])
    at = origin + direction * ((-1.0 - origin[:, 2:]) / np.minimum(direction[:, 2:], -1e-3))
    meets = (direction[:, 2] < -0.15) & (np.abs(at[:, :2]).max(1) < 3.5) & ((origin * direction).sum(1) > 0.05)
    keep = np.flatnonzero(meets)[:count]
    return Rays(origin[keep].astype("f"), direction[keep].astype("f")), at[keep]


def lamps_share(asset, method, rays) -> np.ndarray:
    """(N,) what the lamps' highlights add, over the lamp's radiance."""
    program = record(method.trace, asset)
    dark = asset.images["lamp_buf"].copy()
    dark[:, 3] = 0
    without = replace(asset, images={**asset.images, "lamp_buf": dark})
    return (run_numpy(program, asset, rays).radiance - run_numpy(program, without, rays).radiance)[:, 0] / BRIGHT


@pytest.mark.parametrize("method", [billboards, depth_maps])
def test_a_highlight_lies_where_the_reflected_ray_sees_it(rng, method):
    """Ray by ray the microfacet formula summed over the lamp; brightest where the ray, mirrored once more, meets the lamp."""
    asset = method.bake(work(scene_of()))
    assert (asset.options["glossy"], asset.options["lamps"], asset.options["lamp_count"]) == (1, 1, 1)
    rays, at = to_the_table(rng, 300)
    found = lamps_share(asset, method, rays)
    toward, up = -rays.direction.astype(np.float64), np.array([0, 0, 1.0])
    u, v = np.array([0, SIDE, 0]), np.array([SIDE, 0, 0])
    wanted = np.array([summed(i, up, SATIN.roughness**2, LAMP - p, u, v, 60) for i, p in zip(toward, at, strict=True)])
    # The ball is between some of the table and the lamp.
    along = unit(LAMP - at)
    near = np.linalg.norm(-at - (-at * along).sum(1, keepdims=True) * along, axis=1)
    free = near > 0.75
    assert free.sum() > 150 and (wanted[free] > 0.1 * wanted.max()).sum() > 10
    assert np.abs(found - wanted)[free].max() < tolerances.HIGHLIGHT * wanted.max()
    mirrored = rays.direction * [1, 1, -1]
    miss = np.linalg.norm(np.cross(mirrored, along), axis=1)
    brightest = np.flatnonzero(free)[np.argsort(found[free])[-5:]]
    assert np.median(miss[brightest]) < np.quantile(miss[free], 0.1)


def test_no_highlight_in_a_shadow(rng):
    """A board over the table, which the reflected ray does not meet, keeps the lamp from it."""
    board = sheet(3.0, (2.0, 0, 1.5))
    asset = billboards.bake(work(scene_of(Board=board)))
    rays, at = to_the_table(rng, 300)
    shown = lamps_share(asset, billboards, rays)
    crossing = at + (LAMP - at) * (2.5 / 3.5)
    shaded = np.abs(crossing[:, :2] - [2.0, 0]).max(1) < 2.7
    assert shaded.sum() > 100 and np.abs(shown[shaded]).max() < 1e-3


def test_scenes_without_what_is_glossy_pay_nothing():
    """The same images, options and GLSL, whether it is asked for or not; and for what is glossy when it is not asked for."""
    for method in (billboards, depth_maps):
        texts = []
        for material, on in ((DULL, False), (DULL, True), (SATIN, False)):
            asset = method.bake(work(scene_of(material), on))
            assert asset.options["glossy"] == 0 and not {"own_tx", "seen_tx", "lamp_buf"} & set(asset.images)
            texts.append(str(emit_glsl(record(method.trace, asset), ("radiance", "coverage", "position", "status"))))
        assert texts[0] == texts[1] == texts[2]


def test_what_is_glossy():
    scene = snapshot(ball(), A=sheet(1, (0, 0, 1), SATIN), B=sheet(1, (0, 0, 2), replace(PLASTIC, roughness=0.9)), C=sheet(1, (0, 0, 3), PLASTIC))
    found = {i.name: glossy.glossy_of(scene, i) for i in scene.instances}
    assert found["A"].material == SATIN and found["C"].material == PLASTIC
    assert found["B"] is None, "too rough to tell from its picture"
    assert found["Mirror"] is None, "a mirror is second order"


@pytest.mark.parametrize("method", [billboards, depth_maps])
def test_what_is_glossy_sees_what_is_glossy(rng, method):
    """A satin wall over a satin table: the table's lobe shows the wall's picture, and not the map without it."""
    wall = trimesh.creation.box((0.1, 8, 4)).apply_translation([3.0, 0, 1.0])
    wall.metadata["material"] = PLASTIC
    scene = scene_of(Wall=wall)
    index = {i.name: k for k, i in enumerate(scene.instances)}
    settings = {**billboards.DEFAULTS, **depth_maps.DEFAULTS, **SETTINGS, "view_dependent": True}
    asset = method.bake(job(scene, settings, paint=lambda p, owner: np.where((owner == index["Wall"])[:, None], 1.5, 0.3 + 0 * p)))
    assert asset.options["glossy"] >= 2
    rays, at = to_the_table(rng, 3000)
    onward = rays.direction * [1, 1, -1]
    way = (2.95 - at[:, 0]) / np.maximum(onward[:, 0], 1e-3)
    meets = (onward[:, 0] > 0.2) & (np.abs(at + way[:, None] * onward)[:, 1] < 3) & ((at + way[:, None] * onward)[:, 2] < 2.5)
    assert meets.sum() > 50
    shown = run_numpy(record(method.trace, asset), asset, rays).radiance[meets].mean(1)
    assert np.median(shown) > 1.0


def test_a_mirrors_ray_still_sees_the_picture(rng):
    """The last tertiary ray of a mirror, and whoever looks at the table in it, has the captured radiance."""
    scene = scene_of(Other=ball((1.6, 0.9, 0.0), 0.4))
    on, off = (billboards.bake(work(scene, flag, order=2)) for flag in (True, False))
    assert on.options["mirrors"] == off.options["mirrors"] == 1 and on.options["count"] == off.options["count"]
    toward = unit(np.array([1.6, 0.9, 0.0]) + 0.2 * directions(rng, 400))
    rays = Rays((0.501 * toward).astype("f"), toward.astype("f"))
    a, b = (run_numpy(record(billboards.trace, asset), asset, rays).radiance for asset in (on, off))
    np.testing.assert_allclose(a, b, rtol=4 * tolerances.HALF, atol=4 * tolerances.HALF)


@pytest.mark.parametrize("method, kind", [(billboards, "glossy"), (depth_maps, "glossy_map")])
def test_what_is_glossy_goes_along_and_is_named_stale(method, kind):
    """No capture makes its light at the hit: it is placed anew and said to need a bake, also where its surface is known."""
    thing = ball((1.6, 0.9, 0.0), 0.4)
    thing.metadata["material"] = PLASTIC
    scene = scene_of(Other=thing)
    made = work(scene)
    asset = method.bake(made)
    assert {p.kind for p in asset.parts if p.instance == "Other"} == {kind}
    assert {p.kind for p in asset.parts if p.instance == "Table"} == {"flat_glossy"}
    surfaces = meshes_of(surface_radiance.bake(scene, made.trace, scene.instances, SURFACES))
    step = np.eye(4)
    step[:3, 3] = 0.1, 0.2, 0.0
    instances = tuple(
        replace(i, world_from_object=step @ i.world_from_object) if i.name == "Other" else i for i in scene.instances
    )
    found = billboard_follow.follow(billboard_follow.start(asset, scene), replace(scene, instances=instances), surfaces)
    assert found.state.stale == {"Other"} and not any(shot.instance.name == "Other" for shot in found.shots)
    rows = [p.row for p in asset.parts if p.instance == "Other"]
    assert not np.allclose(found.table[rows], asset.images["billboard_buf"][rows])
