"""Materials whose shader would not link are refused with a sentence, and nothing of them stays."""

import pytest
from blender_dump import dump
from native_scene import apply, ball, principled
from test_native_materials import changed, file  # noqa: F401

from reflect_addon.core.errors import ReflectError
from reflect_addon.scene import node_uniforms
from reflect_addon.scene.node_tree import TreeBuilder
from reflect_addon.scene.node_uniforms import uniform_bytes


def test_groups_count_as_often_as_they_are_called(fresh_file):
    """What an operation does not use of its node counts, too; what is linked does not."""
    inner = TreeBuilder("inner")
    inner.socket("A", "Float", is_output=False)
    inner.socket("B", "Float", is_output=True)
    inner.results(inner.math("MULTIPLY", inner.inputs.outputs["A"], 0.5))
    assert uniform_bytes(inner.tree) == 4 + 4, "0.5 and the third input"
    outer = TreeBuilder("outer")
    value = outer.node("ShaderNodeValue").outputs[0]
    twice = [outer.group(inner.tree, value)[0] for _ in range(2)]
    assert uniform_bytes(outer.tree) == 4 + 2 * 8
    outer.vector("ADD", *twice)
    assert uniform_bytes(outer.tree) == 4 + 2 * 8 + 16 + 4, "a third vector and a scale"


def test_what_would_not_link_stays_as_it_is(file, monkeypatch):  # noqa: F811
    ball("Ball", principled("Metal", Metallic=1.0))
    before = dump()
    monkeypatch.setattr(node_uniforms, "MOST_BYTES", 1024)
    with pytest.raises(ReflectError, match="No material was changed") as refused:
        apply()
    sentence = refused.value.remedy
    assert "Metal: its shader would need" in sentence and "promise 1;" in sentence and "it stays as it is" in sentence
    assert changed(before, dump()) == []
