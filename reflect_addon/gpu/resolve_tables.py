"""What resolve reads beside a reflection buffer: the view transform's table and the scene's materials, each a texture."""

import numpy as np

from ..core import shading
from ..core.look import LINEAR, TABLE_SIDE, TOP, Look
from ..core.snapshot import SceneSnapshot
from .counts import Counts
from .program import Program
from .upload import texture_from, volume_from


class LookTexture:
    """A look on the GPU; a new exposure is a new uniform, only a new table is an upload."""

    def __init__(self, look: Look, counts: Counts):
        self.table_tx = None
        self._table = None
        self.counts = counts
        self.set(look)

    def set(self, look: Look):
        self.look = look
        if look.table is not self._table:
            self._table = look.table
            self.table_tx = None
            if look.table is not None:
                padded = np.concatenate([look.table, np.ones_like(look.table[..., :1])], -1)
                self.table_tx = volume_from("look", padded, self.counts)

    def bind(self, shader: Program):
        shader.set("look", (self.look.gain(), 1.0 / LINEAR, 1.0 / np.log2(TOP / LINEAR + 1.0), TABLE_SIDE))
        if self.table_tx is not None:
            shader.image("look_tx", self.table_tx)


class MaterialTable:
    """The scene's materials as one small texture, a row each."""

    def __init__(self, rows: np.ndarray, counts: Counts):
        self.rows = rows
        self.texture = texture_from("materials_buf", rows, counts)

    @staticmethod
    def rows_of(snapshot: SceneSnapshot) -> np.ndarray:
        """(materials, MATERIAL_TEXELS, 4) float32; one row of zeros when there are none."""
        rows = [shading.material_rows(m) for m in snapshot.materials] or [[[0.0] * 4] * shading.MATERIAL_TEXELS]
        return np.asarray(rows, np.float32)
