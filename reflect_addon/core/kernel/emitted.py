"""An asset's kernel as GLSL, kept: recording a large one takes half a second, and whoever switches between methods asks for the same ones again."""

from collections.abc import Callable

from .glsl import GlslKernel, emit_glsl
from .glsl_text import DESKTOP, Dialect
from .program import record, type_of

KEPT = 64  # kernels: all variants of all methods that a window shows in turns
_kernels: dict[tuple, GlslKernel] = {}  # by all that recording reads, oldest first


def emitted(trace: Callable, asset, wanted: tuple[str, ...], dialect: Dialect = DESKTOP) -> GlslKernel:
    """The function `answer` of these outputs, its uniforms in a block. Recording reads names, types and options only, so these say whether it is the same."""
    uniforms = tuple((name, type_of(value)) for name, value in asset.uniforms.items())
    key = (trace, asset.kind, wanted, tuple(asset.images), uniforms, repr(sorted(asset.options.items())), dialect)
    if key not in _kernels:
        while len(_kernels) >= KEPT:
            del _kernels[next(iter(_kernels))]
        _kernels[key] = emit_glsl(record(trace, asset), wanted, "answer", push_bytes=0, dialect=dialect)
    return _kernels[key]
