"""A peer to compare with: EEVEE's own picture of the frame, by screen tracing and light probes, against the same truth.

EEVEE answers pixels, not rays, so a reflector's pixels are compared one by one: its "specular light" there (mirror
radiance before Fresnel and tint, see scene/peer_materials.py) against the truth of the pixel's ray. It tells no hit points
and has no reflection pass that could be timed apart, so those numbers stay empty and a sentence says why.

Which set-up wins differs by scene, so there is a row for each (SETTINGS and what the scene has: a room, planar mirrors). A picture takes
software OpenGL many seconds. It is drawn by another process, on a copy of the file, and kept in a folder under a hash of everything that it
depends on.
"""

import hashlib
import io
import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from .. import scene as scene_package
from ..core.camera import Camera
from ..core.processes import temporary_folder
from ..core.rays import RayMap
from ..core.safe_write import write_whole
from ..core.snapshot import SceneSnapshot
from ..scene.eevee_job import Job
from ..scene.exr import read_exr, stacked
from ..scene.raytrace import to_rec709
from . import peer_places

NAME = "eevee"
FORMAT = 2
OFF = {"screen_tracing": False, "sphere_probe": False, "box_probe": False, "plane_probe": False}
SETTINGS = (
    OFF | {"screen_tracing": True, "sphere_probe": True},
    OFF | {"screen_tracing": True},
    OFF | {"sphere_probe": True},
)  # fmt: skip
OF_A_ROOM = (OFF | {"screen_tracing": True, "box_probe": True}, OFF | {"box_probe": True})
OF_PLANES = OFF | {"screen_tracing": True, "plane_probe": True}  # with the sphere probes, or the room's
TIMES = ("compile", "seconds", "busy", "sample")  # scene/eevee_draw.py's Timed
SAMPLES = 16
PROBE_SIDE = 512  # texels of a cube face
DRAWS = ("eevee_draw.py", "eevee_job.py", "peer_probes.py", "peer_materials.py", "ray_scene.py")  # how it is drawn


@dataclass(frozen=True)
class Picture:
    """One of EEVEE's pictures."""

    setting: dict
    radiance: np.ndarray  # (N, 3) float32, linear Rec.709: of the ray map's covered pixels in row order
    times: dict[str, float]  # scene/eevee_draw.py's Timed
    set_up: float  # s, of the volume probe's bake
    device: str
    probes: dict[str, int]  # how many of each kind are shown
    volume: bool  # whether a volume probe brought light by way of other surfaces
    replaced: tuple[str, ...]  # materials that were replaced by a white mirror

    def notes(self) -> list[str]:
        """What the row's numbers are and are not, in sentences."""
        words = {"SPHERE": "sphere probe", "BOX": "room-shaped probe", "PLANE": "plane probe"}
        shown = " and ".join(f"{n} {words[kind]}{'' if n == 1 else 's'}" for kind, n in self.probes.items() if n) or "no probe"
        how = "screen tracing at full resolution" if self.setting["screen_tracing"] else "no tracing"
        out = [
            f"EEVEE's specular light, before Fresnel and tint, by {how} with {shown}{', and a baked volume probe for light by way of other surfaces' if self.volume else ''}. "
            "Shiny materials kept their look but lost roughness, anisotropy and normal maps, as the judged rays do; no sun was made of "
            "the world's brightest spot.",
            f"EEVEE tells no hit points and has no reflection pass to time apart: its whole frame took {self.times['seconds']:.1f} s "
            f"({self.times['busy']:.1f} s of CPU), after {self.times['compile']:.1f} s of compiling"
            f"{f' and {self.set_up:.1f} s for the volume probe' if self.volume else ''}.",
        ]
        if self.replaced:
            out.append(
                f"A white mirror stood for {', '.join(self.replaced)} (several layers, refraction, or marked by hand), also "
                "where other reflectors show it."
            )
        return out


def job_of(scene: bpy.types.Scene, camera_name: str, camera: Camera, snapshot: SceneSnapshot, ray_map: RayMap) -> Job:
    """What EEVEE is asked to draw: where probes go and which materials and objects reflect."""
    reflectors = snapshot.reflectors()
    pixels = np.bincount(ray_map.reflector[ray_map.covered()], minlength=len(reflectors))
    probes, hidden = peer_places.spheres(snapshot, pixels)
    settings = SETTINGS
    room = peer_places.room(snapshot, [i.object_name for i in reflectors]) if pixels.any() else None
    if room is not None:
        probes, settings = [*probes, room], (*settings, *OF_A_ROOM)
    if planes := peer_places.planes(snapshot, camera, pixels):
        probes, settings = [*probes, *planes], (*settings, OF_PLANES | {"sphere_probe": room is None, "box_probe": room is not None})
    materials, marked = {}, {}
    for instance in reflectors:
        shiny = [snapshot.materials[m].name for m in instance.materials if snapshot.materials[m].is_reflector]
        materials.update(dict.fromkeys(shiny))
        if not shiny:
            marked[instance.object_name] = None
    return Job(
        scene.name, camera_name, snapshot.frame, (camera.width, camera.height), SAMPLES, PROBE_SIDE, tuple(materials),
        tuple(marked), tuple(hidden), tuple(probes), settings, diagonal=snapshot.diagonal(), volume=room is not None,
    )  # fmt: skip


def key_of(job: Job, camera: Camera, ray_map: RayMap, geometry_hash: str, look_of_scene: str, blender: str) -> str:
    """Name of the kept pictures: hex digits of a sha256 over all that they depend on."""
    digest = hashlib.sha256(json.dumps([FORMAT, job.plain(), geometry_hash, look_of_scene, blender]).encode())
    for name in DRAWS:
        digest.update(Path(scene_package.__file__).with_name(name).read_bytes())
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
        return nothing(job)
    with temporary_folder("reflect-eevee-") as folder:
        said = draw(job, folder)
        pictures = pictures_in(job, said, folder, mask)
    if kept is not None:
        content = io.BytesIO()
        words = np.frombuffer(json.dumps(said).encode(), np.uint8)
        np.savez(content, said=words, **{f"radiance{k}": p.radiance for k, p in enumerate(pictures)})
        write_whole(kept, content.getvalue())
    return pictures


def pictures_in(job: Job, said: dict, folder: Path, mask: np.ndarray) -> list[Picture]:
    """Those that lie in the folder; said: what the process that drew told."""
    channels = [read_exr(folder / f"picture{k}.exr") for k in range(len(job.settings))]
    return _pictures(job, said, [to_rec709(stacked(c, "Glossy Direct", "RGB")[mask]).astype(np.float32) for c in channels])


def nothing(job: Job) -> list[Picture]:
    """Pictures of no pixel, which need no drawing."""
    time = dict.fromkeys(TIMES, 0.0)
    said = {"replaced": [], "times": [time] * len(job.settings), "device": "nothing was drawn", "set_up": 0.0}
    return _pictures(job, said, [np.zeros((0, 3), np.float32)] * len(job.settings))


def _pictures(job: Job, said: dict, radiances: list[np.ndarray]) -> list[Picture]:
    counts = {kind: sum(p.kind == kind for p in job.probes) for kind in ("SPHERE", "BOX", "PLANE")}
    return [
        Picture(
            setting, radiance, {name: float(time[name]) for name in TIMES}, float(said["set_up"]), str(said["device"]),
            {kind: counts[kind] if setting[f"{kind.lower()}_probe"] else 0 for kind in counts}, job.volume, tuple(said["replaced"]),
        )
        for setting, radiance, time in zip(job.settings, radiances, said["times"], strict=True)
    ]  # fmt: skip


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
