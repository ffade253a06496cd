"""The kernel language: a method's mathematics is written once, recorded, and emitted as NumPy, GLSL and shader nodes.

    program = record(method.trace, asset)
    answer = run_numpy(program, asset, rays)                  # the reference
    kernel = emit_glsl(program, ("radiance", "coverage"))     # text for Blender's gpu module; dialect=ES_300: for browsers, GODOT: for Godot
    tree = emit_nodes(program, asset, "Reflect")              # scene/kernel_nodes.py

See docs/decisions.md, "Kernel language", for what a kernel may write.
"""

from .counting import counted
from .emitted import emitted
from .glsl import GlslKernel, emit_glsl
from .glsl_text import DESKTOP, ES_300, GODOT
from .graph import KernelError
from .program import Hit, Program, Ray, record, record_function, type_of
from .run import Counts, evaluate, run_numpy

__all__ = [
    "DESKTOP",
    "ES_300",
    "GODOT",
    "Counts",
    "GlslKernel",
    "Hit",
    "KernelError",
    "Program",
    "Ray",
    "counted",
    "emit_glsl",
    "emitted",
    "evaluate",
    "record",
    "record_function",
    "run_numpy",
    "type_of",
]
