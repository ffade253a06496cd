"""Node trees and other structures of Blender as text, without what only the editor shows and without names of data-blocks: equal text, equal light.

What a tree says of things outside of it is collected on the way: whether an image follows the frame, and what its nodes ask of objects.
"""

import hashlib
import stat
from collections.abc import Collection
from functools import lru_cache
from pathlib import Path

import bpy
import numpy as np

from .native_marks import is_for_eevee_alone

# Everywhere: what Blender works out or counts by itself, names, and what is selected.
NOT_CONTENT = {
    "rna_type", "name", "name_full", "select", "session_uid", "users", "tag", "original", "is_evaluated", "preview", "animation_data",
    "use_fake_user", "use_extra_user", "use_nodes", "library", "library_weak_reference", "override_library", "asset_data",
    "is_embedded_data", "is_linked_packed", "is_missing", "is_runtime_data", "is_editable", "is_library_indirect", "id_type", "node_tree",
}  # fmt: skip
# Of nodes: where they lie in the editor, and what tree() reads. (Of what is in a node, a ramp's color and a curve's location are content.)
EDITOR_ONLY = {
    "label", "location", "location_absolute", "width", "height", "dimensions", "show_options", "show_preview", "show_texture", "hide",
    "color", "use_custom_color", "color_tag", "parent", "internal_links", "inputs", "outputs", "bl_idname", "bl_label", "bl_description",
    "bl_icon", "bl_static_type", "bl_width_default", "bl_width_min", "bl_width_max", "bl_height_default", "bl_height_min",
    "bl_height_max", "warning_propagation",
}  # fmt: skip
DEEPEST = 6  # nested structures below a node: ramps, curve mappings and their points


class ShaderText:
    """tree() and struct() add to follows_frame, asks_objects and attributes; `fresh` forgets the first, which is told item by item."""

    def __init__(self):
        self.follows_frame = False  # an image of what was read since is a film
        self.asks_objects = False  # a tree shows colours or numbers of the objects that have it
        self.attributes: set[str] = set()  # names of objects' properties that trees show

    def tree(self, tree, depth: int = 0) -> str:
        """sha256 of nodes with their settings and unlinked values, and links, of a node tree and the groups in it; what only EEVEE reads
        is left out."""
        if tree is None:
            return ""
        lines = []
        for node in tree.nodes:
            if is_for_eevee_alone(node):
                continue
            self.asks_objects |= node.type == "OBJECT_INFO"
            if node.type == "ATTRIBUTE" and node.attribute_type != "GEOMETRY":
                self.attributes.add(node.attribute_name)
            values = [plain(s.default_value) for s in node.inputs if hasattr(s, "default_value") and not s.is_linked]
            constants = [plain(s.default_value) for s in node.outputs if hasattr(s, "default_value")]
            inner = self.tree(node.node_tree, depth + 1) if node.type == "GROUP" and depth < 16 else ""
            lines.append(f"{node.name} {node.bl_idname} {values} {constants} {self.struct(node, but=EDITOR_ONLY)} {inner}")
        for link in tree.links:
            if is_for_eevee_alone(link.to_node) or is_for_eevee_alone(link.from_node):
                continue
            ends = (link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier)
            lines.append(f"link {ends} {link.is_muted}")
        return sha256("\n".join(sorted(lines)))

    def struct(self, struct, depth: int = 0, but: Collection[str] = ()) -> str:
        """All properties of a structure, but these, and of those in it."""
        parts = []
        for prop in struct.bl_rna.properties:
            if prop.identifier in NOT_CONTENT or prop.identifier in but or depth > DEEPEST:
                continue
            value = getattr(struct, prop.identifier)
            if prop.type == "POINTER":
                value = self._pointer(value, depth)
            elif prop.type == "COLLECTION":
                value = [self._pointer(item, depth) for item in value]
            else:
                value = plain(value)
            parts.append(f"{prop.identifier}={value}")
        return ";".join(parts)

    def fresh(self) -> "ShaderText":
        self.follows_frame = False
        return self

    def _pointer(self, value, depth: int) -> str:
        if value is None:
            return ""
        if isinstance(value, bpy.types.Image):
            return self._image(value)
        if isinstance(value, bpy.types.Object):  # whose coordinates a texture has
            return f"object {np.array(value.matrix_world, np.float64).tobytes().hex()}"
        if isinstance(value, bpy.types.Text):
            return sha256(value.as_string())
        if isinstance(value, bpy.types.ID):
            return value.name_full
        return self.struct(value, depth + 1)

    def _image(self, image) -> str:
        self.follows_frame |= image.source in {"SEQUENCE", "MOVIE"}
        colors = (image.colorspace_settings.name, image.alpha_mode)
        if image.packed_file:
            return f"packed {image.packed_file.size} {colors}"
        if image.filepath:
            path = bpy.path.abspath(image.filepath, library=image.library)
            tiles = [str(tile.number) for tile in image.tiles] if image.source == "TILED" else [""]
            return f"file {[file_digest(Path(path.replace('<UDIM>', tile))) for tile in tiles]} {tiles} {colors}"
        return f"generated {tuple(image.size)} {image.generated_type} {tuple(image.generated_color)} {colors}"


def file_digest(path: Path) -> str:
    """sha256 of a file's content; 'missing' where there is none. A sequence counts by its first file."""
    try:
        status = path.stat()
    except OSError:
        return "missing"
    if not stat.S_ISREG(status.st_mode):
        return "no file"
    return _content_digest(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=1024)
def _content_digest(path: Path, changed: int, size: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def plain(value) -> str:
    return repr(tuple(value)) if hasattr(value, "__len__") and not isinstance(value, (str, set)) else repr(value)


def sha256(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
