"""Merging refuses what does not belong together, is not all there, or is damaged, in one sentence and before it writes anything."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from whole_and_parts import files_of

from reflect_addon.core.asset import Asset
from reflect_addon.core.asset_files import JSON_NAME, save_asset
from reflect_addon.core.errors import ReflectError
from reflect_addon.core.part_record import FILE_NAME, PartRecord, begin, finish
from reflect_addon.evaluation.merge import merge

UNITS = ("environment of A", "environment of B", "environment of C")
JOB = {"file": "a.blend 01", "scene's content": "ab", "settings": "", "Blender": "5.2", "Reflect": "1"}


def record(number: int, of: int = 3, **changes) -> PartRecord:
    made = UNITS[number - 1 : number]
    return replace(PartRecord("bake", f"{number}/{of}", JOB, UNITS, made, False, {}, (), ()), **changes)


def asset(name: str, value: float = 0.0, seconds: float = 0.0) -> Asset:
    return Asset("environment", name, {"map_tx": np.full((2, 2, 4), value, np.float16)}, bake_seconds=seconds)


def write(folder: Path, one: PartRecord, helper: float = 0.5) -> Path:
    """A part with the asset of its unit, and one that it needed for itself."""
    begin(one, folder)
    paths = [save_asset(asset("All", helper, one.number().index), folder / "environment-All")]
    own = [save_asset(asset(unit[-1], ord(unit[-1])), folder / f"environment-{unit[-1]}") for unit in one.made]
    finish(one, folder, [*paths, *own], own)
    return folder


@pytest.fixture
def three(tmp_path) -> list[Path]:
    return [write(tmp_path / str(k), record(k)) for k in (1, 2, 3)]


def refused(parts: list[Path], out: Path) -> str:
    with pytest.raises(ReflectError) as caught:
        merge(parts, out)
    assert not out.exists(), "nothing is written"
    assert caught.value.message.endswith(".") and caught.value.remedy.endswith(".")
    return caught.value.message


def test_any_order_and_only_what_is_owned(three, tmp_path):
    out = tmp_path / "all"
    merge([three[2], three[0], three[1]], out)
    assert sorted(path.name for path in out.iterdir()) == ["environment-A", "environment-B", "environment-C"]
    for folder, name in zip(three, "ABC", strict=True):
        assert files_of(out / f"environment-{name}") == files_of(folder / f"environment-{name}")
    before = files_of(out)
    merge(three, out)
    assert files_of(out) == before


def test_missing_and_doubled_parts(three, tmp_path):
    assert "3 is missing" in refused(three[:2], tmp_path / "out")
    assert "2, 3 are missing" in refused(three[:1], tmp_path / "out")
    again = write(tmp_path / "again", record(2))
    assert "Part 2/3 is there twice" in refused([*three, again], tmp_path / "out")
    assert "is there twice" in refused([three[0], three[0], three[1]], tmp_path / "out")


@pytest.mark.parametrize("what", sorted(JOB))
def test_parts_of_different_work(three, tmp_path, what):
    other = write(tmp_path / "other", record(3, job=JOB | {what: "another"}))
    said = refused([*three[:2], other], tmp_path / "out")
    assert f"their {what} differ" in said and str(other) in said and "another" in said


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"verb": "evaluate"}, "different verbs"),
        ({"part": "3/4"}, "different numbers of parts"),
        ({"units": UNITS[:2]}, "found other work"),
        ({"made": UNITS[:1]}, "made twice or not at all"),
    ],
)
def test_parts_that_do_not_fit(three, tmp_path, changes, words):
    assert words in refused([*three[:2], write(tmp_path / "other", record(3, **changes))], tmp_path / "out")


def test_machines_that_answer_differently(three, tmp_path):
    other = write(tmp_path / "other", record(3), helper=0.25)
    assert "environment-All: their machines answered differently" in refused([*three[:2], other], tmp_path / "out")


def test_what_is_no_finished_part(three, tmp_path):
    (tmp_path / "empty").mkdir()
    assert "There is no part in" in refused([*three[:2], tmp_path / "empty"], tmp_path / "out")
    begin(record(3), three[2])
    assert "The part 3/3" in refused(three, tmp_path / "out")


def test_damage_anywhere(three, tmp_path):
    """Every file of a part is cut short, changed, deleted: each is refused by its name."""
    for path in sorted(three[1].rglob("*")):
        if not path.is_file():
            continue
        good = path.read_bytes()
        for bad in (good[: len(good) // 2], b"", bytes([good[0] ^ 1]) + good[1:]):
            path.write_bytes(bad)
            assert str(path) in refused(three, tmp_path / "out")
        path.unlink()
        assert str(path if path.name != FILE_NAME else three[1]) in refused(three, tmp_path / "out")
        path.write_bytes(good)
    merge(three, tmp_path / "out")


def test_a_part_names_nothing_outside(three, tmp_path):
    path = three[1] / FILE_NAME
    whole = path.read_text()
    for name in ("../x", "/x", "C:/x", "", ".", "a/..", "a//b", "a\\b"):
        for field in ("owned", "replaces"):
            path.write_text(json.dumps(json.loads(whole) | {field: [name]}))
            assert "outside its folder" in refused(three, tmp_path / "out")


def test_the_result_is_no_part(three):
    with pytest.raises(ReflectError, match="is one of the parts"):
        merge(three, three[0])


def test_a_folder_is_one_parts_alone(three, tmp_path):
    begin(record(1), three[0])  # the same again
    with pytest.raises(ReflectError, match="holds part 1/3 of another bake"):
        begin(record(2), three[0])
    with pytest.raises(ReflectError, match="holds part 1/3 of another bake"):
        begin(record(1, job=JOB | {"settings": "samples=2"}), three[0])
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    with pytest.raises(ReflectError, match="holds other things than a part"):
        begin(record(1), tmp_path / "mine")
    assert (tmp_path / "mine" / "letter.txt").read_text() == "dear"


def test_an_asset_for_all_takes_the_place_of_those_for_each(three, tmp_path):
    out = tmp_path / "out"
    save_asset(asset("B"), out / "environment-B")
    save_asset(asset("Old"), out / "environment-Old")
    one = record(1, 1, units=UNITS[:1])
    begin(one, tmp_path / "one")
    path = save_asset(asset(""), tmp_path / "one" / "environment-all")
    finish(one, tmp_path / "one", [path], [path], ["environment-B"])
    merge([tmp_path / "one"], out)
    assert sorted(p.name for p in out.iterdir()) == ["environment-Old", "environment-all"] and (out / "environment-all" / JSON_NAME).is_file()
