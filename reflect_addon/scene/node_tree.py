"""Short-hand for building a shader node group: constants plug into sockets, sockets link, columns lay themselves out.

Blender looks through a whole tree after each change of it, a node's place included, so places are kept here and set all at once.
"""

import bpy

COLUMN, ROW = 190.0, 150.0  # spacing of nodes in the editor, px

Source = object  # a NodeSocket, a float, or a tuple of 3 floats


class TreeBuilder:
    """Adds nodes to one group. Every method returns output sockets, every operand is a Source."""

    def __init__(self, name: str):
        self.tree = bpy.data.node_groups.new(name, "ShaderNodeTree")
        self._parts: dict[str, tuple] = {}
        self._rows: dict[int, int] = {}
        self._places: dict[int, list[float]] = {}  # of nodes, by their addresses: x, y
        self._frames: dict[str, object] = {"": None}
        self._frame, self._first = None, 0  # what the nodes to come stand in, and its first column
        self.inputs = self.node("NodeGroupInput")

    def socket(self, name: str, kind: str, is_output: bool, default=None) -> None:
        """kind: 'Float' | 'Vector' | 'Color' | 'Shader'; default: of an input, None = zeros."""
        direction = "OUTPUT" if is_output else "INPUT"
        made = self.tree.interface.new_socket(name=name, in_out=direction, socket_type=f"NodeSocket{kind}")
        if default is not None:
            made.default_value = default

    def node(self, kind: str, label: str = "", **properties):
        made = self.tree.nodes.new(kind)
        made.label = label
        self._places[made.as_pointer()] = [self._first * COLUMN, 0.0]
        made.parent = self._frame
        for name, value in properties.items():
            if getattr(made, name) != value:
                setattr(made, name, value)
        return made

    def section(self, text: str) -> None:
        """From a text that is new here on, nodes stand in a frame with it, to the right of all before."""
        if text in self._frames:
            return
        self._first = max(self._rows, default=0) + 1
        frame = self.tree.nodes.new("NodeFrame")
        self._places[frame.as_pointer()] = [0.0, 0.0]
        frame.label, frame.label_size, frame.shrink = text, 14, True
        self._frames[text] = self._frame = frame

    def plug(self, socket, source: Source) -> None:
        if isinstance(source, bpy.types.NodeSocket):
            self.tree.links.new(source, socket)
            place = self._places[socket.node.as_pointer()]
            place[0] = max(place[0], self._places[source.node.as_pointer()][0] + COLUMN)
        elif isinstance(source, tuple) or socket.type in ("VALUE", "INT"):
            self.set(socket, source)
        else:
            self.set(socket, (source,) * len(socket.default_value))

    def set(self, socket, value: float | tuple) -> None:
        """The value of a socket that nothing is linked to, or of the output of a node that says one."""
        socket.default_value = value

    def finish(self, node):
        """Places a node whose inputs are plugged under the others of its column."""
        place = self._places[node.as_pointer()]
        column = round(place[0] / COLUMN)
        self._rows[column] = row = self._rows.get(column, -1) + 1
        place[1] = -ROW * row
        return node

    def math(self, operation: str, *operands: Source, label: str = ""):
        node = self.node("ShaderNodeMath", label, operation=operation)
        for socket, source in zip(node.inputs, operands):
            self.plug(socket, source)
        return self.finish(node).outputs[0]

    def vector(self, operation: str, *operands: Source, label: str = ""):
        """The result of a Vector Math node; DOT_PRODUCT gives a float."""
        node = self.node("ShaderNodeVectorMath", label, operation=operation)
        sockets = [node.inputs[0], node.inputs["Scale"]] if operation == "SCALE" else node.inputs
        for socket, source in zip(sockets, operands):
            self.plug(socket, source)
        return self.finish(node).outputs["Value" if operation == "DOT_PRODUCT" else "Vector"]

    def combine(self, *components: Source, label: str = "") -> Source:
        components = (*components, 0.0, 0.0)[:3]
        if all(isinstance(c, float) for c in components):
            return components
        node = self.node("ShaderNodeCombineXYZ", label)
        for socket, source in zip(node.inputs, components):
            self.plug(socket, source)
        return self.finish(node).outputs[0]

    def components(self, vector: Source) -> tuple[Source, Source, Source]:
        if isinstance(vector, tuple):
            return vector
        if isinstance(vector, float):
            return (vector,) * 3
        key = vector.path_from_id()
        if key not in self._parts:
            node = self.node("ShaderNodeSeparateXYZ")
            self.plug(node.inputs[0], vector)
            self._parts[key] = tuple(self.finish(node).outputs)
        return self._parts[key]

    def group(self, tree, *operands: Source, label: str = ""):
        node = self.node("ShaderNodeGroup", label, node_tree=tree)
        for socket, source in zip(node.inputs, operands):
            self.plug(socket, source)
        return self.finish(node).outputs

    def zone(self, count: Source, states: list[tuple[str, str]], initial: list[Source]):
        """(first node, last node) of a Repeat zone: count, states [(name, 'Float' | 'Vector')], what each begins with. The last one's
        inputs are the caller's to plug, and then to finish."""
        enter, leave = self.node("GeometryNodeRepeatInput"), self.node("GeometryNodeRepeatOutput")
        self.pair(enter, leave, [(kind.upper(), name) for name, kind in states])
        count = int(count) if isinstance(count, float) else count
        for socket, source in zip(enter.inputs, [count, *initial]):
            self.plug(socket, source)
        self.finish(enter)
        return enter, leave

    def pair(self, enter, leave, items: list[tuple[str, str]]) -> None:
        """Makes two nodes the ends of a zone. items: (type, name) of what it passes on."""
        enter.pair_with_output(leave)
        leave.repeat_items.clear()
        for item in items:
            leave.repeat_items.new(*item)

    def results(self, *sources: Source) -> None:
        """Connects the group's outputs, in the order their sockets were made, and ends the group."""
        node = self.node("NodeGroupOutput")
        for socket, source in zip(node.inputs, sources):
            self.plug(socket, source)
        self.finish(node)
        self.end()

    def end(self) -> None:
        self.tree.nodes.foreach_set("location", [n for node in self.tree.nodes for n in self._places[node.as_pointer()]])
