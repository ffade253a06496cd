"""What lies on a mesh, hair or a cloud of points beside its shape, as a hash: UVs, colours and other attributes that textures may read."""

import hashlib

import numpy as np

# By Blender's type of an attribute: (name of its values, how many numbers each has); all others have one `value`.
VALUES = {
    "FLOAT_VECTOR": ("vector", 3), "FLOAT2": ("vector", 2), "FLOAT_COLOR": ("color", 4), "BYTE_COLOR": ("color", 4),
    "INT32_2D": ("value", 2), "INT16_2D": ("value", 2), "QUATERNION": ("value", 4), "FLOAT4X4": ("value", 16),
}  # fmt: skip
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
    if attribute.data_type == "STRING":
        return repr([item.value for item in attribute.data]).encode()
    name, width = VALUES.get(attribute.data_type, ("value", 1))
    kind = {"BOOLEAN": bool, "INT": np.int32, "INT8": np.int32}.get(attribute.data_type, np.float32)
    values = np.empty(len(attribute.data) * width, np.int32 if name == "value" and width == 2 else kind)
    attribute.data.foreach_get(name, values)
    return values.tobytes()
