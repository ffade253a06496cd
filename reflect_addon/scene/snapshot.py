"""depsgraph -> core.snapshot.SceneSnapshot: meshes once each, instances with their place, materials, warnings."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product

import bpy
import numpy as np

from ..core.scene_items import digest
from ..core.snapshot import Bulb, Instance, Material, Mesh, SceneSnapshot, Sun
from ..core.spaces import FAR
from .camera import camera_place
from .fingerprint import Fingerprint, light_hash
from .geometry import read_mesh
from .lamps import intensity, lamp_mesh
from .materials import reflect_material
from .native_marks import original_of
from .properties import mark_of
from .restore import Change, attributes

# Object types that can have faces. The depsgraph gives curves, texts, surfaces and metaballs a second time as meshes,
# and only those are read; a metaball of a family has none of its own, so it is not missed.
WITH_FACES = {"MESH", "CURVE", "SURFACE", "FONT"}
# Smallest determinant, relative to the axes' lengths, of a transform that still has a volume.
FLATTEST = 1e-12


def take_snapshot(depsgraph: bpy.types.Depsgraph, *, visibility: str = "VIEWPORT") -> SceneSnapshot:
    """Everything the methods may know of the evaluated scene.

    visibility 'VIEWPORT': what the depsgraph shows; 'RENDER': without the objects that are off in renders (what is
    off in the viewport only is not in a viewport's depsgraph: see render_visibility). Objects without faces or with
    impossible coordinates are left out and named in `warnings`; nothing raises.
    """
    if visibility not in {"VIEWPORT", "RENDER"}:
        raise ValueError(f"visibility is VIEWPORT or RENDER, not {visibility}")
    scene = depsgraph.scene_eval
    reader = _Reader(Fingerprint(scene, depsgraph.view_layer_eval))
    for dupli in depsgraph.object_instances:
        original = dupli.instance_object.original if dupli.is_instance else dupli.object.original
        if visibility == "RENDER" and _off_in_renders(dupli):
            continue
        if dupli.show_self or dupli.is_instance:
            reader.add(dupli, original)
    reader.warn_of_the_faceless()
    items = reader.fingerprint.items()
    return SceneSnapshot(
        scene.name,
        scene.frame_current,
        tuple(reader.meshes),
        tuple(reader.materials),
        tuple(reader.instances),
        lamps=tuple(reader.lamps),
        geometry_hash=digest(items),
        warnings=tuple(reader.warnings),
        light_hash=light_hash(items),
        suns=tuple(reader.suns),
        bulbs=tuple(reader.bulbs),
        items=items,
        camera=camera_place(depsgraph),
    )


@contextmanager
def render_visibility(view_layer: bpy.types.ViewLayer) -> Iterator[None]:
    """For the length of the block the viewport shows what a render would: objects, collections, modifiers, levels."""
    hidden = [o for o in view_layer.objects if o is not None and o.hide_get(view_layer=view_layer)]  # None: removed a moment ago
    changes: list[Change] = [(block, "hide_viewport", block.hide_render) for block in bpy.data.objects]
    changes += [(block, "hide_viewport", block.hide_render) for block in bpy.data.collections]
    changes += [(layer, "hide_viewport", False) for layer in _layers(view_layer.layer_collection)]
    for obj in bpy.data.objects:
        for modifier in obj.modifiers:
            changes.append((modifier, "show_viewport", modifier.show_render))
            if hasattr(modifier, "render_levels"):
                changes.append((modifier, "levels", modifier.render_levels))
    with attributes(changes):
        for obj in hidden:
            obj.hide_set(False, view_layer=view_layer)
        try:
            view_layer.update()
            yield
        finally:
            for obj in hidden:
                obj.hide_set(True, view_layer=view_layer)
    view_layer.update()


class _Reader:
    """Collects meshes and materials once each while the instances go by."""

    def __init__(self, fingerprint: Fingerprint):
        self.fingerprint = fingerprint
        self.meshes: list[Mesh] = []
        self.materials: list[Material] = []
        self.instances: list[Instance] = []
        self.lamps: list[Instance] = []
        self.suns: list[Sun] = []
        self.bulbs: list[Bulb] = []
        self.warnings: list[str] = []
        self._boxes: dict[int, np.ndarray] = {}  # mesh -> (8, 3) float64 corners of its bounding box, object space
        self._mesh_index: dict[tuple[int, bool], int | None] = {}
        self._material_index: dict[str | None, int] = {}
        self._duplis: Counter[str] = Counter()
        self._names: set[str] = set()
        self._warned: set[str] = set()
        self._expected: dict[str, None] = {}  # objects that could have faces, in order

    def add(self, dupli, original) -> None:
        obj = dupli.object
        matrix = np.array(dupli.matrix_world, np.float64)
        name, in_renders = original.name, not _off_in_renders(dupli)
        if obj.type == "LIGHT":
            if in_renders:
                self.fingerprint.light(obj, name, matrix)
            return self._lamp(obj, name, matrix, dupli.is_instance, in_renders)
        if in_renders:
            self.fingerprint.strands(obj, name, matrix)
        if obj.type in WITH_FACES:
            self._expected[name] = None
        if obj.type == "MESH" and obj.data.is_editmode and len(obj.data.polygons) == 0:
            obj.to_mesh()  # while it is edited, Blender fills a mesh without modifiers only on request
            obj.to_mesh_clear()
        if obj.type != "MESH" or len(obj.data.polygons) == 0:
            return
        if not np.isfinite(matrix).all():
            return self._warn(name, "its place is not a finite number")
        axes = np.linalg.norm(matrix[:3, :3], axis=0)
        determinant = np.linalg.det(matrix[:3, :3] / np.where(axes > 0, axes, 1))
        if not axes.all() or abs(determinant) < FLATTEST:
            return self._warn(name, "its scale is 0")
        index = self._mesh(obj, name, mirrored=determinant < 0)
        if index is None:
            return
        if not np.abs(self._boxes[index] @ matrix[:3, :3].T + matrix[:3, 3]).max() < FAR:
            return self._warn(name, f"it reaches beyond {FAR:.0e} m")
        slots = tuple(self._material(slot.material) for slot in obj.material_slots) or (self._material(None),)
        mark = mark_of(original)
        used = np.minimum(np.unique(self.meshes[index].material_index), len(slots) - 1)
        shiny = any(self.materials[slots[k]].is_reflector for k in used)
        instance = Instance(
            self._unique(name, dupli.is_instance and not _is_own_mesh(dupli)),
            name,
            index,
            matrix,
            slots,
            shiny if mark == "AUTO" else mark == "YES",
            mark,
            obj.visible_glossy,
        )
        self.instances.append(instance)
        if in_renders:  # a window shows what no bake sees
            owners = (dupli.instance_object, dupli.parent) if dupli.is_instance else (obj,)
            self.fingerprint.instance(obj, instance, self.meshes[index].key, owners)

    def _lamp(self, obj, name: str, matrix: np.ndarray, is_dupli: bool, in_renders: bool) -> None:
        if obj.data.type == "SUN" and obj.visible_glossy and obj.data.angle > 0 and np.isfinite(matrix).all():
            toward = matrix[:3, 2] / max(np.linalg.norm(matrix[:3, 2]), 1e-30)
            self.suns.append(Sun(self._unique(name, is_dupli), tuple(toward.tolist()), float(obj.data.angle)))
        if obj.data.type == "POINT" and obj.visible_glossy and obj.data.shadow_soft_size == 0 and np.abs(matrix).max() < FAR:
            self.bulbs.append(Bulb(self._unique(name, is_dupli), tuple(matrix[:3, 3].tolist()), intensity(obj.data)))
        mesh = lamp_mesh(obj.data) if obj.visible_glossy and np.isfinite(matrix).all() else None
        # A lamp turned to nothing by its scale shines on nothing.
        if mesh is None or not np.linalg.norm(matrix[:3, :3], axis=0).all() or np.abs(matrix).max() > FAR:
            return
        self.meshes.append(mesh)
        self.lamps.append(Instance(self._unique(name, is_dupli), name, len(self.meshes) - 1, matrix, (), mark="NO"))
        if in_renders:
            self.fingerprint.lamp(self.lamps[-1], mesh.key)

    def _mesh(self, obj, name: str, mirrored: bool) -> int | None:
        key = (obj.data.as_pointer(), mirrored)
        if key not in self._mesh_index:
            mesh, notes = read_mesh(obj.data, mirrored)
            for note in notes:
                self._warn(name, f"without {note}", "is shown")
            if len(mesh.triangles):
                self._mesh_index[key] = len(self.meshes)
                self.meshes.append(mesh)
                low, high = mesh.positions.min(0), mesh.positions.max(0)
                self._boxes[len(self.meshes) - 1] = np.array(list(product(*zip(low, high))), np.float64)
            else:
                self._mesh_index[key] = None
                self._warn(name, "its faces have no area")
        return self._mesh_index[key]

    def _material(self, material) -> int:
        key = None if material is None else original_of(material).original.name_full
        if key not in self._material_index:
            self._material_index[key] = len(self.materials)
            self.materials.append(reflect_material(material))
        return self._material_index[key]

    def _unique(self, name: str, is_dupli: bool) -> str:
        out = name
        while is_dupli and out == name or out in self._names:
            self._duplis[name] += 1
            out = f"{name}/{self._duplis[name]}"
        self._names.add(out)
        return out

    def warn_of_the_faceless(self) -> None:
        shown = {instance.object_name for instance in self.instances}
        for name in self._expected:
            if name not in shown and name not in self._warned:
                self._warn(name, "it has no faces")

    def _warn(self, name: str, reason: str, verb: str = "is left out:") -> None:
        warning = f"{name} {verb} {reason}."
        if warning not in self.warnings:
            self._warned.add(name)
            self.warnings.append(warning)


def _is_own_mesh(dupli) -> bool:
    """Whether this is the mesh of a curve, text, surface or metaball rather than a copy of something."""
    return dupli.instance_object.type != "MESH" and dupli.parent.original == dupli.instance_object.original


def _off_in_renders(dupli) -> bool:
    if not dupli.is_instance:
        return dupli.object.hide_render
    # Geometry nodes may show an object that is itself hidden; a collection's instance may not.
    own = dupli.parent.instance_type == "COLLECTION" and dupli.instance_object.hide_render
    return dupli.parent.hide_render or own


def _layers(layer) -> Iterator[bpy.types.LayerCollection]:
    yield layer
    for child in layer.children:
        yield from _layers(child)
