"""The scene as glTF by Blender's own exporter, and where in it reflectors and cameras are.

Problem. Another program needs the scene, and to know which of its nodes mirror. The exporter names nodes by their objects, but a name may be that of several
(instances), and what it leaves out it does not say.
Idea. A node is a reflector's when it has its object's name and a mesh, and stands where the reflector stands; the nearest of several is taken.
Limits. What the exporter cannot write (area lamps, volumes, the world, most of a material's nodes) is not in the glTF; Reflect's stand-ins show it all the same.
"""

import json
from pathlib import Path

import bpy
import numpy as np

from ..core.asset_places import file_name
from ..core.errors import ReflectError
from ..core.exchange.manifest import EXTENSION, FILE_NAME, SCENE_NAME
from ..core.safe_write import ELSEWHERE
from .native_marks import original_of
from .restore import Change, attributes

TEXTURES = "textures"  # folder of the glTF's own images
# gltf = GLTF_FROM_BLENDER blender: z up becomes y up.
GLTF_FROM_BLENDER = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], np.float64)
OF_NODES = "GN Instance"  # what the exporter calls instances of geometry nodes, whatever they are
APART = 1e-3  # of a matrix's largest number: float32, and parents' transforms multiplied

SETTINGS = {
    "export_format": "GLTF_SEPARATE", "export_texture_dir": TEXTURES, "export_yup": True, "export_apply": True, "export_gn_mesh": True,
    "use_renderable": True, "use_active_scene": True, "export_cameras": True, "export_lights": True, "export_normals": True,
    "export_animations": False, "export_extras": False, "export_morph": False, "export_skins": False, "check_existing": False,
}  # fmt: skip


def export_gltf(scene: bpy.types.Scene, folder: Path) -> "SceneGltf":
    """Writes the glTF of a scene into a folder. To be called while the scene is as a render shows it (evaluation/frame.open_frame). ReflectError: the exporter
    is switched off or fails."""
    path = Path(folder) / SCENE_NAME
    layer = next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    try:
        with attributes([*_own_materials(scene), *_file_names()]), bpy.context.temp_override(scene=scene, view_layer=layer):
            bpy.ops.export_scene.gltf(filepath=str(path), **SETTINGS)
        textures = path.parent / TEXTURES
        if textures.is_dir() and not any(textures.iterdir()):
            textures.rmdir()
        return SceneGltf(path)
    except (RuntimeError, AttributeError, ValueError, OSError) as error:
        reason = " ".join(str(error).split()).removeprefix("Error: ")
        raise ReflectError(f"Blender's glTF exporter failed: {reason or 'no reason given'}.", f"Switch its add-on on and try File > Export > glTF. {ELSEWHERE}") from error


class SceneGltf:
    """A glTF file that Blender's exporter wrote: where in it things are, and our mark on it."""

    def __init__(self, path: Path):
        self.path = Path(path)
        self.document = json.loads(self.path.read_bytes())
        self._nodes = self.document.get("nodes", [])
        self._places = self._world_matrices()

    def mesh_node(self, name: str, world_from_object: np.ndarray, taken=frozenset()) -> int | None:
        """The node of an object's mesh that stands there (Blender's world), not among `taken`; None where the exporter wrote none."""
        wanted = GLTF_FROM_BLENDER @ world_from_object @ GLTF_FROM_BLENDER.T
        within = APART * max(np.abs(wanted).max(), 1e-6)
        for called in (name, OF_NODES):
            found = [(np.abs(self._places[k] - wanted).max(), k) for k in self._places if k not in taken and self._is_mesh(k, called)]
            apart, node = min(found, default=(np.inf, None))
            if apart <= within:
                return node
        return None

    def _is_mesh(self, node: int, name: str) -> bool:
        return "mesh" in self._nodes[node] and self._nodes[node].get("name") == name

    def camera_node(self, name: str) -> int | None:
        """The node of a camera object's camera: its own, or that of a child that the exporter made to turn it."""
        for k, node in enumerate(self._nodes):
            if node.get("name") == name:
                inside = [k, *node.get("children", ())]
                return next((child for child in inside if "camera" in self._nodes[child]), None)
        return None

    def mark(self, nodes: list[int]) -> None:
        """Puts the vendor's extension into the document and its file: which node is which reflector's, by their order."""
        used = self.document.setdefault("extensionsUsed", [])
        used.append(EXTENSION)
        self.document.setdefault("extensions", {})[EXTENSION] = {"manifest": FILE_NAME}
        for index, node in enumerate(nodes):
            self._nodes[node].setdefault("extensions", {})[EXTENSION] = {"reflector": index}
        self.path.write_text(json.dumps(self.document, indent=1, allow_nan=False), encoding="ascii")

    def _world_matrices(self) -> dict[int, np.ndarray]:
        """By node of the scene: gltf's world from the node."""
        found, todo = {}, [(node, np.eye(4)) for node in self.document["scenes"][self.document.get("scene", 0)].get("nodes", ())]
        while todo:
            node, above = todo.pop()
            found[node] = above @ matrix_of(self._nodes[node])
            todo += [(child, found[node]) for child in self._nodes[node].get("children", ())]
        return found


def _own_materials(scene: bpy.types.Scene) -> list[Change]:
    """The artist's materials in place of those of *Use in Materials*, whose nodes only Blender draws."""
    slots = [slot for obj in scene.objects if obj.library is None for slot in obj.material_slots]
    return [(slot, "material", original_of(slot.material)) for slot in slots if original_of(slot.material) != slot.material]


def _file_names() -> list[Change]:
    """Images under names that every system takes for a file's: the exporter writes to their names as they are, and one may be "../../photo". ReflectError: such a
    name in a linked file, where it cannot be changed."""
    images = [image for image in bpy.data.images if image.type not in ("RENDER_RESULT", "COMPOSITING")]
    for image in images:
        if not image.is_editable and any(c in '/\\:' for c in image.name):
            raise ReflectError(f"The linked image {image.name} has a name that no file can have, and Blender's exporter would write to it.", "Rename it in its own file.")
    return [(image, "name", file_name(image.name)) for image in images if image.is_editable]


def matrix_of(node: dict) -> np.ndarray:
    """(4, 4) of a glTF node, its parent from itself."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), np.float64)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    out = np.eye(4)
    out[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)), np.float64)
    out[:3, 3] = node.get("translation", (0, 0, 0))
    return out
