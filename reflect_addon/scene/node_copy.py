"""A node group made as a copy of one that is like it but for its images, nested groups and numbers.

Problem. Blender looks through a whole tree after each node, link and number that Python adds: a group of thousands of nodes takes seconds, and a scene may
have thirty reflectors that differ in their images and numbers alone.
Idea. The emitter says again what it said when it made the first one's tree, to one that writes nothing: each node, link and item of a zone must
be there already (else they are not alike), and only what differs is noted. In the end the tree is copied at once and what was noted is set; where
nothing was, the very same tree serves both.
"""

from collections.abc import Iterator

import bpy
import numpy as np

from .node_tree import Source, TreeBuilder

LABEL = 63  # letters of a label that Blender keeps


class Unlike(Exception):
    """The trees differ in more than images, nested groups and numbers."""


class TreeCopier(TreeBuilder):
    """A TreeBuilder whose nodes and sockets are those of `like` until the group ends; then `tree` is the new group, or `like`."""

    def __init__(self, name: str, like: bpy.types.NodeTree):
        self._name, self._like = name, like
        self._order = {node.as_pointer(): k for k, node in enumerate(like.nodes)}
        self._nodes: Iterator = iter(like.nodes)
        items = like.interface.items_tree
        self._items = {way: iter([item for item in items if item.in_out == way]) for way in ("INPUT", "OUTPUT")}
        self._linked = {link.to_socket.as_pointer(): link.from_socket.as_pointer() for link in like.links}
        self._blocks: list[tuple[int, str, bpy.types.ID]] = []  # node, property, data-block
        self._values: list[tuple[int, bool, int, float | tuple]] = []  # node, whether of an output, socket, value
        self._parts, self._sections = {}, {""}
        self.tree = None
        self.inputs = self.node("NodeGroupInput")

    def socket(self, name: str, kind: str, is_output: bool, default=None) -> None:
        item = next(self._items["OUTPUT" if is_output else "INPUT"], None)
        _must(item is not None and (item.name, item.socket_type) == (name, f"NodeSocket{kind}"))
        _must(default is None)

    def node(self, kind: str, label: str = "", **properties):
        node = next(self._nodes, None)
        _must(node is not None and node.bl_idname == kind and (node.label == label or node.label == label[:LABEL]))
        for name, value in properties.items():
            if getattr(node, name) != value:
                _must(isinstance(value, bpy.types.ID))
                self._blocks.append((self._order[node.as_pointer()], name, value))
        return node

    def section(self, text: str) -> None:
        if text not in self._sections:
            self._sections.add(text)
            self.node("NodeFrame", text)

    def plug(self, socket, source: Source) -> None:
        if isinstance(source, bpy.types.NodeSocket):
            _must(self._linked.pop(socket.as_pointer(), None) == source.as_pointer())
        else:
            super().plug(socket, source)

    def set(self, socket, value: float | tuple) -> None:
        _must(socket.as_pointer() not in self._linked)
        if not np.array_equal(np.ravel(socket.default_value), np.ravel(value).astype(np.float32)):
            sockets = socket.node.outputs if socket.is_output else socket.node.inputs
            place = next(k for k, other in enumerate(sockets) if other.as_pointer() == socket.as_pointer())
            self._values.append((self._order[socket.node.as_pointer()], socket.is_output, place, value))

    def finish(self, node):
        return node

    def pair(self, enter, leave, items: list[tuple[str, str]]) -> None:
        _must(enter.paired_output == leave and [item.socket_type for item in leave.repeat_items] == [kind for kind, _ in items])

    def end(self) -> None:
        _must(not self._linked and all(next(left, None) is None for left in (self._nodes, *self._items.values())))
        if not self._blocks and not self._values:
            self.tree = self._like
            return
        self.tree = self._like.copy()
        self.tree.name = self._name
        nodes = tuple(self.tree.nodes)
        for node, name, block in self._blocks:
            setattr(nodes[node], name, block)
        for node, is_output, place, value in self._values:
            (nodes[node].outputs if is_output else nodes[node].inputs)[place].default_value = value


def _must(is_like: bool) -> None:
    if not is_like:
        raise Unlike
