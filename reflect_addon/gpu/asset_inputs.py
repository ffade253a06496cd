"""What an emitted kernel reads of its asset, as a program takes it: images by sampler, uniforms in a block."""

import numpy as np

from ..core.asset import Asset
from ..core.kernel import GlslKernel
from .device import ensure
from .program import Program
from .texture_cache import TextureCache


class AssetInputs:
    """kernel: emitted for the asset; more: images that another kernel of the same shader reads by these names."""

    def __init__(self, kernel: GlslKernel, asset: Asset, textures: TextureCache, more: dict[str, np.ndarray] | None = None):
        self._textures, self._name = textures, kernel.block_name
        self._images = {name: (name, array) for name, array in (more or {}).items()}  # sampler -> the image's name and the image
        self._images |= {sampler: (name, asset.images[name]) for name, sampler in kernel.images.items()}
        self._block = ensure().types.GPUUniformBuf(kernel.pack_uniforms(asset)) if kernel.block_name else None
        self.blocks = ((kernel.typedef, kernel.block_type, kernel.block_name),) if kernel.block_name else ()
        self.samplers = tuple(self._images)

    def upload(self):
        """Now, not when it is first drawn."""
        for name, array in self._images.values():
            self._textures.texture(name, array)

    def bind(self, shader: Program):
        for sampler, (name, array) in self._images.items():
            shader.image(sampler, self._textures.texture(name, array))
        if self._block is not None:
            shader.block(self._name, self._block)
