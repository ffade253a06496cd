"""The pictures beside a row: the frame, the truth, the answer and its errors, as files below the results' folder."""

import re
from pathlib import Path

import numpy as np

from . import maps
from .png import write_png


def placed(frame: np.ndarray, mask: np.ndarray, radiance: np.ndarray) -> np.ndarray:
    """The frame with the covered pixels replaced: mirror radiance, without Fresnel and tint, which are not judged."""
    out = frame.copy()
    out[mask] = np.nan_to_num(radiance, nan=0.0, posinf=0.0, neginf=0.0)
    return out


def frame_files(judged, out: Path) -> None:
    """Writes what all methods of a frame share. judged: judged.Judged."""
    files = _shared(judged)
    write_png(out / files["frame"], judged.look.apply(judged.truth.frame))
    write_png(out / files["truth"], judged.truth_picture)


def method_files(
    judged, name: str, picture: np.ndarray, out: Path, hit_error: np.ndarray | None = None, composite: np.ndarray | None = None
) -> dict[str, str]:
    """Writes a method's pictures; returns what each file shows -> its path below `out`.

    picture: (H, W, 3) display-encoded, the answer in the frame; hit_error: (N,) of the covered pixels, None when the
    method tells no hit points; composite: (H, W, 3) display-encoded.
    """
    mask = judged.ray_map.covered()
    made = {"answer": picture, "difference": maps.difference_map(picture, judged.truth_picture, mask)}
    if hit_error is not None:
        made["hit_error"] = maps.hit_error_map(hit_error, mask)
    if composite is not None:
        made["composite"] = composite
    files = _shared(judged)
    for what, image in made.items():
        files[what] = f"pictures/{_stem(judged)}-{_file_name(name)}-{what}.png"
        write_png(out / files[what], image)
    return files


def _shared(judged) -> dict[str, str]:
    return {what: f"pictures/{_stem(judged)}-{what}.png" for what in ("frame", "truth")}


def _stem(judged) -> str:
    size = f"{judged.camera.width}x{judged.camera.height}"
    return _file_name(f"{judged.scene}-{judged.camera_name}-{judged.snapshot.frame}-{size}-{judged.backend}")


def _file_name(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", text)
