"""One scene with something of everything, baked without Blender by every method that answers rays: what the agreement
tests of GLSL and shader nodes run on."""

import numpy as np
import tolerances
import trimesh
from analytic import directions, unit
from mesh_scenes import MATTE, job, smooth_mirror, snapshot

from reflect_addon.core import methods
from reflect_addon.core.asset import Asset
from reflect_addon.core.kernel import run_numpy
from reflect_addon.core.rays import Rays
from reflect_addon.core.snapshot import Material, SceneSnapshot

GOLD = Material("gold", metallic=1.0, roughness=0.15, base_color=(1.0, 0.8, 0.4), is_reflector=True)
LACQUER = Material("lacquer", roughness=0.0, ior=1.6, is_reflector=True)
# One map of few points an object: software OpenGL compiles faster.
SETTINGS = {"resolution": 32, "samples": 1, "texels": 32, "sky_error": 0, "maps": 1, "points": 6, "self_reflections": False,
            "views": 6, "view_texels": 16}


def turned(shape: trimesh.Trimesh, at, angle=0.4) -> trimesh.Trimesh:
    shape.apply_transform(trimesh.transformations.euler_matrix(angle, 2 * angle, -angle))
    return shape.apply_translation(at)


def scene_of_everything() -> SceneSnapshot:
    """A mirror ball in a room without a ceiling, beside a torus (a volume with a hole), a crate (flat), a needle, and two
    other mirrors: a ball that is one in its upper half only, and a lacquered block (flat)."""
    room = trimesh.creation.box((6, 5, 3))
    room.update_faces(room.face_normals[:, 2] < 0.9)
    half = smooth_mirror(trimesh.creation.icosphere(3, 0.35), (GOLD, MATTE))
    half.metadata["faces"] = half.triangles_center[:, 2] < 0
    block = trimesh.creation.box((0.5, 0.6, 0.7))
    block.metadata["material"] = LACQUER
    return snapshot(
        trimesh.creation.icosphere(3, 0.5).apply_translation([0.3, -0.2, 0.1]),
        Room=room,
        Torus=turned(trimesh.creation.torus(0.4, 0.15), [1.6, 0.3, 0.2]),
        Crate=turned(trimesh.creation.box((0.7, 0.5, 0.4)), [-1.5, 1.0, -0.6]),
        Needle=turned(trimesh.creation.cylinder(0.01, 1.0, sections=100), [0.2, 1.7, 0.0]),
        Half=turned(half, [-1.0, -1.3, 0.2]),
        Block=turned(block, [1.5, -1.5, -0.8]),
    )


def bake_all(scene: SceneSnapshot, paint=None) -> dict[str, Asset]:
    """method -> its asset, joined with what it requires."""
    done: dict[str, Asset] = {}
    for name in methods.with_required(methods.gathering()):
        method = methods.get(name)
        required = {kind: done[kind] for kind in method.REQUIRES}
        done[name] = method.bake(job(scene, {**method.DEFAULTS, **SETTINGS}, required, paint))
    return {name: done[name].joined(*(done[kind] for kind in methods.get(name).REQUIRES)) for name in methods.gathering()}


def rays_of_all_kinds(rng, count: int) -> Rays:
    """From all over the room, from the mirror, along axes and diagonals, on walls and outside them; a few null rays."""
    origin = rng.uniform([-3, -2.5, -1.5], [3, 2.5, 1.5], (count, 3))
    half = count // 2
    out = directions(rng, half)
    origin[:half] = [0.3, -0.2, 0.1] + 0.5 * out
    direction = rng.permutation(directions(rng, count))
    direction[:half] = unit(out + 0.95 * directions(rng, half))
    direction[-600:-300] = directions(rng, 300)
    origin[-600:-500, 2] = -1.5
    origin[-500:-400] *= 3
    direction[-300:-290] = 0
    origin[-290:-280] = [0.3, -0.2, 0.1]
    return Rays(origin.astype("f"), direction.astype("f"))


def same_answer(found, wanted, origin, radiance: float, distance: float) -> np.ndarray:
    """(N,) bool: radiance and hit distance within these relative bounds, status and coverage equal. Of hits a few
    millimetres away the coordinates' own rounding is more than the bound on the distance."""
    darkest = 1e-3  # below it radiance is judged absolutely
    bright = np.abs(found.radiance - wanted.radiance) <= radiance * np.maximum(np.abs(wanted.radiance), darkest)
    far = [np.linalg.norm(a.position.astype(np.float64) - origin, axis=1) for a in (found, wanted)]
    rounding = tolerances.FLOAT32 * np.abs(wanted.position).max(1)
    near = np.abs(far[0] - far[1]) <= distance * np.maximum(far[1], 1e-3) + rounding
    return bright.all(1) & near & (found.status == wanted.status) & (found.coverage == wanted.coverage)


def is_on_the_brink(program, asset, rays, width, spread, found, rng, step: float, radiance: float, distance: float) -> np.ndarray:
    """(N,) bool: the answer is the one of a ray that starts `step` m and turns `step` rad away, at most; or the ray is so
    ill-conditioned (a search that starts beside a root) that moves by a tenth of that scatter its hit further than that."""
    explained = np.zeros(len(rays), bool)
    still = run_numpy(program, asset, rays, width, spread).position.astype(np.float64)
    scatter = np.zeros(len(rays))
    for size in (*[step] * 64, *[step / 10] * 16):
        moved = Rays(
            (rays.origin + rng.uniform(-size, size, rays.origin.shape)).astype("f"),
            (rays.direction + rng.uniform(-size, size, rays.direction.shape)).astype("f"),
        )
        again = run_numpy(program, asset, moved, width, spread)
        explained |= same_answer(found, again, rays.origin, 3 * radiance, 3 * distance)  # the move itself is smooth
        if size < step:
            scatter = np.maximum(scatter, np.linalg.norm(again.position - still, axis=1))
    return explained | (np.linalg.norm(found.position - still, axis=1) <= scatter)
