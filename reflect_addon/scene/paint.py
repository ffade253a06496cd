"""What lies on a mesh, hair or a cloud of points beside its shape, as a hash: UVs, colours and other attributes that textures may read."""

import hashlib

import numpy as np

# Where an attribute has its values.
VALUES = ("color", "vector", "value")
KINDS = {"FLOAT": np.float32, "INT": np.int32, "BOOLEAN": bool}
# What the shape tells already; names with a dot in front are the editor's.
OF_THE_SHAPE = {"position", "material_index", "sharp_face", "sharp_edge", "custom_normal"}


def paint_digest(data, leave_out: frozenset[str] = frozenset(OF_THE_SHAPE)) -> str:
    """sha256 of the attributes of a bpy.types.Mesh, Curves or PointCloud, and which of them are shown where none is named."""
    digest = hashlib.sha256()
    for attribute in sorted(data.attributes, key=lambda a: a.name):
        if attribute.name.startswith(".") or attribute.name in leave_out:
            continue
        digest.update(f"{attribute.name} {attribute.domain} {attribute.data_type} {len(attribute.data)}".encode())
        digest.update(_values(attribute))
    for layer in getattr(data, "uv_layers", ()):
        if layer.active_render:
            digest.update(layer.name.encode())
    digest.update(str(getattr(data.attributes, "default_color_name", "")).encode())
    return digest.hexdigest()


def _values(attribute) -> bytes:
    if not len(attribute.data):
        return b""
    known = attribute.data[0].bl_rna.properties
    name = next(name for name in VALUES if name in known)
    if known[name].type not in KINDS:
        return repr([item.value for item in attribute.data]).encode()
    values = np.empty(len(attribute.data) * max(known[name].array_length, 1), KINDS[known[name].type])
    attribute.data.foreach_get(name, values)
    return values.tobytes()
