"""What the targets on grids are measured on: the kettle of the sample `kitchen`, and all that stands around it.

All other objects' triangles are halved until no edge is longer than LONGEST, for the paper's kitchen was modelled finely all over
and a box of eight corners has nothing to interpolate. World space serves as every instance's object space.
The searches are the kernels themselves in NumPy, in one thread.
"""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import bpy
import numpy as np

from ..core import reflection_search, reflector_map
from ..core.camera import Camera
from ..core.edge_split import closed, cut, edges_of
from ..core.errors import ReflectError
from ..core.kernel import Program, evaluate, record_function
from ..core.map_space import MapSpace
from ..core.methods import virtual_objects
from ..core.reflector_parts import part_surface, parts_of
from ..core.snapshot import SceneSnapshot
from ..scene.camera import camera_of
from .bench_yu_scene import SAMPLES
from .frame import open_frame

REFLECTOR = "Kettle"
SIDE = 256  # texels along a face of the reflector's map
WIDTH, HEIGHT = 320, 240  # px
LONGEST = 0.15  # m, of an edge
# Steps of each search at which both leave the same residuals: bench_estalella_grid measures them.
STEPS = {"newton": 24, "midpoint": 40}


@dataclass(frozen=True)
class Kitchen:
    """The reflector's first part, and the vertices of everything else in its map space."""

    scene: SceneSnapshot
    reflector: str
    camera: Camera
    positions: np.ndarray  # (V, 3) float32 world, m: all vertices but the reflector's
    instance: np.ndarray  # (V,)
    space: MapSpace
    observer: np.ndarray  # (4,) map space
    asset: SimpleNamespace  # images of the map
    fixed: dict[str, np.ndarray]  # the search's other inputs, (4,) each
    programs: dict[str, Program]

    def seen_from(self, camera: Camera) -> "Kitchen":
        return replace(self, camera=camera, observer=self.space.observer(camera))

    def search(self, positions: np.ndarray, name: str = "newton") -> dict[str, np.ndarray]:
        """The kernel's answers for world points (N, 3), in map space."""
        count = len(positions)
        inputs = {"observer": self.observer, "start": np.zeros(4), **self.fixed}
        inputs = {key: np.broadcast_to(value, (count, 4)) for key, value in inputs.items()}
        inputs["vertex"] = np.column_stack([self.space.points(positions), np.ones(count)])
        return evaluate(self.programs[name], inputs, self.asset)

    def project(self, virtual: np.ndarray) -> np.ndarray:
        """(N, 2) px of homogeneous points in map space."""
        clip = virtual @ self.space.clip_from_map(self.camera).T
        with np.errstate(all="ignore"):
            return (clip[:, :2] / clip[:, 3:] * 0.5 + 0.5) * (self.camera.width, self.camera.height)


def kitchen() -> Kitchen:
    """The sample, opened; ReflectError where there is none."""
    path = SAMPLES / "kitchen.blend"
    if not path.is_file():
        raise ReflectError(f"{path} is missing.", "The targets of estalella-2005 are measured in a checkout of the project.")
    bpy.ops.wm.open_mainfile(filepath=str(path))
    with open_frame(bpy.context.scene, None) as scene:
        camera = camera_of(bpy.context.scene, None, WIDTH, HEIGHT)
    reflector = scene.named()[REFLECTOR]
    positions, triangles, normals = virtual_objects.mirroring(scene, reflector)
    part = parts_of(positions, triangles, normals, most=1)[0]
    surface = part_surface(part, positions, triangles, normals)
    images, blocks = reflector_map.atlas([reflector_map.build(part.center, part.size, SIDE, surface, part.kind == "convex")])
    piece = virtual_objects.piece_rows(part, blocks[0], False, positions, triangles, normals)[0][1]
    space = MapSpace(part.center, np.eye(3) / part.size)
    pieces = [_fine(scene, instance) for instance in scene.instances if instance is not reflector]
    owner = np.repeat(np.arange(len(pieces)), [len(piece) for piece in pieces])
    programs = {
        name: record_function(
            getattr(reflection_search, name), reflection_search.INPUTS, reflector_map.IMAGES,
            options={"steps": steps, "tolerance": reflection_search.TOLERANCE},
        )
        for name, steps in STEPS.items()
    }  # fmt: skip
    columns = {"block": virtual_objects.PLACE, "ball": virtual_objects.BALL, "cone": virtual_objects.CONE}
    fixed = {name: piece[column] for name, column in columns.items()}
    asset = SimpleNamespace(images=images, uniforms={})
    points = np.concatenate(pieces).astype(np.float32)
    return Kitchen(scene, REFLECTOR, camera, points, owner, space, space.observer(camera), asset, fixed, programs)


def _fine(scene: SceneSnapshot, instance) -> np.ndarray:
    """(V, 3) world: its vertices and those that halving adds."""
    points, triangles = scene.world_positions(instance), scene.meshes[instance.mesh].triangles
    while True:
        keys, edge_of, length = edges_of(points, triangles)
        if not (length > LONGEST).any():
            return points
        found = cut(points, triangles, triangles, keys, edge_of, closed(length > LONGEST, edge_of, length))
        points, triangles = found.points, found.place
