"""A ball that mirrors, and a picture of it: what grids of virtual vertices are tried on."""

from types import SimpleNamespace

import numpy as np

from reflect_addon.core import reflection_search, reflector_map
from reflect_addon.core.kernel import evaluate, record_function

WIDTH = 320  # px, of a picture 240 high


class Mirror:
    """A ball of 1 m about the origin, searched through the kernel, and a picture whose middle it is."""

    def __init__(self):
        self.images, self.blocks = reflector_map.atlas([
            reflector_map.build(np.zeros(3), 1.0, 64, lambda d: (np.ones(len(d)), d, np.ones(len(d), bool)))
        ])  # fmt: skip
        options = {"steps": 16, "tolerance": reflection_search.TOLERANCE}
        self.program = record_function(reflection_search.newton, reflection_search.INPUTS, reflector_map.IMAGES, options=options)
        self.eye = np.array([0.0, -3.0, 0.5])

    def search(self, points, instance=None):
        row = {
            "observer": [*self.eye, 1], "start": [0] * 4, "block": [*self.blocks[0], 1], "ball": [0, 0, 0, 1], "cone": [0, 0, 1, -1]
        }  # fmt: skip
        inputs = {name: np.broadcast_to(np.array(value, float), (len(points), 4)) for name, value in row.items()}
        inputs["vertex"] = np.column_stack([points, np.ones(len(points))])
        found = evaluate(self.program, inputs, SimpleNamespace(images=self.images, uniforms={}))
        return found["virtual"], found["status"]

    def pixels(self, virtual):
        ahead = -self.eye / np.linalg.norm(self.eye)
        right = np.array([-ahead[1], ahead[0], 0]) / np.hypot(*ahead[:2])
        to = virtual[:, :3] / virtual[:, 3:] - self.eye
        return np.stack([to @ right, to @ np.cross(right, ahead)], 1) / (to @ ahead)[:, None] * WIDTH
