"""The parts of a bake or an evaluation put together: byte for byte what one process would have made, but for times, which are those of who measured them.

Everything is checked before anything is written: that all parts are there, once, of one job, and undamaged; and that machines answer alike: what several parts
made for themselves (assets that others require, the truth of a frame, the base's row) must be the same in all of them. Then assets appear whole, one by one, as a
bake's do, and pictures before the results.json that names them.
"""

import json
import shutil
from dataclasses import asdict
from pathlib import Path

from ..core.asset_files import JSON_NAME, copy_asset
from ..core.bake_lock import BakeLock
from ..core.errors import ReflectError
from ..core.part_record import PartRecord, read_part
from ..core.planning.plan import FILE_NAME as PLAN_NAME
from ..core.safe_write import check_folder, write_whole
from .rows import FILE_NAME as RESULTS
from .rows import Row, read_rows, write_rows

ALIKE = "Make all parts on machines with the same kind of processor, the same Blender and the same device."
TIMES = ("ms", "ms_spread", "ms_vs_environment", "upload_ms", "bake_s", "device")  # of a row: measured, and where
Parts = list[tuple[Path, PartRecord]]


def merge(folders: list[Path], out: Path) -> list[Path]:
    """Puts the parts in these folders, in any order, together in `out`; returns what a bake or evaluate would have: the assets' folders, or results.json.

    ReflectError, and nothing written, where parts are missing, doubled, damaged or not of one work, or `out` is one of them or cannot be written."""
    parts = _checked([(Path(folder), read_part(folder)) for folder in folders])
    if any(Path(out).resolve() == folder.resolve() for folder, _ in parts):
        raise ReflectError(f"{out} is one of the parts.", "Name another folder with --out.")
    _check_alike(parts)
    rows = _rows_of(parts) if parts[0][1].verb == "evaluate" else []
    check_folder(out)
    return [_merge_evaluation(parts, rows, Path(out))] if parts[0][1].verb == "evaluate" else _merge_bake(parts, Path(out))


def _checked(parts: Parts) -> Parts:
    """In the order of their numbers."""
    for other in parts[1:]:
        _check_same_work(parts[0], other)
    of, seen = parts[0][1].number().of, {}
    for folder, record in parts:
        if (number := record.number().index) in seen:
            raise ReflectError(f"Part {record.part} is there twice: in {seen[number]} and in {folder}.", "Name each part once.")
        seen[number] = folder
    if missing := [str(k) for k in range(1, of + 1) if k not in seen]:
        are, them = ("is", "it") if len(missing) == 1 else ("are", "them")
        raise ReflectError(f"Of {of} parts {', '.join(missing)} {are} missing.", f"Make {them} with --part I/{of}, then merge all.")
    if sorted(unit for _, record in parts for unit in record.made) != sorted(parts[0][1].units):
        raise ReflectError("The parts do not share their work: something was made twice or not at all.", ALIKE)
    return sorted(parts, key=lambda one: one[1].number().index)


def _check_same_work(one: tuple[Path, PartRecord], other: tuple[Path, PartRecord]) -> None:
    (first_folder, first), (folder, record) = one, other
    for what, a, b in (("verbs", record.verb, first.verb), ("numbers of parts", record.number().of, first.number().of)):
        if a != b:
            raise ReflectError(f"{folder} and {first_folder} are parts of different {what}: {a} and {b}.", "Name the parts of one work.")
    for what in sorted({*record.job, *first.job}):
        a, b = record.job.get(what, ""), first.job.get(what, "")
        if a != b:
            raise ReflectError(
                f"{folder} and {first_folder} are parts of different work: their {what} differ ({a or 'none'}; {b or 'none'}).",
                "Make all parts from the same file, with the same command and the same versions.",
            )
    if record.units != first.units:
        raise ReflectError(f"{folder} and {first_folder} found other work in the same file.", ALIKE)


def _check_alike(parts: Parts) -> None:
    """What several parts made must be the same, but for asset.json and results.json, which hold times. Of an asset its images, whose
    names say what is in them."""
    known: dict[str, tuple[object, Path]] = {}
    for folder, record in parts:
        sums: dict[str, object] = {}
        for name, total in record.files.items():
            path, _, file = name.rpartition("/")
            if f"{path}/{JSON_NAME}" in record.files:
                sums[path] = sums.get(path, frozenset()) | ({name} if file != JSON_NAME else set())
            elif name != RESULTS:
                sums[name] = total
        for name, total in sums.items():
            if known.setdefault(name, (total, folder))[0] != total:
                raise ReflectError(f"{folder} and {known[name][1]} have a different {name}: their machines answered differently.", ALIKE)


def _merge_bake(parts: Parts, out: Path) -> list[Path]:
    with BakeLock(out):
        for folder, record in parts:
            for name in record.files:
                path, _, file = name.rpartition("/")
                if not any(path == own or path.startswith(f"{own}/") for own in record.owned):
                    continue
                if file == JSON_NAME:
                    copy_asset(folder / path, out / path)
                elif file == PLAN_NAME:
                    write_whole(out / name, (folder / name).read_bytes())
            for name in record.replaces:  # one asset is for all from now on
                if (out / name / JSON_NAME).is_file():
                    shutil.rmtree(out / name, ignore_errors=True)
    return [out / name for _, record in parts for name in record.owned]


def _merge_evaluation(parts: Parts, rows: list[Row], out: Path) -> Path:
    for folder, record in parts:
        for name in record.owned:
            write_whole(out / name, (folder / name).read_bytes())
    return write_rows(rows, out)


def _rows_of(parts: Parts) -> list[Row]:
    """The rows of all parts, in the order of the whole. ReflectError where parts have different ones of the same."""
    rows: dict[str, list[Row]] = {}
    known: dict[str, tuple[dict, Path]] = {}
    for folder, record in parts:
        for row in read_rows(folder) if RESULTS in record.files else ():
            exact = {k: v for k, v in asdict(row).items() if k not in TIMES}
            exact["counts"] = {k: v for k, v in row.counts.items() if not k.endswith("_s")}
            key = json.dumps([row.method, row.settings], sort_keys=True)
            if known.setdefault(key, (exact, folder))[0] != exact:
                raise ReflectError(f"{folder} and {known[key][1]} have different results of {row.method}: their machines answered differently.", ALIKE)
            if row.method in record.made:
                rows.setdefault(row.method, []).append(row)
    return [row for method in parts[0][1].units for row in rows.get(method, [])]
