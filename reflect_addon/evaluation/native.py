"""What our node groups answer in EEVEE, pixel by pixel: read back from the outputs that scene/native_draw.py gives their materials."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.processes import temporary_folder
from ..core.rays import Answer, RayMap
from ..core.spaces import FAR, STATUS_HIT, STATUS_NONE
from ..scene.eevee_job import Job
from ..scene.exr import read_exr, stacked
from ..scene.native_draw import FLAGS, MOST, RADIANCE, WAY
from .peer import Picture, nothing, pictures_in


@dataclass(frozen=True)
class Drawn:
    """One method as node groups. error: the sentence why there are none, and then nothing else."""

    method: str
    error: str | None
    answer: Answer | None  # of the ray map's covered pixels in row order
    told: dict  # plain: eevee_draw's Timed without EEVEE's ray tracing; fewer, traced: seconds and busy by Job.fewer samples, with tracing; None where not timed; nodes, look_ups, images, image_bytes, groups
    notes: tuple[str, ...]
    device: str


def draw(job: Job, ray_map: RayMap, apart: Callable[[Job, Path], dict]) -> tuple[list[Picture], list[Drawn]]:
    """EEVEE's own pictures and ours, from one process. apart(job, folder) is draw_apart, bound."""
    mask = ray_map.covered()
    if not mask.any():
        none = [Drawn(g.method, "No reflector is seen: there is nothing to draw.", None, {}, (), "nothing was drawn") for g in job.groups]
        return nothing(job), none
    with temporary_folder("reflect-eevee-") as folder:
        said = apart(job, folder)
        pictures = pictures_in(job, said, folder, mask) if job.settings else []
        return pictures, [_drawn(job, said, told, folder / f"group{k}.exr", ray_map) for k, told in enumerate(said["groups"])]


def _drawn(job: Job, said: dict, told: dict, path: Path, ray_map: RayMap) -> Drawn:
    notes, answer = list(told["notes"]), None
    if told["error"] is None:
        answer, missing = answer_in(read_exr(path), ray_map, job.diagonal)
        if missing:
            notes.append(f"{missing} of {len(answer.radiance)} pixels show no group of ours: EEVEE draws something else there, or nothing answers.")
    return Drawn(told["method"], told["error"], answer, told, tuple(notes), str(said["device"]))


def answer_in(channels: dict[str, np.ndarray], ray_map: RayMap, diagonal: float) -> tuple[Answer, int]:
    """(the answers of the covered pixels, how many of them have none)."""
    mask, rays = ray_map.covered(), ray_map.rays()
    # Outputs of a material are no colours: nothing converts them, and the file's are scene-linear as the group gives them.
    radiance = stacked(channels, RADIANCE, "RGB")[mask].astype(np.float32)
    way = stacked(channels, WAY, "RGB")[mask].astype(np.float64)
    coverage, there = channels[f"{FLAGS}.R"][mask], channels[f"{FLAGS}.G"][mask] > 0.5
    length = np.linalg.norm(way, axis=-1, keepdims=True)
    position = rays.origin + way * np.where(length < MOST / 2, diagonal, FAR / np.maximum(length, 1.0))
    status = np.where(there, STATUS_HIT, STATUS_NONE).astype(np.float32)
    return Answer(radiance, np.where(there, coverage, 0.0).astype(np.float32), position.astype(np.float32), status), int((~there).sum())
