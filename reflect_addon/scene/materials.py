"""Blender materials as the few numbers that a reflection needs (core.snapshot.Material).

The shader tree is walked into lobes: how much of the surface reflects, how sharply, as a metal or a dielectric. One
lobe stands for the material: the strongest of those that are sharp enough to show something, else the strongest.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import bpy
import numpy as np

from ..core import shading
from ..core.asset import Asset
from ..core.kernel import evaluate, record_function
from ..core.snapshot import Material
from .native_marks import original_of
from .sockets import Groups, Reducer

# Above this roughness a reflection is a blur of the whole half space; diffuse light shows it as well.
MAX_ROUGHNESS = 0.35
# Least share of light reflected straight on. Water has 0.020, varnish and glass 0.04: all are wanted.
MIN_REFLECTANCE = 0.015
# Glass: nothing but a little dust lies on it, and what is seen through it keeps its edges.
CLEAR, CLEAR_ROUGHNESS = 0.9, 0.1

Color = tuple[float, float, float]


@dataclass(frozen=True)
class Lobe:
    """One mirror-like lobe; weight: its share of the surface."""

    weight: float
    roughness: float
    metallic: float = 0.0
    base_color: Color = (0.8, 0.8, 0.8)
    specular_tint: Color = (1.0, 1.0, 1.0)
    ior: float = 1.5
    clear: float = 0.0  # share of what does not mirror that goes through
    thin_wall: bool = False

    def reflectance(self) -> float:
        """Largest channel of what is reflected straight on, weighted."""
        dielectric = ((self.ior - 1) / (self.ior + 1)) ** 2 * max(self.specular_tint)
        return self.weight * (self.metallic * max(self.base_color) + (1 - self.metallic) * dielectric)


def reflect_material(material: bpy.types.Material | None) -> Material:
    """The Material of a slot; an empty slot (None) is Cycles' default, a dull grey."""
    if material is None:
        return Material(name="", specular_weight=0.0)
    if material.node_tree is None:
        return Material(
            name=original_of(material).name,
            metallic=material.metallic,
            roughness=material.roughness,
            base_color=tuple(material.diffuse_color[:3]),
            is_reflector=material.metallic > 0 and material.roughness <= MAX_ROUGHNESS,
        )
    name, reducer = original_of(material).name, Reducer()
    output = material.node_tree.get_output_node("CYCLES")
    lobes = _lobes(output.inputs["Surface"], (), 1.0, reducer) if output else []
    lobes = [lobe for lobe in lobes if lobe.reflectance() > 0]
    if not lobes:
        notes = tuple(dict.fromkeys(reducer.notes))
        return Material(name=name, roughness=1.0, specular_weight=0.0, simplified=notes)
    sharp = [lobe for lobe in lobes if lobe.roughness <= MAX_ROUGHNESS and lobe.reflectance() >= MIN_REFLECTANCE]
    main = max(sharp or lobes, key=Lobe.reflectance)
    if len(lobes) > 1:
        reducer.notes.append(f"the strongest of {len(lobes)} reflecting layers stands for all")
    return Material(
        name,
        main.metallic,
        main.roughness,
        main.base_color,
        main.specular_tint,
        main.ior,
        min(main.weight, 1.0),
        bool(sharp),
        main.weight * main.clear >= CLEAR and main.roughness <= CLEAR_ROUGHNESS,
        main.thin_wall,
        tuple(dict.fromkeys(reducer.notes)),
    )


def _lobes(socket, path: Groups, weight: float, reducer: Reducer) -> list[Lobe]:
    found, path = reducer.source(socket, path)
    if not found.is_output or found.node.mute or weight <= 0:
        return []
    node = found.node
    read = _READERS.get(node.type)
    return read(node, path, weight, reducer) if read else []


def leaf_lobes(node: bpy.types.Node, path: Groups) -> list[Lobe]:
    """The lobes of one shader node, as if it were all of the surface; [] when it has none that reflects."""
    read = _READERS.get(node.type)
    return read(node, path, 1.0, Reducer()) if read else []


def _principled(node, path, weight, reducer):
    def value(name):
        return reducer.value(node.inputs[name], path)

    weight *= _unit(value("Alpha"))
    metallic, clear = _unit(value("Metallic")), _unit(value("Transmission Weight"))
    base = Lobe(
        weight,
        _unit(value("Roughness")),
        metallic,
        # A dielectric mirrors in white: its colour, often a large texture, is not read.
        value("Base Color") if metallic > 0 else Lobe.base_color,
        value("Specular Tint"),
        _with_level(value("IOR"), value("Specular IOR Level")),
    )
    if clear >= CLEAR and metallic == 0:  # a body's colour is that of two crossings, and its level does nothing (measured in Cycles)
        through = tuple(float(np.sqrt(max(v, 0.0))) for v in value("Base Color"))
        base = replace(base, base_color=through, ior=value("IOR"), clear=clear, thin_wall=bool(value("Thin Wall")))
    coat = _unit(value("Coat Weight"))
    if coat == 0:
        return [base]
    return [Lobe(weight * coat, _unit(value("Coat Roughness")), ior=value("Coat IOR")), base]


def _glossy(node, path, weight, reducer):
    color = reducer.value(node.inputs["Color"], path)
    roughness = _unit(reducer.value(node.inputs["Roughness"], path))
    reducer.notes.append("Glossy BSDF reflects alike from all sides; shown as a metal of its colour")
    return [Lobe(weight, roughness, 1.0, color, color)]


def _metallic(node, path, weight, reducer):
    roughness = _unit(reducer.value(node.inputs["Roughness"], path))
    if node.fresnel_type == "F82":
        base, edge = (reducer.value(node.inputs[name], path) for name in ("Base Color", "Edge Tint"))
        return [Lobe(weight, roughness, 1.0, base, edge)]
    n = np.array(reducer.value(node.inputs["IOR"], path))
    k = np.array(reducer.value(node.inputs["Extinction"], path))
    # Reflectance of a conductor straight on (Fresnel).
    straight = ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)
    reducer.notes.append("the conductor's edge tint is left out")
    return [Lobe(weight, roughness, 1.0, tuple(float(v) for v in straight))]


def _glass(node, path, weight, reducer):
    roughness = _unit(reducer.value(node.inputs["Roughness"], path))
    color = reducer.value(node.inputs["Color"], path)
    return [Lobe(weight, roughness, 0.0, color, color, reducer.value(node.inputs["IOR"], path), clear=1.0)]


def _eevee_specular(node, path, weight, reducer):
    color = reducer.value(node.inputs["Specular"], path)
    return [Lobe(weight, _unit(reducer.value(node.inputs["Roughness"], path)), 1.0, color)]


def _mix(node, path, weight, reducer):
    factor, first, second = node.inputs[0], node.inputs[1], node.inputs[2]
    ior = _fresnel_ior(factor, path, reducer)
    if ior is not None:
        # "Fresnel" drives the mix: the second shader is a coat on the first, mirrored as a dielectric mirrors.
        coat = [replace(lobe, metallic=0.0, specular_tint=lobe.base_color, ior=ior) if lobe.metallic == 1 else lobe
                for lobe in _lobes(second, path, weight, reducer)]  # fmt: skip
        return _lobes(first, path, weight, reducer) + coat
    share = _unit(reducer.value(factor, path))
    return _lobes(first, path, weight * (1 - share), reducer) + _lobes(second, path, weight * share, reducer)


def _add(node, path, weight, reducer):
    return _lobes(node.inputs[0], path, weight, reducer) + _lobes(node.inputs[1], path, weight, reducer)


def _fresnel_ior(socket, path, reducer) -> float | None:
    """The index of refraction when a Fresnel or Layer Weight node feeds the socket."""
    found, path = reducer.source(socket, path)
    if not found.is_output or found.node.mute:
        return None
    if found.node.type == "FRESNEL":
        return reducer.value(found.node.inputs["IOR"], path)
    if found.node.type == "LAYER_WEIGHT":
        blend = _unit(reducer.value(found.node.inputs["Blend"], path))
        if found.name == "Facing":
            reducer.notes.append("the mix by facing is taken for a Fresnel mix")
        return 1 / max(1 - blend, 1e-5)  # how Cycles turns Blend into an index
    return None


@lru_cache(maxsize=1024)
def _with_level(ior: float, level: float) -> float:
    program = record_function(shading.leveled_ior, shading.LEVELED_INPUTS)
    return float(evaluate(program, {"ior": np.array([ior]), "level": np.array([level])}, Asset("", "", {}))["ior"][0])


def _unit(value: float) -> float:
    return float(min(max(value, 0.0), 1.0))


_READERS = {
    "BSDF_PRINCIPLED": _principled,
    "BSDF_GLOSSY": _glossy,
    "BSDF_METALLIC": _metallic,
    "BSDF_GLASS": _glass,
    "EEVEE_SPECULAR": _eevee_specular,
    "MIX_SHADER": _mix,
    "ADD_SHADER": _add,
}
