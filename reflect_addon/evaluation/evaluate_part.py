"""An evaluation in independent parts: the unit is a method, and all read the same baked assets.

What every part needs it makes for itself: the truth, which is the same to the bit wherever it is traced, and the row of BASE, to which times are compared on the
machine that measured them. `merge` compares both, and so sees machines that answer differently. A part costs the truth beside its methods: where drawing and
comparing take less than tracing, more parts gain little.
"""

from pathlib import Path

import bpy

from ..core.part_record import PartRecord, begin, finish, folder_sum
from ..core.parts import Part, dealt
from ..core.progress import Progress
from ..scene.bake_part import job_of
from . import peer
from .evaluate import evaluate
from .frame import open_frame
from .rows import FILE_NAME, Row

BASE = "environment"
PEER_EFFORT = 8.0  # EEVEE's pictures, in a method's


def evaluate_part(
    scene: bpy.types.Scene, methods: tuple[str, ...], size: tuple[int, int], out: Path, part: Part, *, assets: Path, camera: str | None = None,
    frame: int | None = None, samples: int = 64, backend: str = "gpu", progress: Progress | None = None,
) -> list[Row]:  # fmt: skip
    """Evaluates the methods of one part into a folder that it has for itself and returns their rows, BASE's among them. Arguments as evaluate's, errors too, and
    begin's."""
    out, efforts = Path(out), [PEER_EFFORT if name == peer.NAME else 1.0 for name in methods]
    numbers = dealt(efforts, [[i] for i in range(len(methods))], part.of)
    mine = tuple(name for name, number in zip(methods, numbers, strict=True) if number == part.index)
    with open_frame(scene, frame) as snapshot:
        job = job_of(scene, snapshot) | {
            "methods": ", ".join(methods), "size": f"{size[0]}x{size[1]}", "camera": camera or "", "samples": str(samples), "backend": backend,
            "assets": folder_sum(assets),
        }  # fmt: skip
    record = PartRecord("evaluate", str(part), job, methods, mine, False, {}, (), ())
    begin(record, out)
    if not mine:
        finish(record, out, [], [])
        return []
    drawn = tuple(name for name in methods if name in (*mine, BASE))
    rows = evaluate(scene, drawn, size, out, camera=camera, frame=frame, samples=samples, backend=backend, assets=assets, progress=progress)
    truth = sorted((out / "truth").glob("*.npz"))
    pictures = [[out / path for path in row.pictures.values()] for row in rows]
    owned = [path for row, some in zip(rows, pictures, strict=True) if row.method in mine for path in some]
    finish(record, out, [out / FILE_NAME, *truth, *(path for some in pictures for path in some)], [*truth, *owned])
    return rows
