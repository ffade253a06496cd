"""reflect-three without a browser: node's own tests, and what the package may not hold."""

import re

from node_package import PACKAGE, need_packages, node


def test_node_tests():
    need_packages()
    said = node("--test", *sorted(str(path) for path in (PACKAGE / "test").glob("*.test.js")))
    assert re.search(r"^# pass [1-9]", said, re.M) and "# fail 0" in said, said[-3000:]


def test_lock_names_no_host():
    """Where packages come from is the machine's own business."""
    assert "http" not in re.sub(r'"url": "[^"]*"', "", (PACKAGE / "package-lock.json").read_text())


def test_manifest_check_needs_nothing():
    """checkManifest and all that it imports, and nothing of three: a server may use it."""
    todo, seen = ["checkManifest.js"], set()
    while todo:
        name = todo.pop()
        seen.add(name)
        found = re.findall(r'from "([^"]+)"', (PACKAGE / "src" / name).read_text())
        assert all(path.startswith("./") for path in found), (name, found)
        todo += [path[2:] for path in found if path[2:] not in seen]
    assert len(seen) > 2


def test_no_text_becomes_code():
    for path in (PACKAGE / "src").glob("*.js"):
        assert not re.search(r"\beval\s*\(|\bFunction\s*\(|innerHTML|document\.write|setTimeout\(\s*[\"'`]", path.read_text()), path
