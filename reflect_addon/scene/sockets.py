"""Where a shader socket's value comes from: through groups, reroutes and muted nodes, reduced to one constant."""

from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np

# The group nodes that were entered on the way to a socket, outermost first.
Groups = tuple[bpy.types.Node, ...]


@dataclass
class Reducer:
    """Follows sockets of one material; notes in words what it had to simplify."""

    notes: list[str] = field(default_factory=list)

    def source(self, socket: bpy.types.NodeSocket, path: Groups):
        """(output socket that feeds this input, path), or (the unlinked input itself that holds the value, path)."""
        for _ in range(256):  # deeper chains are no chains but loops through groups
            links = [link for link in socket.links if link.is_valid and not link.is_muted]
            if not links:
                return socket, path
            output = links[0].from_socket
            node = output.node
            if node.mute:
                inner = [link.from_socket for link in node.internal_links if link.to_socket == output]
                if not inner:
                    return output, path
                socket = inner[0]
            elif node.type == "REROUTE":
                socket = node.inputs[0]
            elif node.type == "GROUP" and node.node_tree is not None:
                inside = group_output(node.node_tree)
                if inside is None:
                    return output, path
                path, socket = (*path, node), _by_identifier(inside.inputs, output.identifier)
            elif node.type == "GROUP_INPUT" and path:
                path, socket = path[:-1], _by_identifier(path[-1].inputs, output.identifier)
            else:
                return output, path
        return socket, path

    def value(self, socket: bpy.types.NodeSocket, path: Groups):
        """The input's value: a float or (r, g, b). A texture becomes its mean, other links the socket's own default."""
        found, _ = self.source(socket, path)
        if not found.is_output:
            return self._plain(found, socket)
        origin = found.node
        if origin.type in {"RGB", "VALUE"} and not origin.mute:
            return self._plain(found, socket)
        if origin.type == "TEX_IMAGE" and origin.image is not None and not origin.mute:
            mean = image_mean(origin.image)
            if mean is not None:
                self.notes.append(f"{socket.name.lower()} is the texture {origin.image.name}; its mean is used")
                if found.name == "Alpha":
                    mean = mean[3:].repeat(3)
                return _fitting(mean[:3], socket)
        self.notes.append(f"{socket.name.lower()} comes from {origin.name}; its unlinked value is used")
        return self._plain(socket, socket)

    def _plain(self, found, socket):
        value = getattr(found, "default_value", 0.0)
        return _fitting(np.array(value, float).ravel()[:3] if hasattr(value, "__len__") else np.array([value]), socket)


# Means of images that were read before: snapshots are taken after every edit, and a large texture takes a second.
_MEANS: dict[tuple, np.ndarray] = {}


def image_mean(image: bpy.types.Image) -> np.ndarray | None:
    """Mean linear (r, g, b, a) of an image, None when it has no pixels (missing file)."""
    if image.size[0] * image.size[1] == 0:
        return None
    if image.is_dirty or not image.filepath:  # painted or generated: may differ the next time
        return _read_mean(image)
    path = Path(bpy.path.abspath(image.filepath, library=image.library))
    changed = path.stat().st_mtime_ns if path.is_file() else 0
    key = (image.original.session_uid, path, changed, tuple(image.size), image.colorspace_settings.name)
    if key not in _MEANS:
        _MEANS[key] = _read_mean(image)
    return _MEANS[key]


def _read_mean(image: bpy.types.Image) -> np.ndarray:
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(-1, image.channels)
    color = np.ones((len(pixels), 4), np.float32)
    color[:, : min(4, image.channels)] = pixels[:, :4]
    if image.channels == 1:
        color[:, 1:3] = color[:, :1]
    if image.colorspace_settings.name == "sRGB" and not image.is_float:
        # image.pixels holds the file's own, encoded bytes (IEC 61966-2-1).
        rgb = color[:, :3]
        color[:, :3] = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return color.mean(0, dtype=np.float64)


def _fitting(value: np.ndarray, socket):
    """Colours become a float, and floats a colour, as links between such sockets do."""
    if socket.type in ("VALUE", "BOOLEAN"):
        return float(value[0]) if len(value) == 1 else float(value @ np.array([0.2126, 0.7152, 0.0722]))
    return tuple(float(v) for v in (value if len(value) == 3 else value[:1].repeat(3)))


def group_output(tree: bpy.types.NodeTree):
    outputs = [n for n in tree.nodes if n.type == "GROUP_OUTPUT"]
    return next((n for n in outputs if n.is_active_output), outputs[0] if outputs else None)


def _by_identifier(sockets, identifier: str):
    return next(s for s in sockets if s.identifier == identifier)
