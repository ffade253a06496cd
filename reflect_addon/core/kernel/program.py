"""Recording: a kernel run once with symbolic values becomes a Program that the emitters read."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from .graph import SIZES, VECTORS, Graph, KernelError, Node
from .recorder import Recorder
from .values import Image, Value, lift

RAY_INPUTS = {"origin": "vec3", "direction": "vec3", "width": "float", "spread": "float"}
HIT_OUTPUTS = {"radiance": "vec3", "position": "vec3", "coverage": "float", "status": "float"}


@dataclass(frozen=True)
class Ray:
    """A reflected ray. origin, direction: vec3, world, direction of unit length; width: footprint at the origin in m;
    spread: its growth per metre."""

    origin: Value
    direction: Value
    width: Value
    spread: Value


@dataclass(frozen=True)
class Hit:
    """A kernel's answer; the fields mean what core.rays.Answer says. Python numbers and tuples will do."""

    radiance: Value
    position: Value
    coverage: Value | float
    status: Value | float


class Names(Mapping):
    """A mapping whose missing key is an error that says what there is."""

    def __init__(self, what: str, owner: str, items: Mapping[str, object]):
        self._what, self._owner, self._items = what, owner, dict(items)

    def __getitem__(self, name: str):
        if name not in self._items:
            there = ", ".join(sorted(self._items)) or "none"
            raise KernelError(f"{self._owner} has no {self._what} '{name}' (there: {there})")
        return self._items[name]

    def __contains__(self, name: object) -> bool:
        return name in self._items

    def __iter__(self):
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)


@dataclass(frozen=True)
class Scope:
    """What a kernel sees of an asset: image handles, symbolic uniforms, plain options."""

    images: Names
    uniforms: Names
    options: Names


@dataclass(frozen=True, eq=False)
class Program:
    """A recorded kernel. Emitters start at the wanted outputs and emit nothing else."""

    name: str
    graph: Graph
    inputs: dict[str, Node]
    outputs: dict[str, Node]
    images: tuple[str, ...]  # every image of the asset; those in use are in the emitter's result
    uniforms: dict[str, str]  # name -> type
    plans: dict[tuple[str, ...], object] = field(default_factory=dict)  # schedule.py's: wanted outputs -> what it has planned


def type_of(value) -> str:
    """The kernel type of a uniform's value: a number, 2 to 4 numbers, or already a type's name."""
    if isinstance(value, str):
        if value in SIZES:
            return value
        raise KernelError(f"'{value}' is no type (there: {', '.join(SIZES)})")
    try:
        return VECTORS[len(value)]
    except TypeError:
        return "float"
    except KeyError:
        raise KernelError(f"a uniform has 1 to 4 components, not {len(value)}") from None


def record_function(
    function: Callable,
    inputs: Mapping[str, str],
    images: Iterable[str] = (),
    uniforms: Mapping[str, object] | None = None,
    options: Mapping[str, object] | None = None,
    name: str = "",
) -> Program:
    """Records function(k, scope, **inputs) -> {output name: value}. inputs: name -> type; uniforms: name -> type or value."""
    name = name or function.__name__
    graph = Graph()
    kinds = {key: type_of(value) for key, value in (uniforms or {}).items()}
    parameters = {key: graph.new("input", type_of(kind), (), key, graph.root, key) for key, kind in inputs.items()}
    symbols = {key: Value(graph, graph.new("uniform", kind, (), key, graph.root, key)) for key, kind in kinds.items()}
    scope = Scope(
        Names("image", name, {key: Image(graph, key) for key in images}),
        Names("uniform", name, symbols),
        Names("option", name, options or {}),
    )
    returned = function(Recorder(graph), scope, **{key: Value(graph, node) for key, node in parameters.items()})
    outputs = {key: lift(graph, value, f"output '{key}'").node for key, value in returned.items()}
    return Program(name, graph, parameters, outputs, tuple(scope.images), kinds)


def record(trace: Callable, asset, name: str = "") -> Program:
    """Records a method's trace(k, asset, ray) -> Hit for the names, types and options of this asset.

        def trace(k, asset, ray):  # the world on an infinitely large floor at height 0
            k.cite("a plane: o + t d, t = -o.z / d.z")
            t = k.name("distance", -ray.origin.z / k.away_from_zero(ray.direction.z))
            position = k.name("position", ray.origin + ray.direction * t)
            colour, = k.branch(t > 0.0,
                               lambda: (k.sample(asset.images["floor_tx"], position.xy * asset.uniforms["texels_per_m"]),),
                               lambda: (k.vec4(0.0),))
            return Hit(colour.rgb, position, colour.a, 1.0)
    """

    def function(k, scope, **ray):
        hit = trace(k, scope, Ray(**ray))
        values = {key: lift(k.graph, getattr(hit, key), f"Hit.{key}") for key in HIT_OUTPUTS}
        for key, kind in HIT_OUTPUTS.items():
            if values[key].type != kind:
                raise KernelError(f"Hit.{key} of {label} is {values[key].node.describe()}, not a {kind}")
        return values

    label = name or getattr(asset, "kind", "") or trace.__module__.rpartition(".")[2]
    return record_function(function, RAY_INPUTS, asset.images, asset.uniforms, asset.options, label)
