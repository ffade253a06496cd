"""One number for everything an asset depends on: meshes, places, materials, lights, world, light bounces.

Equal scenes give equal numbers in any session; the camera and what only the editor shows do not count. Image files
count by their content wherever they lie (a bake works on a copy of the .blend in another folder), packed ones by their
length; the frame counts only where an image follows it.
"""

import hashlib
from functools import lru_cache
from pathlib import Path

import bpy
import numpy as np

from .native_marks import is_for_eevee_alone, original_of

# Of nodes and lights: where they lie in the editor, and what Blender works out or counts by itself.
EDITOR_ONLY = {
    "rna_type", "name", "name_full", "label", "location", "location_absolute", "width", "height", "dimensions",
    "select", "show_options", "show_preview", "show_texture", "hide", "color", "use_custom_color", "color_tag",
    "parent", "internal_links", "inputs", "outputs", "node_tree", "session_uid", "users", "tag", "original",
    "is_evaluated", "preview", "animation_data", "use_fake_user", "use_extra_user", "bl_idname", "bl_label",
    "bl_description", "bl_icon", "bl_static_type", "bl_width_default", "bl_width_min", "bl_width_max",
    "bl_height_default", "bl_height_min", "bl_height_max", "warning_propagation", "use_nodes", "library",
    "library_weak_reference", "override_library", "asset_data", "is_embedded_data", "is_linked_packed",
    "is_missing", "is_runtime_data", "is_editable", "is_library_indirect", "id_type",
}  # fmt: skip
LIGHT_TRANSPORT = (
    "max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "volume_bounces",
    "transparent_max_bounces", "caustics_reflective", "caustics_refractive", "blur_glossy",
    "sample_clamp_direct", "sample_clamp_indirect", "use_fast_gi", "ao_bounces_render",
)  # fmt: skip
DEEPEST = 6  # nested structures below a node: ramps, curve mappings and their points


class Fingerprint:
    """Takes the parts in any order; hexdigest() sorts them."""

    def __init__(self):
        self._parts: list[str] = []
        self._mesh_digests: list[str] = []
        self._light: list[str] = []
        self.instances: dict[str, str] = {}  # name -> sha256 of its part
        self._follows_frame = False

    def hexdigest(self) -> str:
        return _sha256("\n".join(sorted(self._parts)).encode())

    def light_hexdigest(self) -> str:
        """Of what surfaces are made of and lit by alone: neither meshes nor where objects are."""
        rest = [part for part in self._parts if not part.startswith("instance ")]
        return _sha256("\n".join(sorted(rest + self._light)).encode())

    def mesh(self, mesh) -> None:
        """To be called in the order in which instances count meshes."""
        arrays = (mesh.positions, mesh.triangles, mesh.corner_normals, mesh.material_index)
        self._mesh_digests.append(_sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in arrays)))

    def instance(self, obj, instance) -> None:
        seen = [getattr(obj, f"visible_{kind}") for kind in ("diffuse", "glossy", "transmission", "shadow")]
        slots = [original_of(slot.material).name_full if slot.material else "" for slot in obj.material_slots]
        place = instance.world_from_object.tobytes().hex()
        part = f"instance {instance.name} {self._mesh_digests[instance.mesh]} {place} {slots} {seen}"
        self._parts.append(part)
        self.instances[instance.name] = _sha256(part.encode())
        self._light.append(f"materials {instance.name} {slots}")

    def material(self, material) -> None:
        if material is not None:
            flat = (*material.diffuse_color, material.metallic, material.roughness)
            self._parts.append(f"material {original_of(material).name_full} {flat} {self._tree(material.node_tree)}")

    def light(self, obj, matrix: np.ndarray) -> None:
        values = self._struct(obj.data, 0)
        place = matrix.tobytes().hex()
        self._parts.append(f"light {place} {obj.visible_glossy} {values} {self._tree(obj.data.node_tree)}")

    def world(self, scene, view_layer) -> None:
        """The world, what of the render settings changes light, and the frame where an image follows it."""
        world = view_layer.world_override or scene.world
        if world is not None:
            visibility = getattr(world, "cycles_visibility", None)
            seen = [getattr(visibility, kind, None) for kind in ("diffuse", "glossy", "transmission", "scatter")]
            self._parts.append(f"world {world.color[:]} {seen} {self._tree(world.node_tree)}")
        override = view_layer.material_override
        self._parts.append(f"override {override.name_full if override else ''}")
        self.material(override)
        # From the original: render settings alone do not make the depsgraph copy the scene again.
        cycles = getattr(scene.original, "cycles", None)  # None while the Cycles add-on is off
        self._parts.append(f"light transport {[getattr(cycles, name, None) for name in LIGHT_TRANSPORT]}")
        self._parts.append(f"space {bpy.data.colorspace.working_space}")
        if self._follows_frame:
            self._parts.append(f"frame {scene.frame_current}")

    def _tree(self, tree, depth: int = 0) -> str:
        """Nodes with their settings and unlinked values, and links, of a node tree and the groups in it; what only EEVEE reads
        is left out."""
        if tree is None:
            return ""
        lines = []
        for node in tree.nodes:
            if is_for_eevee_alone(node):
                continue
            values = [_plain(s.default_value) for s in node.inputs if hasattr(s, "default_value") and not s.is_linked]
            constants = [_plain(s.default_value) for s in node.outputs if hasattr(s, "default_value")]
            inner = self._tree(node.node_tree, depth + 1) if node.type == "GROUP" and depth < 16 else ""
            lines.append(f"{node.name} {node.bl_idname} {values} {constants} {self._struct(node, 0)} {inner}")
        for link in tree.links:
            if is_for_eevee_alone(link.to_node) or is_for_eevee_alone(link.from_node):
                continue
            ends = (link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier)
            lines.append(f"link {ends} {link.is_muted}")
        return _sha256("\n".join(sorted(lines)).encode())

    def _struct(self, struct, depth: int) -> str:
        parts = []
        for prop in struct.bl_rna.properties:
            if prop.identifier in EDITOR_ONLY or depth > DEEPEST:
                continue
            value = getattr(struct, prop.identifier)
            if prop.type == "POINTER":
                value = self._pointer(value, depth)
            elif prop.type == "COLLECTION":
                value = [self._pointer(item, depth) for item in value]
            else:
                value = _plain(value)
            parts.append(f"{prop.identifier}={value}")
        return ";".join(parts)

    def _pointer(self, value, depth: int) -> str:
        if value is None:
            return ""
        if isinstance(value, bpy.types.Image):
            return self._image(value)
        if isinstance(value, bpy.types.ID):
            return value.name_full
        return self._struct(value, depth + 1)

    def _image(self, image) -> str:
        self._follows_frame |= image.source in {"SEQUENCE", "MOVIE"}
        colors = (image.colorspace_settings.name, image.alpha_mode)
        if image.packed_file:
            return f"packed {image.packed_file.size} {colors}"
        if image.filepath:
            return f"file {_file_digest(Path(bpy.path.abspath(image.filepath, library=image.library)))} {colors}"
        return f"generated {tuple(image.size)} {image.generated_type} {tuple(image.generated_color)} {colors}"


def _file_digest(path: Path) -> str:
    """sha256 of a file's content; 'missing' where there is none. A sequence counts by its first file."""
    try:
        status = path.stat()
    except OSError:
        return "missing"
    return _content_digest(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=1024)
def _content_digest(path: Path, changed: int, size: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _plain(value) -> str:
    return repr(tuple(value)) if hasattr(value, "__len__") and not isinstance(value, (str, set)) else repr(value)


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
