"""Our nodes in a material's tree, or in a copied group's: cloned from the artist's, fed by what feeds theirs.

Problem. What EEVEE draws must read the very textures, values and animation that the artist's shader reads, which stays there for Cycles.
Idea. A Sheet adds nodes beside the artist's, in one frame, each marked (native_marks.py). An input of ours is fed from an input of the artist's: by the same
link, or with the same value, noted as its twin so that animation follows (native_animation.py). Nothing of the artist's is changed.
"""

import bpy

from .native_animation import Twins, animated_paths
from .native_marks import OURS
from .sockets import Groups, Reducer

COLUMN, ROW = 240.0, 220.0  # spacing of nodes in the editor, px
FRAME = "Reflect: drawn by EEVEE"
COMMON = {prop.identifier for prop in bpy.types.Node.bl_rna.properties}
COVERED = "Coverage"  # output of a reflection group


class Sheet:
    """tree: a copy's; owner: the material around it, None for a group; path: the group nodes around it; group: what answers."""

    def __init__(self, tree: bpy.types.NodeTree, owner: bpy.types.ID | None, path: Groups, group: bpy.types.NodeTree):
        self.tree, self.owner, self.path, self.group = tree, owner, path, group
        self.twins: Twins = {}
        self.made: dict[tuple[str, str], bpy.types.NodeSocket] = {}  # shader output -> what stands for it
        self._animated = animated_paths(tree, owner)
        self._answers: dict[tuple, bpy.types.Node] = {}
        self._bottom = min((node.location_absolute.y - node.height for node in tree.nodes), default=0.0) - ROW
        self._frame = None
        self._rows: dict[int, int] = {}

    def node(self, kind: str, label: str = "", **properties) -> bpy.types.Node:
        if self._frame is None:
            self._frame = self._new("NodeFrame")
            self._frame.label = FRAME
        made = self._new(kind)
        made.parent, made.label = self._frame, label
        for name, value in properties.items():
            setattr(made, name, value)
        return made

    def _new(self, kind: str) -> bpy.types.Node:
        made = self.tree.nodes.new(kind)
        made[OURS] = True
        made.select = False
        return made

    def clone(self, node: bpy.types.Node, **values) -> bpy.types.Node:
        """The node again, with other values for some inputs (by name, blanks as underscores)."""
        made = self.node(node.bl_idname, node.label or node.name)
        for prop in node.bl_rna.properties:
            if prop.identifier not in COMMON and not prop.is_readonly:
                setattr(made, prop.identifier, getattr(node, prop.identifier))
        given = {name.replace("_", " "): value for name, value in values.items()}
        for old, new in zip(node.inputs, made.inputs):
            self.feed(new, given.get(old.name, old))
        return self.place(made)

    def feed(self, socket: bpy.types.NodeSocket, source) -> None:
        """source: an output, an input whose link or value is taken, a constant, or None for nothing."""
        if source is None:
            return
        if not isinstance(source, bpy.types.NodeSocket):
            return _set(socket, source)
        if not source.is_output and (output := feeding(source)) is None:
            if hasattr(source, "default_value") and hasattr(socket, "default_value"):
                _set(socket, source.default_value)
                self.twins.setdefault(value_path(source), []).append(value_path(socket))
            return
        self.tree.links.new(source if source.is_output else output, socket)

    def place(self, node: bpy.types.Node) -> bpy.types.Node:
        """Right of what feeds it, below the artist's nodes."""
        before = [link.from_node.location.x for s in node.inputs for link in s.links if OURS in link.from_node]
        node.location.x = max(before, default=-COLUMN) + COLUMN
        column = round(node.location.x / COLUMN)
        self._rows[column] = self._rows.get(column, -1) + 1
        node.location.y = self._bottom - ROW * self._rows[column]
        return node

    def op(self, kind: str, *sources, **properties) -> bpy.types.Node:
        """A node with its inputs fed in order."""
        made = self.node(kind, **properties)
        for socket, source in zip(made.inputs, sources):
            self.feed(socket, source)
        return self.place(made)

    def constant(self, socket: bpy.types.NodeSocket):
        """The input's value when nothing can change it, else None."""
        if feeding(socket) is not None or value_path(socket) in self._animated:
            return None
        value = socket.default_value
        return tuple(value) if hasattr(value, "__len__") else value

    def value(self, socket: bpy.types.NodeSocket) -> float:
        """What a float input has now, in the mean."""
        return float(Reducer().value(socket, self.path))

    def answer(self, normal: bpy.types.NodeSocket, roughness: bpy.types.NodeSocket) -> bpy.types.Node:
        """The reflection group asked with a normal and a roughness: one node for all lobes that ask the same, since EEVEE
        computes each again."""
        key = tuple(self._identity(s) for s in (normal, roughness))
        if key not in self._answers:
            made = self.node("ShaderNodeGroup", self.group.name, node_tree=self.group)
            if feeding(normal) is not None:  # an empty normal means the surface's own, in the group too
                self.feed(made.inputs["Normal"], normal)
            self.feed(made.inputs["Roughness"], roughness)
            self._answers[key] = self.place(made)
        return self._answers[key]

    def _identity(self, socket):
        if (output := feeding(socket)) is not None:
            return output.node.name, output.identifier
        held = value_path(socket) in self._animated
        return value_path(socket) if held else self.constant(socket)


def feeding(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """The output that an input is linked to, None without a link that counts."""
    return next((link.from_socket for link in socket.links if link.is_valid and not link.is_muted), None)


def value_path(socket: bpy.types.NodeSocket) -> str:
    """Of an input's value, as animation names it."""
    return f"{socket.path_from_id()}.default_value"


def covers_everything(group: bpy.types.NodeTree) -> bool:
    """Whether a reflection group answers every ray, as its kernel says without a look at the ray."""
    output = next(node for node in group.nodes if node.bl_idname == "NodeGroupOutput")
    source = feeding(output.inputs[COVERED])
    if source is None:
        return output.inputs[COVERED].default_value >= 1.0
    return source.node.bl_idname == "ShaderNodeGroup" and covers_everything(source.node.node_tree)


def _set(socket, value) -> None:
    size = len(socket.default_value) if hasattr(socket.default_value, "__len__") else 0
    if size:
        values = list(value) if hasattr(value, "__len__") else [value] * 3
        value = (values + [1.0])[:size]
    socket.default_value = value
