"""Shaders from files: includes, declarations as data, one cache for the session, uniforms that cannot be forgotten."""

import atexit
import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

from .counts import Counts
from .device import ensure

GLSL = Path(__file__).parent / "glsl"
_INCLUDE = re.compile(r'^[ \t]*#include[ \t]+"([^"]+)"[ \t]*$', re.M)
_FLOATS = {"FLOAT": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@dataclass(frozen=True)
class ProgramInfo:
    """Everything a shader is made of. Types are Blender's create-info names ('VEC3', 'FLOAT_2D', ...)."""

    name: str
    vertex: str  # file in glsl/
    fragment: str  # file in glsl/
    attributes: tuple[tuple[str, str], ...] = ()  # (type, name) of vertex inputs, slots in this order
    varyings: tuple[tuple[str, str, str], ...] = ()  # ('smooth' | 'flat', type, name)
    uniforms: tuple[tuple[str, str], ...] = ()  # (type, name), push constants: at most 128 bytes, Vulkan's limit
    blocks: tuple[tuple[str, str, str], ...] = ()  # (struct source, struct name, name): uniform buffers
    samplers: tuple[tuple[str, str], ...] = ()  # (type, name)
    outputs: tuple[tuple[str, str], ...] = ()  # (type, name), slot in this order
    generated: tuple[tuple[str, str], ...] = ()  # (include name, text): sources that are not files
    defines: tuple[tuple[str, str], ...] = ()
    depth: str = "UNCHANGED"  # what the fragment stage makes of it

    @property
    def stages(self) -> dict[str, str]:
        """Stage -> file in glsl/."""
        return {"vertex": self.vertex, "fragment": self.fragment}

    def made_of(self, shader) -> "Program":
        return Program(self, shader)

    def declare(self, gpu, create):
        """What only programs that draw have."""
        for slot, (kind, name) in enumerate(self.attributes):
            create.vertex_in(slot, kind, name)
        for slot, (kind, name) in enumerate(self.outputs):
            create.fragment_out(slot, kind, name)
        if self.depth != "UNCHANGED":
            create.depth_write(self.depth)
        if self.varyings:
            interface = gpu.types.GPUStageInterfaceInfo(self.name.replace("-", "_") + "_iface")
            for how, kind, name in self.varyings:
                getattr(interface, how)(kind, name)
            create.vertex_out(interface)


def resolve_includes(name: str, generated: dict[str, str] | None = None) -> str:
    """The text of a shader with every `#include "x"` replaced by x's text, each file once (the guard).

    Raises FileNotFoundError naming the missing include and the file that asks for it.
    """
    generated = generated or {}
    seen: set[str] = set()

    def text_of(wanted: str, asked_by: str) -> str:
        if wanted in seen:
            return ""
        seen.add(wanted)
        if wanted in generated:
            text = generated[wanted]
        else:
            path = GLSL / wanted
            if not path.is_file():
                raise FileNotFoundError(f'{asked_by} includes "{wanted}", which is neither in {GLSL} nor generated')
            text = path.read_text()
        return _INCLUDE.sub(lambda match: text_of(match.group(1), wanted), text)

    return text_of(name, "the program")


class Program:
    """A compiled shader that knows what it declared: a wrong or a forgotten name raises with that name."""

    def __init__(self, info: ProgramInfo, shader):
        self.info = info
        self.shader = shader
        self._uniforms = dict((name, kind) for kind, name in info.uniforms)
        self._samplers = {name for _, name in info.samplers}
        self._blocks = {name for _, _, name in info.blocks}
        # Declared but unused: drivers drop such uniforms and Blender raises when they are set. They need not be set.
        self._dropped = {name for name in [*self._uniforms, *self._samplers] if not _exists(shader, name)}
        self._unset: set[str] = set()

    def bind(self):
        self.shader.bind()
        self._unset = (set(self._uniforms) | self._samplers | self._blocks) - self._dropped

    def set(self, name: str, value):
        """A push constant: a float or a flat sequence of floats (matrices column by column)."""
        self._check_known(name, self._uniforms)
        kind = self._uniforms[name]
        values = (float(value),) if kind == "FLOAT" else tuple(float(v) for v in value)
        if len(values) != _FLOATS[kind]:
            raise ValueError(f"{self.info.name}: uniform '{name}' is a {kind}, got {len(values)} floats")
        if name not in self._dropped:
            self.shader.uniform_float(name, values[0] if kind == "FLOAT" else values)
        self._unset.discard(name)

    def image(self, name: str, texture):
        self._check_known(name, self._samplers)
        if name not in self._dropped:
            self.shader.uniform_sampler(name, texture)
        self._unset.discard(name)

    def block(self, name: str, buffer):
        self._check_known(name, self._blocks)
        self.shader.uniform_block(name, buffer)
        self._unset.discard(name)

    def draw(self, batch, first: int = 0, count: int = 0):
        """Draw vertices [first, first + count) of a batch, all of them when count is 0."""
        self._check_all_set("drawing")
        if count:
            batch.draw_range(self.shader, elem_start=first, elem_count=count)
        else:
            batch.draw(self.shader)

    def _check_all_set(self, what: str):
        if self._unset:
            raise ValueError(f"{self.info.name}: not set before {what}: {', '.join(sorted(self._unset))}")

    def _check_known(self, name: str, names):
        if name not in names:
            raise ValueError(f"{self.info.name}: no uniform, image or block is called '{name}'")


def _exists(shader, name: str) -> bool:
    try:
        shader.uniform_from_name(name)
    except ValueError:
        return False
    return True


_cache: dict[str, Program] = {}  # by the hash of the sources
_known: dict = {}  # by the description, so that a draw neither reads files nor hashes


def program(info: ProgramInfo, counts: Counts | None = None) -> Program:
    """The compiled program of this description (compute.py has the other kind); compiled once a session, kept until
    forget_programs().

    Raises RuntimeError naming the program and its files when the driver refuses it (its log is on the console).
    """
    if info in _known:
        return _known[info]
    generated = dict(info.generated)
    texts = {stage: resolve_includes(file, generated) for stage, file in info.stages.items()}
    key = hashlib.sha256(repr((info, texts)).encode()).hexdigest()
    if not _cache:
        # Shaders that outlive Blender's GPU crash the process as it exits. (Registered after bpy's own: runs before it.)
        atexit.register(forget_programs)
    if key not in _cache:
        _cache[key] = info.made_of(_compile(info, texts))
        if counts is not None:
            counts.compiles += 1
    _known[info] = _cache[key]
    return _cache[key]


def forget_programs():
    """Drop every compiled shader; unbinds first, since Blender crashes when a bound one is collected."""
    if _cache:
        ensure().shader.unbind()
        _cache.clear()
        _known.clear()
        atexit.unregister(forget_programs)


def _compile(info, texts: dict[str, str]):
    gpu = ensure()
    size = sum(4 * max(_FLOATS[kind], 1) for kind, _ in info.uniforms)
    if size > 128:
        raise ValueError(f"{info.name}: {size} bytes of push constants; move some into a block (limit 128)")
    create = gpu.types.GPUShaderCreateInfo()
    for name, value in info.defines:
        create.define(name, value)
    if info.blocks:  # a second call would replace the first one's text
        create.typedef_source("\n".join(source for source, _, _ in info.blocks))
    for slot, (_, struct, name) in enumerate(info.blocks):
        create.uniform_buf(slot, struct, name)
    for kind, name in info.uniforms:
        create.push_constant(kind, name)
    for slot, (kind, name) in enumerate(info.samplers):
        create.sampler(slot, kind, name)
    info.declare(gpu, create)
    for stage, text in texts.items():
        getattr(create, f"{stage}_source")(text)
    try:
        return gpu.shader.create_from_info(create)
    except Exception as error:  # Blender raises bare Exception; the driver's log went to the console
        raise RuntimeError(f"shader {info.name} ({', '.join(info.stages.values())}) does not compile: {error}") from error


def call_text(kernel, arguments: dict[str, str], prefix: str = "") -> str:
    """Statements that call an emitted kernel: arguments are its inputs as GLSL, outputs become variables prefix + name."""
    results = [f"  {kind} {prefix}{name};\n" for name, kind in kernel.outputs.items()]
    values = [arguments[name] for name in kernel.inputs] + [prefix + name for name in kernel.outputs]
    return "".join(results) + f"  {kernel.function}({', '.join(values)});\n"
