"""Assets that were spoiled on disk: whatever is wrong is a sentence."""

import hashlib
import json
import os
import shutil
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from spoiled_assets import refuses
from test_asset_files import edit, example

from reflect_addon.core.asset_files import load_asset, save_asset
from reflect_addon.core.errors import ReflectError


def _set_part(**values):
    return lambda folder: edit(folder, lambda d: d["parts"][1].update(values))


def image_file(folder: Path) -> Path:
    return next(folder.glob("quads_buf-*.npy"))


def _link_out(folder):
    target = folder.parent / "outside.npy"
    image_file(folder).rename(target)
    (folder / json.loads((folder / "asset.json").read_text())["arrays"]["quads_buf"]["file"]).symlink_to(target)


def _set_entry(**values):
    return lambda folder: edit(folder, lambda d: d["arrays"]["quads_buf"].update(values))


WRONG = {
    "no folder": (lambda f: shutil.rmtree(f), "missing"),
    "no json": (lambda f: (f / "asset.json").unlink(), "missing"),
    "no image": (lambda f: image_file(f).unlink(), "missing"),
    "empty json": (lambda f: (f / "asset.json").write_text(""), "not valid JSON"),
    "binary json": (lambda f: (f / "asset.json").write_bytes(b"\xff\x00" * 50), "not valid JSON"),
    "deep json": (lambda f: (f / "asset.json").write_text("[" * 100000), "not valid JSON"),
    "deep settings": (lambda f: edit(f, lambda d: d["settings"].update(sizes=json.loads("[" * 400 + "]" * 400))), "too deeply"),
    "deep tables": (lambda f: edit(f, lambda d: d["settings"].update(a=json.loads('{"a":' * 400 + "1" + "}" * 400))), "too deeply"),
    "huge number": (lambda f: (f / "asset.json").write_text('{"format": ' + "9" * 9000 + "}"), "not valid JSON"),
    "huge json": (lambda f: os.truncate(f / "asset.json", 5 << 20), "too large"),
    "foreign json": (lambda f: (f / "asset.json").write_text('{"asset": {"version": "2.0"}}'), "not a Reflect asset"),
    "newer": (lambda f: edit(f, lambda d: d.update(format=2)), "newer Reflect"),
    "older": (lambda f: edit(f, lambda d: d.update(format=0)), "no valid format"),
    "NaN": (lambda f: edit(f, lambda d: d["uniforms"].update(scale=float("nan"))), "JSON"),
    "overflow": (lambda f: edit(f, lambda d: d["uniforms"].update(scale=10**400)), "uniform"),
    "uniform of text": (lambda f: edit(f, lambda d: d["uniforms"].update(scale="1")), "uniform"),
    "kind": (lambda f: edit(f, lambda d: d.update(kind="../x")), "kind"),
    "parts of text": (lambda f: edit(f, lambda d: d.update(parts="all")), "parts"),
    "a part of nothing": (lambda f: edit(f, lambda d: d["parts"].append({})), "parts"),
    "a part too many": (_set_part(more=1), "parts"),
    "a part's row": (_set_part(row=10**6), "parts"),
    "a part's row of text": (_set_part(row="0"), "parts"),
    "a part's row of truth": (_set_part(row=True), "parts"),
    "a part's place": (_set_part(world_from_object=[1, 0, 0]), "parts"),
    "a part's far place": (_set_part(world_from_object=[10**400] * 16), "parts"),
    "a part's kind": (_set_part(kind="../x"), "parts"),
    "a part's mesh": (_set_part(mesh=None), "parts"),
    "light": (lambda f: edit(f, lambda d: d.update(light_hash=[])), "light_hash"),
    "items of text": (lambda f: edit(f, lambda d: d.update(items="all")), "items"),
    "items' aspect": (lambda f: edit(f, lambda d: d["items"].update({"../x": {}})), "items"),
    "an item's list": (lambda f: edit(f, lambda d: d["items"].update(shape=["a"])), "items"),
    "an item's hash": (lambda f: edit(f, lambda d: d["items"]["shape"].update(Suzanne=7)), "items"),
    "an item's long hash": (lambda f: edit(f, lambda d: d["items"]["shape"].update(Suzanne="a" * 65)), "items"),
    "balls of a list": (lambda f: edit(f, lambda d: d.update(balls=[1, 2])), "balls"),
    "a ball without a size": (lambda f: edit(f, lambda d: d["balls"].update(Suzanne=[0, 0, 0])), "balls"),
    "a ball inside out": (lambda f: edit(f, lambda d: d["balls"].update(Suzanne=[0, 0, 0, -1])), "balls"),
    "a far ball": (lambda f: edit(f, lambda d: d["balls"].update(Suzanne=[10**400, 0, 0, 1])), "balls"),
    "no table": (lambda f: edit(f, lambda d: d.pop("arrays")), "table of arrays"),
    "path out": (_set_entry(file="../outside.npy"), "inside the folder"),
    "absolute path": (_set_entry(file="/etc/passwd"), "inside the folder"),
    "link out": (_link_out, "leaves its folder"),
    "huge shape": (_set_entry(shape=[10**9, 10**9, 4]), "shape"),
    "large shape": (_set_entry(shape=[8192, 8192, 4]), "cut short"),
    "too much": (lambda f: [_set_entry(shape=[16384, 16384, 4])(f),
                            edit(f, lambda d: d["arrays"].update(b_buf=d["arrays"]["quads_buf"]))], "GiB"),
    "negative shape": (_set_entry(shape=[-5, -3, 4]), "shape"),
    "other shape": (_set_entry(shape=[3, 5, 4]), "values"),
    "channels": (_set_entry(shape=[5, 4, 3]), "channels"),
    "object type": (_set_entry(dtype="object"), "type"),
    "truncated": (lambda f: os.truncate(image_file(f), 200), "cut short"),
    "longer": (lambda f: os.truncate(image_file(f), 5000), "too large"),
    "flipped bit": (lambda f: image_file(f).write_bytes(image_file(f).read_bytes()[:-1] + b"\x55"), "checksum"),
    "folder for image": (lambda f: [image_file(f).rename(f / "old"), (f / _name(f)).mkdir()], "not a file"),
}


def _name(folder):
    return json.loads((folder / "asset.json").read_text())["arrays"]["quads_buf"]["file"]


@pytest.mark.parametrize("case", WRONG)
def test_wrong_files_get_a_sentence(tmp_path, case):
    folder = save_asset(example(), tmp_path / "a")
    spoil, words = WRONG[case]
    spoil(folder)
    refuses(folder, words)


def test_a_pipe_does_not_hang(tmp_path):
    folder = save_asset(example(), tmp_path / "a")
    name = _name(folder)
    (folder / name).unlink()
    os.mkfifo(folder / name)
    with pytest.raises(ReflectError, match="not a file"):
        load_asset(folder)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    return save_asset(example(), tmp_path_factory.mktemp("fuzz") / "a")


@settings(max_examples=300, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_changed_bytes_give_a_sentence_or_the_same_asset(saved, data):
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(shutil.copytree(saved, Path(scratch) / "a"))
        path = data.draw(st.sampled_from(sorted(folder.iterdir())))
        content = bytearray(path.read_bytes())
        for _ in range(data.draw(st.integers(1, 4))):
            at = data.draw(st.integers(0, len(content) - 1))
            match data.draw(st.sampled_from(["set", "cut", "insert", "swap"])):
                case "set":
                    content[at] = data.draw(st.integers(0, 255))
                case "cut":
                    del content[at : at + data.draw(st.integers(1, 40))]
                case "insert":
                    content[at:at] = data.draw(st.sampled_from([b"0", b"null", b"-", b"]", b"1e999", b'"', b"\xff", b"9" * 30]))
                case "swap":
                    content[at : at + 1] = data.draw(st.sampled_from([b"null", b"[]", b"{}", b"true", b'""']))
            if not content:
                break
        path.write_bytes(content)
        try:
            loaded = load_asset(folder)
        except ReflectError:
            return
        for name, array in example().images.items():  # asset.json's own numbers and words may change, checked ones only
            if name in loaded.images:
                np.testing.assert_array_equal(loaded.images[name], array)


@settings(max_examples=200, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_a_forged_checksum_does_not_help(saved, data):
    """Someone who writes the checksum too can change values, but cause no other error than a sentence."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(shutil.copytree(saved, Path(scratch) / "a"))
        path = image_file(folder)
        content = bytearray(path.read_bytes())
        at = data.draw(st.integers(0, 130))
        content[at] = data.draw(st.integers(0, 255))
        path.write_bytes(content)
        _set_entry(sha256=hashlib.sha256(content).hexdigest())(folder)
        try:
            assert load_asset(folder).images["quads_buf"].shape == (5, 3, 4)
        except ReflectError:
            pass
