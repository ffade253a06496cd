"""results.json: one row per scene, camera, frame, size, method and setting. The table of the design, as a dataclass.

Format 1: {"format": 1, "rows": [...]}. None means "not measured", with the reason in the row's notes. Reading is
strict: a report must not quietly leave out or misread what somebody measured.
"""

import json
import math
import os
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path

from ..core.errors import ReflectError
from ..core.safe_write import write_whole

FORMAT = 1
FILE_NAME = "results.json"
SET_UP = {"screen_tracing": "tracing", "sphere_probe": "spheres", "box_probe": "box", "plane_probe": "planes"}  # settings of a peer's row
_LARGEST = 64 << 20  # bytes: a results.json of thousands of rows has a few; more is not one

Number = float | int | None


@dataclass(frozen=True)
class Row:
    """Radiance errors are scene-linear Rec.709 over reflector pixels; FLIP and SSIM of the view-transformed picture."""

    scene: str  # the .blend's name without its ending
    camera: str
    frame: int
    size: str  # "240x180", px
    method: str
    settings: dict  # of the bake, and samples and seed of the truth
    device: str  # gpu.platform's renderer and device type
    backend: str  # gpu.platform's backend ("OPENGL" ...), "NUMPY", or "EEVEE"
    blender: str
    pixels: int  # reflector pixels evaluated
    rmse: Number = None
    relmse: Number = None
    flip: Number = None
    ssim: Number = None
    floor_rmse: Number = None  # the truth against a second truth with another seed
    hit_p50: Number = None  # hit-point error / scene diagonal
    hit_p95: Number = None
    angle_p50: Number = None  # degrees, seen from the ray's origin
    angle_p95: Number = None
    false_hit: Number = None  # share of rays
    missed_hit: Number = None  # share of rays
    ms: Number = None  # reflection passes per frame, median after warm-up
    ms_spread: Number = None
    ms_vs_environment: Number = None  # ratio to `environment` in the same run
    bake_s: Number = None
    upload_ms: Number = None
    bytes: Number = None  # memory on the GPU
    counts: dict = field(default_factory=dict)  # deterministic work
    nonfinite: Number = None  # NaN or infinite values in the answer: 0
    # Beyond the design's table:
    median_relative: Number = None  # median relative difference of the radiance
    pictures: dict = field(default_factory=dict)  # what it shows -> file, relative to the folder of results.json
    notes: tuple[str, ...] = ()  # sentences: what was not measured and why, what was simplified


_OPTIONAL = {"median_relative", "pictures", "notes"}
_KINDS = {str: "a text", int: "a whole number", dict: "an object", tuple: "a list"}


def set_up_of(settings: dict) -> str:
    """What EEVEE's own picture is made by, in words: "tracing + spheres"."""
    return " + ".join(words for name, words in SET_UP.items() if settings.get(name)) or "nothing"


def is_software(device: str) -> bool:
    """Whether the device draws on the CPU. device: a row's `device`, with its `backend` where that is told too."""
    return any(word in device.lower() for word in ("software", "llvmpipe", "softpipe", "swiftshader", "numpy"))


def write_rows(rows: list[Row], folder: Path) -> Path:
    """Writes folder/results.json whole or not at all and returns its path. NaN and infinities become None."""
    path = Path(folder) / FILE_NAME
    data = {"format": FORMAT, "rows": [_plain(asdict(row)) for row in rows]}
    write_whole(path, (json.dumps(data, indent=1, allow_nan=False) + "\n").encode())
    return path


def read_rows(folder: Path) -> list[Row]:
    """The rows of a folder's results.json (or of the file itself). ReflectError naming the file and what is wrong."""
    path = Path(folder)
    path = path / FILE_NAME if os.path.isdir(path) else path
    try:
        if path.stat().st_size > _LARGEST:
            raise _bad(path, "is far too large to be one")
        data = json.loads(path.read_bytes().decode("utf-8"), parse_constant=_no_constant)
    except FileNotFoundError as error:
        raise ReflectError(
            f"There is no {path}.", "Make one with: ./dev reflect evaluate FILE.blend --methods all --size WxH --out DIR."
        ) from error
    except OSError as error:
        raise ReflectError(f"{path} cannot be read ({error.strerror}).", "Check the path and its permissions.") from error
    except (ValueError, RecursionError) as error:
        raise _bad(path, f"is not valid JSON ({error})") from error
    if not isinstance(data, dict) or not isinstance(data.get("rows"), list):
        raise _bad(path, 'is not an object with "format" and "rows"')
    if data.get("format") != FORMAT:
        newer = isinstance(data.get("format"), int) and data["format"] > FORMAT
        raise _bad(path, f"has format {data.get('format')!r}, not {FORMAT}", "Update Reflect." if newer else None)
    return [_row(path, number, values) for number, values in enumerate(data["rows"], 1)]


def _row(path: Path, number: int, values) -> Row:
    if not isinstance(values, dict):
        raise _bad(path, f"has a row {number} that is not an object")
    known = {f.name: f for f in fields(Row)}
    missing = known.keys() - values.keys() - _OPTIONAL
    unknown = values.keys() - known.keys()
    if missing or unknown:
        what = f"lacks {', '.join(sorted(missing))}" if missing else f"has unknown fields {', '.join(sorted(unknown))}"
        raise _bad(path, f"has a row {number} that {what}")
    values = {**values, "notes": tuple(values.get("notes", ()))}
    for name, value in values.items():
        kind = known[name].type
        if kind is Number:
            if not (value is None or isinstance(value, (int, float)) and not isinstance(value, bool)):
                raise _bad(path, f"has {name} {value!r} in row {number}; a number or null belongs there")
        elif not isinstance(value, kind if isinstance(kind, type) else tuple) or isinstance(value, bool):
            raise _bad(path, f"has {name} {value!r} in row {number}; {_KINDS.get(kind, 'a list')} belongs there")
    if not all(isinstance(n, str) for n in (*values["notes"], *values.get("pictures", {}).values())):
        raise _bad(path, f"has notes or pictures in row {number} that are not texts")
    return Row(**values)


def _plain(value):
    """JSON's own types: NumPy scalars unwrapped, NaN and infinities as None."""
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if value is None or isinstance(value, (str, bool)):
        return value
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _no_constant(text: str):
    raise ValueError(f"{text} is not JSON")


def _bad(path: Path, what: str, remedy: str | None = None) -> ReflectError:
    return ReflectError(f"{path} {what}.", remedy or "Measure again with ./dev reflect evaluate, or name another folder.")
