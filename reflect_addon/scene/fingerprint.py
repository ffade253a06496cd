"""The items of a scene (core/scene_items.py), each with its hash: meshes, places, materials, lights, world, light bounces.

Equal scenes give equal items in any session; the camera and what only the editor shows do not count, nor what renders do not show. Image files
count by their content wherever they lie (a bake works on a copy of the .blend in another folder), packed ones by their
length; the frame counts only where an image follows it.
"""

from functools import cache
from pathlib import Path

import bpy
import numpy as np

from ..core import scene_items as aspects
from ..core.scene_items import Items, Named, digest, place_hash
from ..core.snapshot import Instance
from .native_marks import original_of
from .paint import paint_digest
from .see_through import is_solid
from .shader_text import NOT_CONTENT, ShaderText, file_digest, plain, sha256

LIGHT_TRANSPORT = (
    "max_bounces", "min_light_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "volume_bounces",
    "transparent_max_bounces", "min_transparent_bounces", "caustics_reflective", "caustics_refractive", "blur_glossy",
    "sample_clamp_direct", "sample_clamp_indirect", "light_sampling_threshold", "use_light_tree", "use_fast_gi", "fast_gi_method", "ao_bounces_render",
    "volume_step_rate", "volume_max_steps", "volume_biased", "dicing_rate", "max_subdivisions", "sampling_pattern",
)  # fmt: skip
RAYS = ("visible_diffuse", "visible_glossy", "visible_transmission", "visible_volume_scatter", "visible_shadow")
NO_MESHES = {"CURVES", "POINTCLOUD", "VOLUME"}  # that Cycles shows all the same


class Fingerprint:
    """Takes the parts in any order; items() ends it. Of what instances share (meshes, materials) each is read once."""

    def __init__(self, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer):
        self._scene, self._layer = scene, view_layer
        self._items: Items = {}
        self._text = ShaderText()
        self._materials: dict[str | None, tuple[str, str]] = {None: ("none", "solid")}  # by full name: (what it is, where rays end on it)
        self._paints: dict[int, str] = {}  # by the mesh's address
        self._objects: dict[str, tuple] = {}  # instance -> (paint, its color, objects whose properties materials may ask for)
        self._override = self._material(view_layer.material_override) if view_layer.material_override else ("", "")
        self._world()

    def instance(self, obj, instance: Instance, mesh_key: str, owners: tuple) -> None:
        """owners: the evaluated objects that stay when the next instance is read: its own, and the one that makes copies of it."""
        slots = [self._material(slot.material) for slot in obj.material_slots] or [self._material(None)]
        name, data = instance.name, obj.data
        self._add(aspects.SHAPE, name, mesh_key)
        self._add(aspects.PLACE, name, "", place_hash(instance))
        self._add(aspects.MATERIALS, name, str([what for what, _ in slots]))
        self._add(aspects.COVER, name, f"{[cover for _, cover in slots]} {self._override[1]} {obj.visible_glossy}")
        self._add(aspects.RAYS, name, self._rays(obj))
        if data.as_pointer() not in self._paints:
            self._paints[data.as_pointer()] = paint_digest(data)
        self._objects[name] = (self._paints[data.as_pointer()], plain(obj.color), owners)

    def strands(self, obj, name: str, matrix: np.ndarray) -> None:
        """What an object shows beside its mesh: hair; of one that is no mesh, all of it."""
        said = []
        if obj.type in NO_MESHES:
            slots = [self._material(slot.material) for slot in obj.material_slots]
            volume = obj.type == "VOLUME"
            content = file_digest(Path(bpy.path.abspath(obj.data.filepath))) if volume else paint_digest(obj.data, frozenset())
            frame = self._scene.frame_current if volume and obj.data.is_sequence else ""
            said = [content, frame, slots, matrix.tobytes().hex(), self._rays(obj)]
        for system in getattr(obj, "particle_systems", ()):
            if system.settings.type == "HAIR":
                keys = [tuple(key.co) for particle in system.particles for key in particle.hair_keys]
                said += [self._text.struct(system.settings), system.seed, keys, matrix.tobytes().hex()]
        if said:
            self._add(aspects.STRANDS, name, str(said))

    def light(self, obj, name: str, matrix: np.ndarray) -> None:
        text = self._text.fresh()
        values = f"{matrix.tobytes().hex()} {self._rays(obj)} {text.struct(obj.data)} {text.tree(obj.data.node_tree)}"
        self._add(aspects.LAMP, name, values)

    def lamp(self, instance: Instance, mesh_key: str) -> None:
        """Of a light that mirrors show: its shape."""
        self._add(aspects.LAMP_SHAPE, instance.name, f"{mesh_key} {place_hash(instance)}")

    def items(self) -> Items:
        """Items of all that was told."""
        for name, (paint, color, owners) in self._objects.items():
            said = [paint]
            if self._text.asks_objects:
                said += [color, name]  # its random number comes from its name
            said += [f"{key} {_property(owner, key)}" for key in sorted(self._text.attributes) for owner in owners]
            self._add(aspects.PAINT, name, " ".join(said))
        return self._items

    def _world(self) -> None:
        """The world, and what of the render settings changes light."""
        text, world = self._text.fresh(), self._layer.world_override or self._scene.world
        if world is not None:
            visibility = getattr(world, "cycles_visibility", None)
            seen = [getattr(visibility, kind, None) for kind in ("diffuse", "glossy", "transmission", "scatter")]
            flat = "" if world.node_tree else world.color[:]  # as materials'
            self._add(aspects.WORLD, "", f"{flat} {seen} {text.tree(world.node_tree)}")
        self._add(aspects.LIGHT, "", f"{_transport(self._scene)} {self._override[0]}")

    def _add(self, aspect: str, name: str, text: str, known: str = "") -> None:
        """Under a name of its own: duplis of lamps and strands have their object's."""
        named = self._items.setdefault(aspect, Named())
        free, k = name, 1
        while free in named:
            free, k = f"{name}/{k}", k + 1
        named[free] = known or sha256(f"{text} {self._scene.frame_current if self._text.follows_frame else ''}")
        self._text.fresh()

    def _material(self, material) -> tuple[str, str]:
        key = None if material is None else original_of(material).name_full
        if key not in self._materials:
            text, cycles = self._text.fresh(), getattr(material, "cycles", None)
            # Without nodes it is what the viewport shows.
            flat = "" if material.node_tree else (*material.diffuse_color, material.metallic, material.roughness)
            settings = f"{material.displacement_method} {material.pass_index} {text.struct(cycles) if cycles else ''}"
            self._add(aspects.MATERIAL, key, f"{flat} {settings} {text.tree(material.node_tree)}")
            what = self._items[aspects.MATERIAL][key]
            self._materials[key] = what, "solid" if is_solid(material) else what
        return self._materials[key]

    def _rays(self, obj) -> str:
        """Which rays meet an object, what Cycles keeps on it, and which lights shine on it or are blocked by it."""
        linked = [getattr(obj.light_linking, f"{kind}_collection") for kind in ("receiver", "blocker")]
        names = [c and ([o.name for o in c.all_objects], [one.light_linking.link_state for one in c.collection_objects]) for c in linked]
        cycles = getattr(obj, "cycles", None)  # None while the Cycles add-on is off
        return f"{[getattr(obj, kind) for kind in RAYS]} {[getattr(cycles, name) for name in _names_in(type(cycles))]} {names}"


@cache
def _names_in(kind: type) -> tuple[str, ...]:
    """Of the plain properties of a kind of structure: asking Blender for them takes longer than their values."""
    found = kind.bl_rna.properties if hasattr(kind, "bl_rna") else ()
    return tuple(p.identifier for p in found if p.identifier not in NOT_CONTENT and p.type not in {"POINTER", "COLLECTION"})


def light_hash(items: Items) -> str:
    """Of what surfaces are made of and lit by alone: neither meshes nor where objects are."""
    return digest({aspect: items.get(aspect, {}) for aspect in aspects.LIT})


def quiet_state(scene) -> str:
    """What assets depend on and no handler of Blender tells of; cheap."""
    return f"{_transport(scene)} {[(o.name, getattr(o, 'reflect_mark', '')) for o in scene.objects]}"


def _transport(scene) -> str:
    # From the original: render settings alone do not make the depsgraph copy the scene again.
    cycles = getattr(scene.original, "cycles", None)  # None while the Cycles add-on is off
    return f"{[getattr(cycles, name, None) for name in LIGHT_TRANSPORT]} {bpy.data.colorspace.working_space}"


def _property(owner, name: str) -> str:
    """A property that a material shows, of an object or its data: its own, or one of Blender's by its path."""
    for block in filter(None, (owner, owner.data)):
        if name in block:
            return plain(block[name])
        try:
            return plain(block.path_resolve(name))
        except ValueError:
            continue
    return ""
