"""Every property of every data-block as plain values, so that two states of a file can be compared.

Bytes of two saved files differ although nothing changed (they hold memory addresses), so the comparison walks what
Blender's own type system lists: numbers, strings, enums, arrays, nested structures, collections and custom properties.
A reference to a data-block is written as its type and name. Left out are windows, session_uid (counts up by itself) and
the tag bits that scripts use as scratch.
"""

import bpy

# use_nodes is always true, and reading it warns that it will go.
SKIPPED = {"rna_type", "session_uid", "tag", "original", "preview", "depsgraph", "use_nodes"}
WINDOWS = {"all_ids", "screens", "workspaces", "window_managers"}  # duplicates; what the person looks at


def dump(only: tuple[str, ...] = ()) -> dict[str, object]:
    """'Collection/name' -> nested tuples of its values, of all collections or of those named. Walked twice: some layers of a mesh exist
    only once read."""
    _walk(only)
    return _walk(only)


def _walk(only):
    out = {}
    for prop in bpy.data.bl_rna.properties:
        if prop.type != "COLLECTION" or prop.identifier in WINDOWS or (only and prop.identifier not in only):
            continue
        for block in getattr(bpy.data, prop.identifier):
            out[f"{prop.identifier}/{block.name_full}"] = _struct(block, 0)
    return out


def dump_saved(path) -> dict[str, object]:
    """The dump of a saved file, loaded into this process."""
    bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
    return dump()


def _struct(struct, depth):
    values = []
    for prop in struct.bl_rna.properties:
        name = prop.identifier
        if name in SKIPPED:
            continue
        values.append((name, _value(struct, prop, name, depth)))
    for key in sorted(struct.keys()) if hasattr(struct, "keys") and _has_idprops(struct) else ():
        values.append((f'["{key}"]', _plain(struct[key])))
    return tuple(values)


def _has_idprops(struct) -> bool:
    return isinstance(struct, (bpy.types.ID, bpy.types.Bone, bpy.types.PoseBone))


def _value(struct, prop, name, depth):
    value = getattr(struct, name)
    if prop.type == "POINTER":
        return _pointer(value, depth)
    if prop.type == "COLLECTION":
        return tuple(_pointer(item, depth) for item in value)
    if getattr(prop, "is_array", False):
        return repr(_plain(value))
    return repr(value)


def _pointer(value, depth):
    if value is None:
        return None
    if isinstance(value, bpy.types.ID) and not value.is_embedded_data:
        return (type(value).__name__, value.name_full)
    # Deep enough for nodes' sockets and modifiers' curves; parents that point back end here.
    return _struct(value, depth + 1) if depth < 5 else type(value).__name__


def _plain(value):
    if hasattr(value, "to_dict"):
        return tuple(sorted((k, repr(v)) for k, v in value.to_dict().items()))
    if hasattr(value, "to_list"):
        return value.to_list()
    if hasattr(value, "__len__") and not isinstance(value, (str, bytes)):
        return tuple(_plain(v) for v in value)
    return value
