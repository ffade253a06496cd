"""What must be equal, byte for byte, of a merged folder and of one that a single process made; and what is measured and so is not."""

import json
from pathlib import Path

from reflect_addon.core.asset_files import JSON_NAME
from reflect_addon.core.planning.plan import FILE_NAME as PLAN_NAME
from reflect_addon.evaluation.merge import TIMES
from reflect_addon.evaluation.rows import FILE_NAME


def files_of(folder: Path) -> dict[str, bytes]:
    """Path below the folder -> content."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def assert_same_assets(a: Path, b: Path) -> None:
    """All images to the byte, asset.json and a plan in all but their seconds."""
    a, b = _without_times(files_of(a)), _without_times(files_of(b))
    assert a.keys() == b.keys(), set(a) ^ set(b)
    assert len(a) > 1 and not [name for name in a if a[name] != b[name]]


def assert_same_results(a: Path, b: Path) -> None:
    """All pictures and the truth to the byte, results.json in all but what is measured."""
    a, b = files_of(a), files_of(b)
    assert a.keys() == b.keys(), set(a) ^ set(b)
    assert [name for name in a if a[name] != b[name]] in ([], [FILE_NAME])
    assert _rows(a[FILE_NAME]) == _rows(b[FILE_NAME])


def _rows(content: bytes) -> list[dict]:
    rows = [{k: v for k, v in row.items() if k not in TIMES} for row in json.loads(content)["rows"]]
    return [{**row, "counts": {k: v for k, v in row["counts"].items() if not k.endswith("_s")}} for row in rows]


def _without_times(files: dict[str, bytes]) -> dict[str, object]:
    times = {JSON_NAME: "bake_seconds", PLAN_NAME: "seconds"}
    return {n: {k: v for k, v in json.loads(c).items() if k != times[Path(n).name]} if Path(n).name in times else c for n, c in files.items()}
