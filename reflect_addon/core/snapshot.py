"""What a scene is to Reflect: arrays, no bpy. scene/snapshot.py fills it from the depsgraph."""

import hashlib
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

# Of a cosine: a quarter of a degree, far more than rounding of normals.
FLAT = 1e-5


@dataclass(frozen=True)
class Mesh:
    """An evaluated triangle mesh in object space. Corners, not vertices: normals may split at edges."""

    positions: np.ndarray  # (V, 3) float32, object space, m
    triangles: np.ndarray  # (T, 3) int32 into positions
    corner_normals: np.ndarray  # (T, 3, 3) float32, object space, unit: shading normals of the triangles' corners
    material_index: np.ndarray  # (T,) int32 into the instance's materials

    @cached_property
    def key(self) -> str:
        """'<triangles>.<vertices>-<sha1>': equal for meshes of equal content, in any session; worked out once."""
        digest = hashlib.sha1(usedforsecurity=False)
        for array in (self.positions, self.triangles, self.corner_normals, self.material_index):
            digest.update(repr((array.shape, array.dtype.str)).encode())
            digest.update(np.ascontiguousarray(array))
        return f"{len(self.triangles)}.{len(self.positions)}-{digest.hexdigest()}"

    @cached_property
    def is_bent(self) -> bool:
        """Whether shading normals part from the faces' anywhere, by more than FLAT, so that it mirrors as something curved; worked out once."""
        corners = self.positions[self.triangles].astype(np.float64)
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(cross, axis=-1)
        along = np.abs(np.einsum("tkx,tx->tk", self.corner_normals, cross)).min(-1, initial=np.inf)
        return bool((along < (1 - FLAT) * length).any())


@dataclass(frozen=True)
class Material:
    """The part of a surface that a reflection needs. Linked sockets are reduced to one value (see scene/materials.py)."""

    name: str
    metallic: float = 0.0  # 0..1
    roughness: float = 0.5  # 0..1, Blender's (alpha = roughness squared)
    base_color: tuple[float, float, float] = (0.8, 0.8, 0.8)  # linear; of what refracts: what one crossing of the surface lets through
    specular_tint: tuple[float, float, float] = (1.0, 1.0, 1.0)  # linear: edge tint of a metal, tint of a dielectric
    ior: float = 1.5  # dielectric
    specular_weight: float = 1.0  # share of the surface that is a mirror-like lobe (mixes), 0 = none
    is_reflector: bool = False  # shiny enough to be worth a reflection
    refracts: bool = False  # clear: what does not mirror goes through
    thin_wall: bool = False  # Principled's: its surface is a pane by itself
    simplified: tuple[str, ...] = ()  # what was reduced, in words for the panel: "roughness is a texture; used its mean"


@dataclass(frozen=True)
class Instance:
    """One object, or one dupli of it, placed in the world."""

    name: str  # unique in the snapshot: the object's name, with "/k" for the k-th dupli of it
    object_name: str  # the original object's name
    mesh: int  # into SceneSnapshot.meshes
    world_from_object: np.ndarray  # (4, 4) float64
    materials: tuple[int, ...]  # into SceneSnapshot.materials, one per slot (at least one)
    is_reflector: bool = False  # from its materials, or as marked by hand
    mark: str = "AUTO"  # 'AUTO' | 'YES' | 'NO': the mark that the user set on the object
    visible_glossy: bool = True  # seen in reflections at all


@dataclass(frozen=True)
class Sun:
    """A lamp at infinity that glossy rays see. Its radiance is what a ray towards it brings."""

    name: str
    toward: tuple[float, float, float]  # unit, world
    angle: float  # rad, across its disk, > 0


@dataclass(frozen=True)
class Bulb:
    """A point lamp without a size: no mirror shows it, but what is glossy does."""

    name: str
    center: tuple[float, float, float]  # world, m
    intensity: tuple[float, float, float]  # W / sr, scene-linear


@dataclass(frozen=True)
class SceneSnapshot:
    """Everything the methods may know about the scene at one frame."""

    scene_name: str
    frame: int
    meshes: tuple[Mesh, ...]
    materials: tuple[Material, ...]
    instances: tuple[Instance, ...]
    lamps: tuple[Instance, ...] = ()  # lights with a size that mirrors show; cameras do not see them
    geometry_hash: str = ""  # sha256 over meshes, transforms, materials, lights and world: what an asset depends on
    warnings: tuple[str, ...] = field(default=())  # objects left out, and why
    light_hash: str = ""  # sha256 over materials and who has them, lights and world: no mesh and no object's place
    suns: tuple[Sun, ...] = ()
    bulbs: tuple[Bulb, ...] = ()
    items: dict[str, dict[str, str]] = field(default_factory=dict)  # what geometry_hash is over, one by one (scene_items.py); {}: not known
    camera: tuple[float, float, float] | None = None  # where the scene's camera stands, world, m; no hash knows of it

    def instance_hash(self, instance: Instance) -> str:
        """Of all that geometry_hash knows of this instance."""
        if known := [f"{aspect} {named[instance.name]}" for aspect, named in sorted(self.items.items()) if instance.name in named]:
            return hashlib.sha256("\n".join(known).encode()).hexdigest()
        place = np.asarray(instance.world_from_object, np.float64).tobytes()
        return hashlib.sha256(self.meshes[instance.mesh].key.encode() + place).hexdigest()

    def reflectors(self) -> tuple[Instance, ...]:
        return tuple(i for i in self.instances if i.is_reflector)

    def named(self) -> dict[str, Instance]:
        """Instances and lamps by name."""
        return {i.name: i for i in (*self.instances, *self.lamps)}

    def world_positions(self, instance: Instance) -> np.ndarray:
        """(V, 3) float64 vertices of an instance in world space."""
        m = instance.world_from_object
        return self.meshes[instance.mesh].positions.astype(np.float64) @ m[:3, :3].T + m[:3, 3]

    def slots(self, instance: Instance) -> np.ndarray:
        """(T,) int: the slot of the instance's materials that each of its triangles shows; indices past the last show it."""
        return np.minimum(self.meshes[instance.mesh].material_index, len(instance.materials) - 1)

    def bounds(self, instances=None) -> tuple[np.ndarray, np.ndarray]:
        """(min, max), each (3,) float64 world, of the given instances or of all; zeros when there is nothing."""
        boxes = [self.world_positions(i) for i in (self.instances if instances is None else instances)]
        boxes = [p for p in boxes if len(p)]
        if not boxes:
            return np.zeros(3), np.zeros(3)
        return np.min([p.min(0) for p in boxes], 0), np.max([p.max(0) for p in boxes], 0)

    def diagonal(self) -> float:
        """Length of the scene's bounding-box diagonal, m: what hit errors are divided by."""
        low, high = self.bounds()
        return float(np.linalg.norm(high - low))


def corners_of(bounds: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """(8, 3) of a box given by its low and high corner."""
    return np.array([[bounds[i >> a & 1][a] for a in range(3)] for i in range(8)])
