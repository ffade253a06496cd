"""What the targets on grids are measured on: the kettle of the sample `kitchen`, and all that stands around it.

The meshes are the drawn ones (core/virtual_mesh.py) without radiance, split finer so that each has more vertices than a grid has nodes.
The searches are the kernels themselves in NumPy, in one thread.
"""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import bpy
import numpy as np

from ..core import reflection_search, reflector_map
from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.kernel import Program, evaluate, record_function
from ..core.map_space import MapSpace
from ..core.methods import virtual_objects
from ..core.reflector_parts import part_surface, parts_of
from ..core.snapshot import SceneSnapshot
from ..core.surface_asset import SurfaceMesh
from ..core.virtual_grid import over_distance
from ..core.virtual_mesh import VirtualMesh, virtual_mesh
from ..scene.camera import camera_of
from .bench_yu_scene import SAMPLES
from .frame import open_frame

REFLECTOR = "Kettle"
SIDE = 256  # texels along a face of the reflector's map
WIDTH, HEIGHT = 320, 240  # px
WIDEST = 0.15  # rad, of an edge as seen from a reflector
# Steps of each search at which both leave the same residuals: bench_estalella_grid measures them.
STEPS = {"newton": 24, "midpoint": 40}


@dataclass(frozen=True)
class Kitchen:
    """The reflector's first part, and the vertices of everything else in its map space."""

    scene: SceneSnapshot
    camera: Camera
    mesh: VirtualMesh  # without the reflector
    matrices: np.ndarray  # (I, 3, 4) map space from objects' spaces
    space: MapSpace
    observer: np.ndarray  # (4,) map space
    asset: SimpleNamespace  # images of the map
    fixed: dict[str, np.ndarray]  # the search's other inputs, (4,) each
    programs: dict[str, Program]

    def seen_from(self, camera: Camera) -> "Kitchen":
        return replace(self, camera=camera, observer=self.space.observer(camera))

    def points(self, positions: np.ndarray, instance: np.ndarray) -> np.ndarray:
        """(V, 3) map space of object space."""
        out = np.empty((len(positions), 3))
        for index in np.unique(instance):
            mine = instance == index
            out[mine] = positions[mine].astype(np.float64) @ self.matrices[index, :, :3].T + self.matrices[index, :, 3]
        return out

    def search(self, positions: np.ndarray, instance: np.ndarray, name: str = "newton") -> dict[str, np.ndarray]:
        """The kernel's answers for object-space points, in map space."""
        count = len(positions)
        inputs = {"observer": self.observer, "start": np.zeros(4), **self.fixed}
        inputs = {key: np.broadcast_to(value, (count, 4)) for key, value in inputs.items()}
        inputs["vertex"] = np.column_stack([self.points(positions, instance), np.ones(count)])
        return evaluate(self.programs[name], inputs, self.asset)

    def weighted(self, found: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """(virtual (N, 4) over its distance, status (N,)): what is interpolated."""
        return over_distance(found["virtual"], self.observer), found["status"]

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
    positions, triangles, normals = virtual_objects._mirroring(scene, reflector)
    part = parts_of(positions, triangles, normals, most=1)[0]
    surface = part_surface(part, positions, triangles, normals)
    images, blocks = reflector_map.atlas([reflector_map.build(part.center, part.size, SIDE, surface)])
    ball, cone = virtual_objects._around(part, positions, triangles, normals)
    space = MapSpace(part.center, np.eye(3) / part.size)
    # Split for this reflector alone.
    alone = replace(scene, instances=tuple(replace(i, is_reflector=i.name == REFLECTOR) for i in scene.instances))
    mesh = virtual_mesh(alone, {i.name: _plain(scene, i) for i in scene.instances if i is not reflector}, WIDEST)
    matrices = space.from_objects(np.stack([scene.named()[name].world_from_object for name in mesh.names]))
    programs = {
        name: record_function(
            getattr(reflection_search, name), reflection_search.INPUTS, reflector_map.IMAGES,
            options={"steps": steps, "tolerance": reflection_search.TOLERANCE},
        )
        for name, steps in STEPS.items()
    }  # fmt: skip
    fixed = {"block": np.array([*blocks[0], 1.0]), "ball": ball, "cone": cone}
    asset = SimpleNamespace(images=images, uniforms={})
    return Kitchen(scene, camera, mesh, matrices, space, space.observer(camera), asset, fixed, programs)


def _plain(scene: SceneSnapshot, instance) -> SurfaceMesh:
    """Its triangles without radiance."""
    mesh = scene.meshes[instance.mesh]
    count, none = len(mesh.positions), np.zeros_like(mesh.positions)
    return SurfaceMesh(
        mesh.positions, none, none, mesh.triangles, np.zeros(count, np.int32), none, np.ones(count, np.float32), len(mesh.triangles), mesh.key
    )  # fmt: skip
