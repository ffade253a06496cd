"""Compute shaders: declared as data, cached and forgotten like the programs that draw (program.py), and as strict.

Blender offers no storage buffers: tables come in as textures and go out as images. It needs no barrier between
dispatches. `shared` is taken out of a source by its preprocessor; write it by a define or a block's struct source.
"""

from dataclasses import dataclass

from .device import ensure
from .program import Program

# More images than these are silently zero (Blender 5.2, OpenGL), whatever the capabilities say.
MOST_IMAGES = 8


@dataclass(frozen=True)
class ComputeInfo:
    """Everything a compute shader is made of. program() compiles it; types are Blender's create-info names."""

    name: str
    compute: str  # file in glsl/
    group: tuple[int, int, int]  # invocations of a work group, 1024 at most
    uniforms: tuple[tuple[str, str], ...] = ()  # (type, name), push constants: at most 128 bytes
    blocks: tuple[tuple[str, str, str], ...] = ()  # (struct source, struct name, name): uniform buffers
    samplers: tuple[tuple[str, str], ...] = ()  # (type, name)
    images: tuple[tuple[str, str, str, str], ...] = ()  # (format, type, name, 'READ' | 'WRITE' | 'READ_WRITE')
    generated: tuple[tuple[str, str], ...] = ()  # (include name, text): sources that are not files
    defines: tuple[tuple[str, str], ...] = ()

    @property
    def stages(self) -> dict[str, str]:
        return {"compute": self.compute}

    def made_of(self, shader) -> "ComputeProgram":
        return ComputeProgram(self, shader)

    def declare(self, gpu, create):
        """What only compute shaders have. ValueError for more images than work."""
        if len(self.images) > MOST_IMAGES:
            raise ValueError(f"{self.name}: {len(self.images)} images; Blender carries {MOST_IMAGES}")
        create.local_group_size(*self.group)
        for slot, (format, kind, name, use) in enumerate(self.images):
            create.image(slot, format, kind, name, qualifiers=set(use.split("_")))


class ComputeProgram(Program):
    """A compiled compute shader; images are set by store(), everything else as for a Program."""

    def __init__(self, info: ComputeInfo, shader):
        super().__init__(info, shader)
        self._images = {name: format for format, _, name, _ in info.images}

    def bind(self):
        super().bind()
        self._unset |= set(self._images)

    def store(self, name: str, texture):
        """The texture behind an image that is written or read; ValueError when its format is not the declared one."""
        self._check_known(name, self._images)
        if texture.format != self._images[name]:
            raise ValueError(f"{self.info.name}: image '{name}' is {self._images[name]}, the texture {texture.format}")
        self.shader.image(name, texture)
        self._unset.discard(name)

    def dispatch(self, x: int, y: int = 1, z: int = 1):
        """Runs as many work groups that hold x * y * z invocations or more; the shader leaves out what is beyond."""
        self._check_all_set("dispatch")
        groups = (-(-size // group) for size, group in zip((x, y, z), self.info.group, strict=True))
        ensure().compute.dispatch(self.shader, *groups)
