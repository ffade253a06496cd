"""The shader-node emitter: a recorded kernel as a node group for EEVEE, or for EEVEE and Cycles.

Problem. A kernel is statements in nested regions; an artist's tree of thousands of nodes is neither read nor made in a bearable time.
Idea. Regions of a kernel (a loop's body, a side of a branch) are nested groups, and equal ones are one group (core/kernel/regions.py): what is
searched three times is written once. Citations are frames, names are labels. How zones stand for loops and branches is node_control.py's,
how operations become nodes node_operations.py's.
"""

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence

import bpy
import numpy as np

from ..core.kernel import KernelError, Program
from ..core.kernel.graph import Node, Region
from ..core.kernel.program import Names, type_of
from ..core.kernel.regions import Outline
from ..core.kernel.schedule import Schedule, schedule
from .node_control import ControlFlow
from .node_copy import TreeCopier, Unlike
from .node_images import Place, images_from, sample_group
from .node_operations import NodeScope, Parts, part_kinds, parts_of
from .node_tree import TreeBuilder

Alike = dict[tuple, list[list[bpy.types.NodeTree]]]  # what may be copied, by what it must have in common

GROUP_FROM = 12  # statements from which a region is a group of its own: smaller ones read better where they are


def emit_nodes(
    program: Program, asset, name: str, wanted: tuple[str, ...] = ("radiance", "coverage"), unrolled: bool = False,
    driven: Mapping[str, bpy.types.NodeTree] | None = None, alike: Alike | None = None, begun: Callable[[], object] = lambda: None,
) -> bpy.types.NodeTree:  # fmt: skip
    """A new shader node group. Inputs: the program's (Origin, Direction, ...); outputs: the wanted ones, a vec3 called
    radiance as Color, other vectors as Vector, bools as 0 or 1, the w of a vec4 in a second socket "NAME w".

    The asset's images become images of the file (node_images.py); its uniforms are labelled nodes, or what groups say: driven,
    uniform -> a group with outputs of its name and, of a vec4, "NAME w". unrolled: for Cycles, too. alike: groups that were made before, of
    which this one may be a copy, and to which it is added. begun(): called at each nested group.
    """
    plan = schedule(program, wanted)
    pixels = Names("image", f"the asset of {program.name}", asset.images)
    images = images_from(name, {image: pixels[image] for image in plan.images})
    key, alike = (program.name, wanted, unrolled), {} if alike is None else alike
    try:
        for like in (*alike.get(key, ()), []):
            emitter = _Emitter(program, asset, name, plan, images, unrolled, driven or {}, like, begun)
            try:
                tree = emitter.emit()
            except Unlike:
                emitter.discard()
                continue
            except BaseException:
                emitter.discard()
                raise
            if not like:
                alike.setdefault(key, []).append(emitter.trees)
            return tree
    except BaseException:
        for image in {place.image for place in images.values()}:
            bpy.data.images.remove(image)
        raise


class _Emitter(ControlFlow):
    def __init__(
        self, program: Program, asset, name: str, plan: Schedule, images: dict[str, Place], unrolled: bool,
        driven: Mapping[str, bpy.types.NodeTree], like: Sequence[bpy.types.NodeTree], begun: Callable[[], object],
    ):  # fmt: skip
        self.program, self.asset, self.name, self.unrolled, self.driven = program, asset, name, unrolled, driven
        self.plan, self.images = plan, images
        self.sections = [start for start, _ in program.graph.citations]
        self.begun, self.like = begun, like  # what this was for another asset; (): all is new
        self.builders: list[TreeBuilder] = []
        self.scope = self.root = self.open(name)
        self.outlines: dict[tuple, Outline] = {}
        self.groups: dict[object, bpy.types.NodeTree] = {}  # look-ups and regions, by what they do

    def open(self, name: str) -> NodeScope:
        return NodeScope(self.builder(name), self.leaf, lambda image: self.images[image], self.sampler)

    def builder(self, name: str) -> TreeBuilder:
        self.begun()
        if self.like and len(self.builders) == len(self.like):
            raise Unlike
        made = TreeCopier(name, self.like[len(self.builders)]) if self.like else TreeBuilder(name)
        self.builders.append(made)
        return made

    @property
    def trees(self) -> list[bpy.types.NodeTree]:
        """In the order in which they were begun; those that are not ended are missing where they are copies."""
        return [build.tree for build in self.builders if build.tree is not None]

    def emit(self) -> bpy.types.NodeTree:
        build = self.root.build
        self.interface([(name.capitalize(), node) for name, node in self.program.inputs.items()], is_output=False)
        self.interface([(name.capitalize(), node) for name, node in self.plan.outputs.items()], is_output=True)
        self.block(self.program.graph.root)
        build.results(*(part for node in self.plan.outputs.values() for part in self.scope.get(node)))
        return build.tree

    def interface(self, values: list[tuple[str, Node]], is_output: bool) -> None:
        """Sockets of the current group; those of inputs are then the values."""
        build = self.scope.build
        for label, node in values:
            for kind, end in zip(part_kinds(node.type), ("", " w")):
                build.socket(label + end, "Color" if is_output and label == "Radiance" else kind, is_output)
        if not is_output:
            sockets = iter(build.inputs.outputs)
            for _, node in values:
                self.scope.values[node] = tuple(next(sockets) for _ in part_kinds(node.type))

    def gate_socket(self) -> bpy.types.NodeSocket:
        """A last input of the current group, by which its loops are gated (node_control.py)."""
        self.scope.build.socket("Gate", "Float", is_output=False)
        return self.scope.build.inputs.outputs["Gate"]

    def discard(self) -> None:
        """Removes what was made so far: a kernel that nodes cannot express leaves the file as it was."""
        for group in {*self.trees} - {*self.like}:
            bpy.data.node_groups.remove(group)

    def leaf(self, node: Node) -> Parts:
        if node.op == "const":
            return parts_of(tuple(map(float, node.data)))
        if node.op == "size":
            return ((*map(float, self.images[node.data].size), 0.0),)
        if node.op == "uniform":
            value = Names("uniform", f"the asset of {self.program.name}", self.asset.uniforms)[node.data]
            if type_of(value) != ("float" if node.type == "bool" else node.type):
                raise KernelError(f"uniform '{node.data}' is a {type_of(value)}; {self.program.name} reads a {node.type}")
            return self.uniform(node.data, tuple(float(v) for v in np.ravel(value)))
        raise KernelError(f"{self.program.name}: {node.describe()} is read before it is computed")

    def uniform(self, name: str, value: tuple[float, ...]) -> Parts:
        if name in self.driven:
            said = self.scope.build.group(self.driven[name], label=name)
            return tuple(said[name + end] for _, end in zip(parts_of(value), ("", " w")))
        sockets = []
        for part, constant in enumerate(parts_of(value)):
            build, label = self.scope.build, name if part == 0 else f"{name} w"
            node = build.node("ShaderNodeValue" if isinstance(constant, float) else "ShaderNodeCombineXYZ", label)
            if isinstance(constant, float):
                build.set(node.outputs[0], constant)
            else:
                for socket, component in zip(node.inputs, constant):
                    build.set(socket, component)
            sockets.append(build.finish(node).outputs[0])
        return tuple(sockets)

    def sampler(self, image: str) -> bpy.types.NodeTree:
        if image not in self.groups:
            self.groups[image] = sample_group(self.builder(f"{self.name} sample {image}"), self.images[image])
        return self.groups[image]

    def block(self, region: Region) -> None:
        for node in self.plan.blocks[region]:
            self.scope.build.section(self.citation(node))
            if node.op == "loop":
                self.loop(node)
            elif node.op == "branch":
                self.branch(node)
            else:
                self.scope.values[node] = self.scope.operation(node)

    def citation(self, node: Node) -> str:
        start = {"loop": lambda d: d.body.start, "branch": lambda d: d.then.start}.get(node.op)
        return self.citation_at(start(node.data) if start else node.id)

    def citation_at(self, position: int) -> str:
        section = bisect_right(self.sections, position)
        return self.program.graph.citations[section - 1][1] if section else ""

    def outline(self, region: Region, results) -> Outline:
        key = (region, tuple(results))
        if key not in self.outlines:
            self.outlines[key] = Outline(self.plan, *key, self.bound)
        return self.outlines[key]

    def computed(self, region: Region, results: list[Node]) -> list[Parts]:
        """The parts of a region's results: a call of its group, or its statements here where they are few."""
        found = self.outline(region, results)
        if found.statements < GROUP_FROM:
            self.block(region)
            return [self.scope.get(node) for node in results]
        gate = self.gate if found.loops else None
        key = (found.key, gate is not None)
        if key not in self.groups:
            outer = self.scope, self.gate
            self.scope = self.open(f"{self.name}: {self.citation_at(region.start)[:48] or region.kind}")
            self.interface([(n.name or n.op, n) for n in found.reads], is_output=False)
            self.interface([(n.name or n.op, n) for n in found.gives], is_output=True)
            self.gate = self.gate_socket() if gate is not None else None
            self.block(region)
            self.scope.build.results(*(part for node in found.gives for part in self.scope.get(node)))
            self.groups[key] = self.scope.build.tree
            self.scope, self.gate = outer
        given = [part for node in found.reads for part in self.scope.get(node)] + [gate] * (gate is not None)
        sockets = iter(self.scope.build.group(self.groups[key], *given))
        own = {node: tuple(next(sockets) for _ in part_kinds(node.type)) for node in found.gives}
        return [own[node] if node in own else self.scope.get(node) for node in results]
