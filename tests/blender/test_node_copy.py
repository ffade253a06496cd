"""Groups that are copies of others (scene/node_copy.py) are what the emitter makes from scratch, property for property."""

from dataclasses import replace

import bpy
import numpy as np
import pytest
from baked_methods import bake_all, scene_of_everything

from reflect_addon.core import methods
from reflect_addon.core.kernel import record_function
from reflect_addon.scene import kernel_nodes
from reflect_addon.scene.kernel_nodes import emit_nodes
from reflect_addon.scene.node_report import groups_of, images_of
from reflect_addon.scene.reflection_group import reflection_group


@pytest.fixture(scope="module")
def assets():
    return bake_all(scene_of_everything())


def other(asset):
    """An asset of the same options: other pixels in wider images, other numbers."""
    images = {name: np.concatenate([pixels, pixels[:, :8]], 1) * pixels.dtype.type(0.5) for name, pixels in asset.images.items() if pixels.dtype != np.uint8}
    numbers = {name: tuple(0.5 * v for v in value) if isinstance(value, tuple) else 0.5 * value for name, value in asset.uniforms.items() if name != "center"}
    return replace(asset, reflector="Other", images={**asset.images, **images}, uniforms={**asset.uniforms, **numbers})


def contents(tree):
    """All of a group and of what it calls, but for names of data-blocks."""
    groups, images = groups_of(tree), sorted(images_of(tree), key=lambda image: image.name)
    named = {**{group: k for k, group in enumerate(groups)}, **{image: k for k, image in enumerate(images)}}
    return [whole(group, named) for group in groups]


def whole(group, named):
    nodes = {node.as_pointer(): k for k, node in enumerate(group.nodes)}
    sockets = [(item.name, item.socket_type, item.in_out) for item in group.interface.items_tree]
    links = [(nodes[link.from_node.as_pointer()], link.from_socket.identifier, nodes[link.to_node.as_pointer()], link.to_socket.identifier) for link in group.links]
    return sockets, [single(node, nodes, named) for node in group.nodes], sorted(links)


def single(node, nodes, named):
    looks = [getattr(node, name, None) for name in ("operation", "interpolation", "extension", "noise_dimensions")]
    blocks = [named.get(getattr(node, name, None)) for name in ("image", "node_tree")]
    values = [tuple(np.ravel(s.default_value)) for s in (*node.inputs, *node.outputs) if hasattr(s, "default_value")]
    items = [(item.name, item.socket_type) for item in getattr(node, "repeat_items", ())]
    frame = node.parent and nodes[node.parent.as_pointer()]
    return node.bl_idname, node.label, tuple(node.location), frame, looks, blocks, values, items


@pytest.mark.parametrize("name", methods.gathering())
def test_a_copy_is_what_is_made_from_scratch(name, fresh_file, assets, monkeypatch):
    made = []
    monkeypatch.setattr(kernel_nodes, "TreeBuilder", lambda name, make=kernel_nodes.TreeBuilder: made.append(name) or make(name))
    asset, alike = assets[name], {}
    reflection_group(asset, "One", alike=alike)
    count = len(made)
    copied = reflection_group(other(asset), "Two", alike=alike)
    assert count > 1 and len(made) == count, "nothing was made anew"
    found = contents(copied)
    scratch = reflection_group(other(asset), "Three")
    assert len(made) == 2 * count - (1 if "Reflect Reflectance" in made else 0) and contents(scratch) == found


def test_what_is_unlike_is_made_from_scratch_and_copied_in_turn(fresh_file):
    """A second kernel of the same name with another operation, then a third as the first."""
    alike = {}

    def emit(operation, factor):
        def kernel(k, scope, a):
            return {"x": k.loop(3, (a,), lambda i, x: ((operation(x * factor, i),), None))[0]}

        return emit_nodes(record_function(kernel, {"a": "float"}), Empty, f"G {factor}", ("x",), alike=alike)

    first, second = emit(lambda x, i: x + i, 2.0), emit(lambda x, i: x - i, 3.0)
    before = len(bpy.data.node_groups)
    third, same = emit(lambda x, i: x - i, 4.0), emit(lambda x, i: x - i, 3.0)
    assert same == second and len({first, second, third}) == 3 and len(bpy.data.node_groups) == before + 1
    assert len(next(iter(alike.values()))) == 2


def test_a_kernel_with_more_groups_than_what_it_may_be_like(fresh_file):
    alike = {}

    def emit(steps):
        def kernel(k, scope, a):
            def body(i, x):
                for n in range(steps):
                    x = k.floor(x * (2.0 + n)) - i
                return (x,), None

            return {"x": k.loop(3, (a,), body)[0]}

        return emit_nodes(record_function(kernel, {"a": "float"}), Empty, f"G {steps}", ("x",), alike=alike)

    few, many = emit(1), emit(kernel_nodes.GROUP_FROM)
    assert len(groups_of(few)) == 1 and len(groups_of(many)) == 2 and len(next(iter(alike.values()))) == 2


class Empty:
    images, uniforms, options = {}, {}, {}
