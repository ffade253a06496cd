"""Text of GLSL: literals, expressions, names, helper functions, dialects, and where uniforms lie. Used by glsl.py and glsl_writer.py."""

import re
from dataclasses import dataclass

import numpy as np

from .graph import SIZES, KernelError, Node

FETCH = """vec4 reflect_fetch(sampler2D image, float x, float y)
{
  vec2 last = vec2(textureSize(image, 0) - 1);
  return texelFetch(image, ivec2(clamp(floor(vec2(x, y)), vec2(0.0), last)), 0);
}
"""
# Four fetches and float32 weights rather than the sampler's filter, whose weights have 8 bits.
SAMPLE = """vec4 reflect_sample(sampler2D image, float x, float y)
{
  vec2 corner = floor(vec2(x, y) - 0.5);
  vec2 weight = vec2(x, y) - 0.5 - corner;
  vec2 last = vec2(textureSize(image, 0) - 1);
  ivec2 low = ivec2(clamp(corner, vec2(0.0), last));
  ivec2 high = ivec2(clamp(corner + 1.0, vec2(0.0), last));
  vec4 t00 = texelFetch(image, low, 0);
  vec4 t10 = texelFetch(image, ivec2(high.x, low.y), 0);
  vec4 t01 = texelFetch(image, ivec2(low.x, high.y), 0);
  vec4 t11 = texelFetch(image, high, 0);
  vec4 bottom = t00 + (t10 - t00) * weight.x;
  vec4 top = t01 + (t11 - t01) * weight.x;
  return bottom + (top - bottom) * weight.y;
}
"""

# Words of GLSL and of Blender's shader headers that a variable cannot be called, and functions the text calls.
RESERVED = frozenset(
    """active asm attribute bool break buffer case cast centroid class coherent common const continue default discard do
    double else enum extern external false filter fixed flat float for global goto half highp if image in inline inout
    input int interface invariant invocation ivec2 layout local long lowp mat3 mat4 mediump namespace noinline
    noperspective out output packed partition patch precision public readonly resource restrict return sample sampler2D
    shared short sizeof smooth static struct subroutine superp switch template texture this thread true typedef uint
    uniform union unsigned using varying vec2 vec3 vec4 void volatile while writeonly abs clamp cross dot exp2 floor log2
    max min sqrt main M_PI""".split()
)


@dataclass(frozen=True)
class Dialect:
    """What differs from GLSL to GLSL: the expressions are the same, for the emitter converts every type by hand and declares no array."""

    name: str
    reserved: frozenset[str] = RESERVED  # words that nothing can be called
    prefixes: tuple[str, ...] = ("gl_",)  # that no name may begin with
    strict: bool = False  # no "__" in names, comments of ASCII without a backslash: browsers refuse shaders for less
    least: float = 0.0  # smaller constants are written by their bits
    slots: str = ".slot"  # from a uniform block's name to its array of vec4; empty where the uniform is the array itself

    def comment(self, words: str) -> str:
        """Words as they may stand in a comment."""
        return words.encode("ascii", "replace").decode().replace("\\", "/") if self.strict else words

    def literal(self, value: float) -> str:
        """The text that is this float32 again."""
        if 0 < abs(np.float32(value)) < self.least:
            return f"uintBitsToFloat(0x{np.float32(value).view(np.uint32):08x}u)"
        return literal(value)

    def check(self, *names: str) -> None:
        """KernelError for a name from outside that the dialect does not take."""
        for name in names:
            if self.strict and ("__" in name or name in self.reserved or name.startswith(self.prefixes)):
                raise KernelError(f"{self.name} takes no name like '{name}'")


DESKTOP = Dialect("GLSL")
# GLSL ES 3.00 as browsers check it [Khronos, "The OpenGL ES Shading Language 3.00", 3.8, 3.9; "WebGL 2.0", 4.3]; and words of three.js's shaders.
ES_300 = Dialect(
    "GLSL ES 3.00",
    RESERVED
    | frozenset(
        """atomic_uint bvec2 bvec3 bvec4 dmat2 dmat3 dmat4 dvec2 dvec3 dvec4 fvec2 fvec3 fvec4 hvec2 hvec3 hvec4 image1D image2D image3D imageCube
        imageBuffer imageRect isampler2D isampler3D isamplerCube ivec3 ivec4 mat2 mat2x2 mat2x3 mat2x4 mat3x2 mat3x3 mat3x4 mat4x2 mat4x3 mat4x4 sampler1D
        sampler2DArray sampler2DRect sampler2DShadow sampler3D sampler3DRect samplerBuffer samplerCube samplerCubeShadow usampler2D usampler3D usamplerCube
        uvec2 uvec3 uvec4 defined texelFetch textureSize textureLod PI PI2 EPSILON LOG2 saturate varying texture2D""".split()
    ),
    ("gl_", "webgl_", "_webgl_"),
    True,
)
# Godot 4's shading language, which is made into GLSL by Godot with other names [Godot, "Shading language"]: its words, and the constants that it puts into every
# shader. It has no uniform of a struct. What it has of GLSL's preprocessor is enough for the guards of helpers.
GODOT = Dialect(
    "Godot's shading language",
    RESERVED
    | frozenset(
        """bvec2 bvec3 bvec4 ivec3 ivec4 uvec2 uvec3 uvec4 mat2 isampler2D usampler2D sampler2DArray isampler2DArray usampler2DArray sampler3D isampler3D
        usampler3D samplerCube samplerCubeArray samplerExternalOES shader_type render_mode stencil_mode group_uniforms instance instance_index source_color
        color_conversion_disabled hint_range hint_enum hint_normal hint_default_white hint_default_black hint_default_transparent hint_anisotropy
        hint_roughness_r hint_roughness_g hint_roughness_b hint_roughness_a hint_roughness_normal hint_roughness_gray hint_screen_texture
        hint_normal_roughness_texture hint_depth_texture filter_nearest filter_linear filter_nearest_mipmap filter_linear_mipmap
        filter_nearest_mipmap_anisotropic filter_linear_mipmap_anisotropic repeat_enable repeat_disable PI TAU E TIME OUTPUT_IS_SRGB CLIP_SPACE_FAR texelFetch
        textureSize uintBitsToFloat defined""".split()
    ),
    ("gl_", "hint_"),
    True,
    1e-4,  # Godot passes constants on with 14 decimal places
    "",
)
ATOM, UNARY, MUL, ADD, LESS, EQUAL, AND, OR, SELECT = range(9, 0, -1)  # precedence, tightest first
INFIX = {"add": ("+", ADD), "sub": ("-", ADD), "mul": ("*", MUL), "div": ("/", MUL)} | {
    "lt": ("<", LESS),
    "le": ("<=", LESS),
    "eq": ("==", EQUAL),
    "and": ("&&", AND),
    "or": ("||", OR),
}


def literal(value: float) -> str:
    """The shortest text that is this float32 again."""
    number = np.float32(value)
    if number == 0 or 1e-4 <= abs(number) < 1e7:
        text = np.format_float_positional(number, unique=True, trim="0")
    else:
        text = np.format_float_scientific(number, unique=True, trim="0")
    return text


def constant(node: Node, dialect: Dialect = DESKTOP) -> tuple[str, int]:
    if node.type == "bool":
        return ("true" if node.data[0] else "false"), ATOM
    if node.type == "float":
        text = dialect.literal(node.data[0])
        return text, UNARY if text.startswith("-") else ATOM
    values = node.data[:1] if len({repr(v) for v in node.data}) == 1 else node.data
    return f"{node.type}({', '.join(map(dialect.literal, values))})", ATOM


def operation(node: Node, operands: list[tuple[str, int]], image: str = "") -> tuple[str, int]:
    """(text, precedence) of a node from those of its operands."""

    def at_least(which: int, level: int) -> str:
        text, precedence = operands[which]
        return text if precedence >= level else f"({text})"

    texts = [text for text, _ in operands]
    if node.op in INFIX:
        sign, level = INFIX[node.op]
        if node.op in ("lt", "le") and node.args[0].op == "const":  # x > 0 reads better than 0 < x
            return f"{at_least(1, level + 1)} {sign.replace('<', '>')} {at_least(0, level)}", level
        return f"{at_least(0, level)} {sign} {at_least(1, level + 1)}", level
    if node.op == "neg":
        return f"-{at_least(0, ATOM)}", UNARY
    if node.op == "not":
        return f"!{at_least(0, ATOM)}", UNARY
    if node.op == "select":
        return f"{at_least(0, OR)} ? {at_least(1, OR)} : {at_least(2, OR)}", SELECT
    if node.op == "swizzle":
        return f"{at_least(0, ATOM)}.{node.data}", ATOM
    if node.op == "vec":
        return f"{node.type}({', '.join(texts[:1] if len(set(texts)) == 1 and _is_spread(node) else texts)})", ATOM
    if node.op in ("fetch", "sample"):
        return f"reflect_{node.op}({image}, {', '.join(texts)})", ATOM
    if node.op in ("min", "max"):  # GLSL wants equal types here
        texts = [t if a.type == node.type else f"{node.type}({t})" for t, a in zip(texts, node.args)]
    return f"{node.op}({', '.join(texts)})", ATOM


def _is_spread(node: Node) -> bool:
    return all(a.type == "float" for a in node.args)


class NameSpace:
    """Unique identifiers."""

    def __init__(self, taken, dialect: Dialect = DESKTOP):
        self.taken, self.prefixes = set(taken) | dialect.reserved, dialect.prefixes

    def new(self, wanted: str) -> str:
        wanted = re.sub("_+", "_", wanted).strip("_") or "value"
        name, number = wanted, 1
        while name in self.taken or (number == 1 and name.startswith(self.prefixes)):
            number += 1
            name = f"{wanted}_{number}"
        self.taken.add(name)
        return name


def pack_layout(uniforms: dict[str, str]) -> tuple[dict[str, tuple[int, int]], int]:
    """({name: (vec4 slot, first component)}, slots): whole vec4s only, which every backend lays out alike."""
    layout, free = {}, []  # free[slot]: components in use
    for name in sorted(uniforms, key=lambda n: (-SIZES[uniforms[n]], n)):
        size = SIZES[uniforms[name]]
        slot = next((s for s, used in enumerate(free) if used + size <= 4), len(free))
        if slot == len(free):
            free.append(0)
        layout[name] = (slot, free[slot])
        free[slot] += size
    return layout, len(free)
