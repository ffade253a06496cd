"""What a finished part says of itself, so that `merge` can tell that parts belong together and are whole: part.json in the part's folder.

Problem. Parts are made by processes that know nothing of each other, on machines that may have another file, another version or a bad disk.
Idea. A part names all that decides its content (`job`), all units of the work, those it made, and a checksum of every file. It is written twice: at the
start, so that a folder is one part's alone and the same part can be begun again there after a kill, and at the end, which makes it a finished one.
"""

import hashlib
import json
import os
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path

from .errors import ReflectError
from .parts import Part
from .safe_read import read_bytes
from .safe_write import write_whole
from .typed_json import typed

FORMAT = 1
FILE_NAME = "part.json"
MAX_BYTES = 64 << 20  # of thousands of assets it has a few
AGAIN = "Make that part again, into the same folder."


@dataclass(frozen=True)
class PartRecord:
    verb: str  # "bake" or "evaluate"
    part: str  # "I/N"
    job: dict[str, str]  # what decides the content, by words for people -> its value: equal in all parts
    units: tuple[str, ...]  # all units of the work, in order; equal in all parts
    made: tuple[str, ...]  # those of this part
    done: bool
    files: dict[str, str]  # path below the part's folder -> sha256
    owned: tuple[str, ...]  # files and folders that the merged folder has from this part; others were needed to make them
    replaces: tuple[str, ...]  # folders of assets that an owned one takes the place of

    def number(self) -> Part:
        return Part.parse(self.part)


def begin(record: PartRecord, folder: Path) -> None:
    """Takes a folder for this part: one that is new or empty, or has the same part, finished or not. ReflectError where it holds anything else."""
    folder = Path(folder)
    if os.path.lexists(folder / FILE_NAME):
        there = _read(folder)
        if (there.verb, there.part, there.job, there.units) != (record.verb, record.part, record.job, record.units):
            raise ReflectError(f"{folder} holds part {there.part} of another {there.verb}.", "Name another folder with --out, or delete that one.")
    elif folder.is_dir() and any(folder.iterdir()):
        raise ReflectError(f"{folder} holds other things than a part.", "Name an empty folder or a new one with --out: a part has it for itself.")
    _write(replace(record, done=False, files={}, owned=(), replaces=()), folder)


def finish(record: PartRecord, folder: Path, paths: list[Path], owned: list[Path], replaces: list[str] = ()) -> PartRecord:
    """Ends the part whose files lie below these paths (files or folders in `folder`). Returns it as it was written."""
    folder = Path(folder)
    files = sorted(file for path in dict.fromkeys(paths) for file in ([path] if path.is_file() else path.rglob("*")) if file.is_file())
    sums = {file.relative_to(folder).as_posix(): file_sum(file) for file in files}
    names = tuple(dict.fromkeys(path.relative_to(folder).as_posix() for path in owned))
    record = replace(record, done=True, files=sums, owned=names, replaces=tuple(replaces))
    _write(record, folder)
    return record


def read_part(folder: Path) -> PartRecord:
    """The finished part in a folder, its files as it left them. ReflectError where there is none, or one of its files is missing or another."""
    folder = Path(folder)
    if not os.path.lexists(folder / FILE_NAME):
        raise ReflectError(f"There is no part in {folder}.", "Name folders that bake --part or evaluate --part wrote.")
    record = _read(folder)
    if not record.done:
        raise ReflectError(f"The part {record.part} in {folder} is not finished.", AGAIN)
    for name, known in record.files.items():
        if not (folder / name).is_file():
            raise ReflectError(f"{folder / name} is missing from the part {record.part}.", AGAIN)
        if file_sum(folder / name) != known:
            raise ReflectError(f"{folder / name} is damaged: it is not what the part {record.part} wrote.", AGAIN)
    return record


def file_sum(path: Path) -> str:
    """sha256 of a file."""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise ReflectError(f"{path} cannot be read ({error.strerror or error}).", "Check its permissions.") from error


def folder_sum(folder: Path) -> str:
    """sha256 of all files below a folder and their names."""
    names = sorted(path.relative_to(folder).as_posix() for path in Path(folder).rglob("*") if path.is_file())
    return hashlib.sha256("\n".join(f"{name}\0{file_sum(Path(folder) / name)}" for name in names).encode("utf-8", "surrogatepass")).hexdigest()


@cache
def version() -> str:
    """Of this Reflect: a hash of its own sources, since two checkouts may share a number and bake other bits."""
    package = Path(__file__).resolve().parents[1]
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*")):
        if path.suffix in {".py", ".glsl", ".osl"}:
            digest.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def _write(record: PartRecord, folder: Path) -> None:
    write_whole(folder / FILE_NAME, (json.dumps({"what": "reflect part", "format": FORMAT, **asdict(record)}, indent=1) + "\n").encode())


def _read(folder: Path) -> PartRecord:
    path = folder / FILE_NAME
    try:
        document = json.loads(bytes(read_bytes(path, MAX_BYTES, remedy=AGAIN)))
        if not isinstance(document, dict) or document.pop("what", None) != "reflect part":
            raise ValueError("it is no part")
        if (found := document.pop("format", None)) != FORMAT:
            raise ValueError(f"its format is {found!r}, not {FORMAT}")
        record = typed(PartRecord, document, "part")
        record.number()
        names = (*record.files, *record.owned, *record.replaces)
        # Below its folder, and never the folder itself: what parts replace is deleted.
        if any(":" in name or "\\" in name or not all(part.strip(".") for part in name.split("/")) for name in names):
            raise ValueError("it names files outside its folder")
    except (ValueError, RecursionError) as error:
        raise ReflectError(f"{path} is damaged: {error}.", AGAIN) from error
    return record
