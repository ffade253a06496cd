"""A scene's planar and curved mirrors, looked for only when a reflector moved or changed: it takes half a second in a kitchen."""

import numpy as np

from ..core.methods import recursive
from ..core.snapshot import SceneSnapshot


class FoundMirrors:
    """Those that were found last. (Whether somebody looks at a closed mesh from inside is as it was then.)"""

    def __init__(self):
        self._looked_for: tuple | None = None  # what mirrors were looked for in, and those found

    def of(self, scene: SceneSnapshot):
        """recursive.drawn_mirrors' answer."""
        key = scene.materials, tuple(
            (scene.meshes[r.mesh].key, np.asarray(r.world_from_object).tobytes(), r.materials, r.mark) for r in scene.reflectors()
        )
        if self._looked_for is None or self._looked_for[0] != key:
            self._looked_for = key, recursive.drawn_mirrors(scene)
        return self._looked_for[1]
