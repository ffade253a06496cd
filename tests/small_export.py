"""A small export that was written without a scene: of stand-ins that core bakes, with a glTF of empty meshes. And how tests say that one is refused."""

import json
from base64 import b64encode
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from baked_methods import SETTINGS, scene_of_everything
from mesh_scenes import job

from reflect_addon.core import methods
from reflect_addon.core.asset import Asset
from reflect_addon.core.camera import Camera
from reflect_addon.core.errors import ReflectError
from reflect_addon.core.exchange import reading
from reflect_addon.core.exchange.folder import whole_folder
from reflect_addon.core.exchange.manifest import SCENE_NAME
from reflect_addon.core.look import TABLE_SIDE, Look
from reflect_addon.core.snapshot import SceneSnapshot

SMALL = {**SETTINGS, "resolution": 8, "view_texels": 4, "views": 4, "compressed": True}
KINDS = ("environment", "box_proxy", "distance_map", "light_field")


@cache
def baked() -> tuple[SceneSnapshot, dict[str, Asset]]:
    """The scene, and its mirror ball's assets by method, joined with what they require."""
    scene, done = scene_of_everything(), {}
    for name in methods.with_required(KINDS):
        method = methods.get(name)
        done[name] = method.bake(job(scene, {**method.DEFAULTS, **SMALL}, {kind: done[kind] for kind in method.REQUIRES}))
    return scene, {name: done[name].joined(*(done[kind] for kind in methods.get(name).REQUIRES)) for name in KINDS}


def look() -> Look:
    """One with a table: no colour of it is another's."""
    axis = np.linspace(0, 1, TABLE_SIDE, dtype="f")
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
    return Look(0.5, np.stack([red, 0.5 * green, 0.25 * blue], -1))


TRIANGLE = {  # one mesh of one triangle, whose material mirrors
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
    "materials": [{"name": "mirror"}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64," + b64encode(np.float32([0, 0, 0, 1, 0, 0, 0, 1, 0]).tobytes()).decode()}],
}


def write(folder: Path, given: dict[str, Asset] | None = None, ktx: str | None = None, triangle: bool = False) -> Path:
    """The export of baked(), or of other assets by method, with pictures of nothing. ktx: the program that writes float images as KTX2. triangle: meshes of one, for programs that open the glTF."""
    from reflect_addon.scene.export_gltf import GLTF_FROM_BLENDER, SceneGltf
    from reflect_addon.scene.export_scene import SceneExport

    scene, found = baked()
    with whole_folder(folder) as place:
        nodes = [{"name": "Camera", "camera": 0}]
        for instance in scene.instances:
            matrix = GLTF_FROM_BLENDER @ instance.world_from_object @ GLTF_FROM_BLENDER.T
            nodes.append({"name": instance.object_name, "mesh": 0, "matrix": matrix.T.ravel().tolist()})
        document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes, **(TRIANGLE if triangle else {})}
        (place / SCENE_NAME).write_text(json.dumps(document))
        made = SceneExport(scene, SceneGltf(place / SCENE_NAME), ktx)
        reflectors = made.answers({name: {"Mirror": asset} for name, asset in (given or found).items()}, lambda *_: None)
        made.picture("Camera", Camera(np.eye(4), np.eye(4), 4, 3), np.full((3, 4, 3), 0.5, "f"), b"truth", {name: name.encode() for name in given or found})
        made.finish(reflectors, look(), None)
    return Path(folder)


def refuses(folder: Path, words: str = "", all_of_it: bool = False) -> str:
    """Reading the export ends with a sentence that has these words and names the folder, and with a remedy; the sentence. all_of_it: images, too."""
    with pytest.raises(ReflectError) as error:
        read_everything(folder) if all_of_it else reading.read_export(folder)
    assert words in error.value.message and str(folder) in error.value.message and error.value.remedy
    return error.value.message


def read_everything(folder: Path) -> dict[str, Asset]:
    """Id -> whole asset, after all other images and kernels were read, too."""
    from reflect_addon.scene.import_assets import asset_of, image_of

    export = reading.read_export(folder)
    for shader in export.manifest.texts():
        export.content(shader)
    for key in export.manifest.images:
        image_of(export, key)
    return {key: asset_of(export, key) for key in export.bakes.assets}
