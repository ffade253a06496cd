"""A peer to compare with: EEVEE's own picture of the frame, by screen tracing and sphere probes, against the same truth.

EEVEE answers pixels, not rays, so a reflector's pixels are compared one by one: its "specular light" there (mirror
radiance before Fresnel and tint, see scene/peer_render.py) against the truth of the pixel's ray. It tells no hit points
and has no reflection pass that could be timed apart, so those numbers stay empty and a sentence says why.

A picture takes software OpenGL many seconds. It is drawn by another process, on a copy of the file, and kept in a folder
under a hash of everything that it depends on.
"""

import hashlib
import io
import json
import time
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.processes import temporary_folder
from ..core.rays import RayMap
from ..core.safe_write import write_whole
from ..core.snapshot import SceneSnapshot, corners_of
from ..scene import peer_render
from ..scene.bake_job import save_copy
from ..scene.exr import read_exr, stacked
from ..scene.peer_render import Job, Probe
from ..scene.raytrace import to_rec709
from ..scene.worker import Worker
from ..scene.worker_command import reflect_command

NAME = "eevee"
FORMAT = 1
# With a probe: what the issue asks for. Without: what screen tracing alone finds, since a probe can also mislead.
SETTINGS = ({"screen_tracing": True, "sphere_probe": True}, {"screen_tracing": True, "sphere_probe": False})
SAMPLES = 16
PROBE_SIDE = 512  # texels of a cube face
MOST_PROBES = 8  # the reflectors that fill most pixels get one: each costs six views of the scene
POLL = 0.2  # s between looks at the process


@dataclass(frozen=True)
class Picture:
    """One of EEVEE's pictures."""

    setting: dict
    radiance: np.ndarray  # (N, 3) float32, linear Rec.709: of the ray map's covered pixels in row order
    seconds: float  # of the frame, what it compiled and captured included
    device: str
    probes: int
    replaced: tuple[str, ...]  # materials that were replaced by a white mirror

    def notes(self) -> list[str]:
        """What the row's numbers are and are not, in sentences."""
        with_probe = self.setting["sphere_probe"]
        probes = f"{self.probes} sphere {'probe' if self.probes == 1 else 'probes'}" if with_probe else "no probe"
        out = [
            f"EEVEE's specular light, before Fresnel and tint, by screen tracing at full resolution with {probes}. Shiny "
            "materials kept their look but lost roughness, anisotropy and normal maps, as the judged rays do; no sun was made of "
            "the world's brightest spot.",
            "EEVEE tells no hit points and has no reflection pass to time apart: its whole frame, with what it compiled and "
            f"captured, took {self.seconds:.1f} s, which is comparable to no other number here.",
        ]
        if self.replaced:
            out.append(
                f"A white mirror stood for {', '.join(self.replaced)} (several layers, refraction, or marked by hand), also "
                "where other reflectors show it."
            )
        return out


def job_of(
    scene: bpy.types.Scene, camera_name: str, camera: Camera, snapshot: SceneSnapshot, ray_map: RayMap
) -> Job:
    """What EEVEE is asked to draw: where probes go and which materials and objects reflect."""
    reflectors = snapshot.reflectors()
    pixels = np.bincount(ray_map.reflector[ray_map.covered()], minlength=len(reflectors))
    with_probe = [int(i) for i in np.argsort(-pixels, kind="stable")[:MOST_PROBES] if pixels[i]]
    corners = corners_of(snapshot.bounds())
    probes, materials, marked = [], {}, {}
    for index in with_probe:
        lowest, highest = snapshot.bounds([reflectors[index]])
        centre = (lowest + highest) / 2
        reach = float(np.linalg.norm(corners - centre, axis=-1).max())
        probes.append(Probe(tuple(map(float, centre)), float(np.linalg.norm(highest - lowest)) / 2, reach))
    for instance in reflectors:
        shiny = [snapshot.materials[m].name for m in instance.materials if snapshot.materials[m].is_reflector]
        materials.update(dict.fromkeys(shiny))
        if not shiny:
            marked[instance.object_name] = None
    return Job(
        scene.name, camera_name, snapshot.frame, (camera.width, camera.height), SAMPLES, PROBE_SIDE, tuple(materials),
        tuple(marked), tuple(dict.fromkeys(reflectors[i].object_name for i in with_probe)), tuple(probes), SETTINGS,
    )  # fmt: skip


def key_of(job: Job, camera: Camera, ray_map: RayMap, geometry_hash: str, look_of_scene: str, blender: str) -> str:
    """Name of the kept pictures: hex digits of a sha256 over all that they depend on."""
    digest = hashlib.sha256(json.dumps([FORMAT, job.plain(), geometry_hash, look_of_scene, blender]).encode())
    digest.update(Path(peer_render.__file__).read_bytes())  # how it is drawn
    for array in (camera.world_from_camera, camera.clip_from_camera, ray_map.covered()):
        digest.update(np.ascontiguousarray(array))
    return digest.hexdigest()[:32]


def eevee_values(scene: bpy.types.Scene) -> str:
    """What only EEVEE reads and the geometry's hash leaves out: its settings, of the scene, the world and materials."""
    blocks = [scene.eevee, scene.eevee.ray_tracing_options]
    blocks += [*bpy.data.worlds, *bpy.data.materials]  # in the order of their names
    lines = []
    for block in blocks:
        for prop in block.bl_rna.properties:
            if prop.type in {"BOOLEAN", "INT", "FLOAT", "ENUM"} and prop.identifier not in _NOT_LOOKS:
                value = getattr(block, prop.identifier)
                lines.append(f"{prop.identifier}={value[:] if getattr(prop, 'is_array', False) else value}")
    return "\n".join(lines)


_NOT_LOOKS = {
    "session_uid", "users", "tag", "is_evaluated", "use_nodes", "use_fake_user", "use_extra_user", "is_embedded_data",
    "is_linked_packed", "is_missing", "is_runtime_data", "is_editable", "is_library_indirect", "id_type",
}  # fmt: skip


def pictures_of(
    job: Job, ray_map: RayMap, draw: Callable[[Job, Path], dict], kept: Path | None = None
) -> list[Picture]:
    """EEVEE's pictures, drawn or read back from the file `kept`. draw(job, folder) is draw_apart, bound."""
    mask = ray_map.covered()
    if kept is not None and (found := _read(kept, job, int(mask.sum()))) is not None:
        return found
    if not mask.any():
        said = {"replaced": [], "seconds": [0.0] * len(job.settings), "device": "nothing was drawn"}
        radiances = [np.zeros((0, 3), np.float32)] * len(job.settings)
    else:
        with temporary_folder("reflect-eevee-") as folder:
            said = draw(job, folder)
            channels = [read_exr(folder / f"picture{k}.exr") for k in range(len(job.settings))]
        radiances = [to_rec709(stacked(c, "Glossy Direct", "RGB")[mask]).astype(np.float32) for c in channels]
    pictures = _pictures(job, said, radiances)
    if kept is not None and mask.any():
        content = io.BytesIO()
        words = np.frombuffer(json.dumps(said).encode(), np.uint8)
        np.savez(content, said=words, **{f"radiance{k}": r for k, r in enumerate(radiances)})
        write_whole(kept, content.getvalue())
    return pictures


def draw_apart(job: Job, folder: Path, say: Callable[[float, str], object]) -> dict:
    """Saves a copy of the open file and lets another process draw; waits, and ends it when `say` raises."""
    scratch = folder / "scratch"  # the worker's, which deletes it
    scratch.mkdir()
    blend = scratch / f"{Path(bpy.data.filepath).stem or 'unsaved'}.blend"
    (scratch / "job.json").write_text(json.dumps(job.plain()))
    arguments = ["--job", str(scratch / "job.json"), "--out", str(folder)]
    command, environment = reflect_command(blend, "draw-eevee", arguments)
    save_copy(blend)
    worker = Worker(command, scratch, environment, "EEVEE")
    try:
        while (state := worker.poll()).running:
            say(state.fraction, state.message)
            time.sleep(POLL)
    except BaseException:
        worker.stop()
        raise
    if state.error is not None:
        raise ReflectError(state.error.message, "Leave eevee out of --methods, or run it where OpenGL works.") from state.error
    return json.loads((folder / "said.json").read_text())


def _pictures(job: Job, said: dict, radiances: list[np.ndarray]) -> list[Picture]:
    return [
        Picture(setting, radiance, float(seconds), str(said["device"]), len(job.probes), tuple(said["replaced"]))
        for setting, radiance, seconds in zip(job.settings, radiances, said["seconds"], strict=True)
    ]


def _read(path: Path, job: Job, count: int) -> list[Picture] | None:
    """None when there is no such file, or it was cut short or damaged: drawing again repairs it."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            said = json.loads(stored["said"].tobytes())
            radiances = [stored[f"radiance{k}"] for k in range(len(job.settings))]
        pictures = _pictures(job, said, radiances)
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
        return None
    return pictures if all(p.radiance.shape == (count, 3) for p in pictures) else None
