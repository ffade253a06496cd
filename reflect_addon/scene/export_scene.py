"""A scene with its stand-ins as an export's folder (docs/export-format.md): glTF, images, kernels, the look, and the manifest that names them.

Each image, kernel and asset is written once, whoever uses it: its name holds the beginning of its content's checksum.
"""

import hashlib
import json
import os
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np

from ..core import dds, methods, pixel_rays, shading
from ..core.asset import Asset, asset_of
from ..core.asset_images import size_of
from ..core.camera import Camera
from ..core.errors import ReflectError
from ..core.exchange import manifest as m
from ..core.exchange.checked import bakes_of, manifest_of
from ..core.kernel import ES_300, GODOT, emit_glsl, emitted, record_function
from ..core.kernel.glsl_text import Dialect
from ..core.look import TABLE_SIDE
from ..core.look import Look as SceneLook
from ..core.planning.plan import Plan, document_of
from ..core.snapshot import Instance, SceneSnapshot
from .export_gltf import SceneGltf
from .exr import write_exr
from .ktx2 import write_ktx2

WANTED = ("radiance", "coverage")


class SceneExport:
    """One export in the making, in the folder of its glTF: what is written so far."""

    def __init__(self, snapshot: SceneSnapshot, gltf: SceneGltf, ktx: str | None = None):
        """ktx: the program that writes float images as KTX2 (ktx2.py); None: they are EXR."""
        self._ktx = ktx
        self.folder, self.snapshot, self.gltf, self.sentences = gltf.path.parent, snapshot, gltf, []
        for name in (m.IMAGES, m.SHADERS):
            (self.folder / name).mkdir()
        self._images: dict[str, m.Image] = {}
        self._shaders: dict[str, m.Shader] = {}
        self._assets: dict[str, dict] = {}
        self._materials: list[m.Material] = []
        self._pictures: list[m.Picture] = []
        self._known: dict[object, object] = {}  # by an array's checksum: image id; by id(asset): answer
        self._kept: list[Asset] = []  # so that ids stay theirs

    def answers(self, assets: dict[str, dict[str, Asset]], say: Callable[[float, str], object]) -> tuple[m.Reflector, ...]:
        """Reflectors that have a node, each with what the methods (name -> assets by reflector) answer its rays with. The glTF is marked."""
        found: list[m.Reflector] = []
        instances = self.snapshot.reflectors()
        for k, instance in enumerate(instances):
            say(k / len(instances), f"writing {instance.name}")
            node = self.gltf.mesh_node(instance.object_name, instance.world_from_object, {r.node for r in found})
            if node is None:
                self.sentences.append(f"{instance.name} is not in the glTF that Blender's exporter wrote: it has no reflections there.")
                continue
            answers = {name: self._answer(asset) for name, some in assets.items() if (asset := asset_of(some, instance)) is not None}
            if answers:
                found.append(m.Reflector(instance.name, node, self._mirroring(instance), answers))
        self.gltf.mark([r.node for r in found])
        return tuple(found)

    def picture(self, camera: str, view: Camera, behind: np.ndarray, truth: bytes, drawn: dict[str, bytes]) -> None:
        """What Cycles says of a camera. view: it as numbers; behind: (H, W, 3), scene-linear; the others PNG files."""
        node = self.gltf.camera_node(camera)
        if node is None:
            self.sentences.append(f"The camera {camera} is not in the glTF that Blender's exporter wrote: its pictures are left out.")
            return
        (self.folder / m.PICTURES).mkdir(exist_ok=True)
        path = self.folder / m.PICTURES / "behind.exr"
        write_exr(path, np.clip(behind, 0, 65504).astype(np.float16), compression="zip")
        files = {"behind": self._named(path, "behind", "exr")} | {"truth": self._file(m.PICTURES, "truth", "png", truth)}
        shown = {name: self._file(m.PICTURES, name, "png", content) for name, content in drawn.items()}
        self._pictures.append(m.Picture(camera, node, view.width, view.height, tuple(view.clip_from_camera.T.ravel().tolist()), files["behind"], files["truth"], shown))

    def finish(self, reflectors: tuple[m.Reflector, ...], look: SceneLook, plan: Plan | None) -> m.Manifest:
        """Writes the manifest. ReflectError: it is one that readers refuse, as more than 4 GiB of images."""
        content = self.gltf.path.read_bytes()
        scene = m.SceneFile(m.SCENE_NAME, self.snapshot.scene_name, len(content), hashlib.sha256(content).hexdigest())
        table = None
        if look.table is not None:
            unrolled = look.table.transpose(1, 0, 2, 3).reshape(TABLE_SIDE, TABLE_SIDE**2, 3)  # row = green, column = 64 blue + red
            table = self._image("look", m.LOOK_KIND, np.concatenate([unrolled, np.ones_like(unrolled[..., :1])], -1).astype(np.float16))
        bakes = m.bakes_text_of(m.Bakes(self._assets, document_of(plan) if plan else None))
        (self.folder / m.BAKES_NAME).write_bytes(bakes)
        made = m.Manifest(
            f"Reflect in Blender {bpy.app.version_string}", scene, m.Look(look.exposure, table), self._images, self._shaders,
            m.Text(m.BAKES_NAME, len(bakes), hashlib.sha256(bakes).hexdigest()), tuple(self._materials),
            self._shader(surface_source(ES_300), surface_source(GODOT)), reflectors, tuple(self._pictures),
        )  # fmt: skip
        content = m.text_of(made)
        try:
            bakes_of(json.loads(bakes), Path(m.BAKES_NAME), manifest_of(json.loads(content), Path(m.FILE_NAME)))
        except ReflectError as error:  # else nobody could read the export, nor replace it
            raise ReflectError(f"This scene makes no export that could be read: {error.message.partition(': ')[2]}", "Export fewer methods with --methods.") from error
        (self.folder / m.FILE_NAME).write_bytes(content)
        return made

    def _answer(self, asset: Asset) -> m.Answer:
        if id(asset) in self._known:
            return self._known[id(asset)]
        ids = [self._asset(one) for one in (asset.alone or asset, *asset.beside)]
        kernel, other = (emitted(methods.get(asset.kind).trace, asset, WANTED, dialect) for dialect in (ES_300, GODOT))
        samplers = {sampler: self._image(name, name.rpartition("_")[2], asset.images[name]) for name, sampler in kernel.images.items()}
        slots = kernel.pack_uniforms(asset).reshape(-1, 4).tolist() if kernel.block_name else []
        answer = m.Answer(asset.kind, tuple(ids), self._shader(kernel.source, other.source), samplers, tuple(map(tuple, slots)), asset.bytes())
        self._known[id(asset)] = answer
        self._kept.append(asset)
        return answer

    def _asset(self, asset: Asset) -> str:
        entry = m.asset_entry(asset, {name: self._image(name, name.rpartition("_")[2], image) for name, image in asset.images.items()})
        key = f"{asset.kind}-{hashlib.sha256(repr(entry).encode('utf-8', 'surrogatepass')).hexdigest()[: m.DIGITS]}"
        self._assets[key] = entry
        return key

    def _mirroring(self, instance: Instance) -> tuple[int, ...]:
        """The materials of the triangles that mirror: the shiny ones, all where none is and a mark says that it mirrors (gpu/raymap.py)."""
        used = {instance.materials[slot] for slot in np.unique(self.snapshot.slots(instance))}
        some = [self.snapshot.materials[k] for k in sorted(used)]
        some = [material for material in some if material.is_reflector] or some
        rows = [m.Material(s.name, s.base_color, s.metallic, s.specular_tint, s.ior, s.specular_weight, s.roughness) for s in some]
        for row in rows:
            if row not in self._materials:
                self._materials.append(row)
        return tuple(self._materials.index(row) for row in rows)

    def _image(self, name: str, kind: str, array: np.ndarray) -> str:
        """The image's id; written unless one of the same content is there."""
        digest = hashlib.sha256(repr((kind, array.shape)).encode())
        digest.update(np.ascontiguousarray(array))
        if digest.digest() not in self._known:
            path = self._texels(kind, array)
            content = path.read_bytes()
            file = self._named(path, name, path.suffix[1:])
            key = Path(file).stem
            self._images[key] = m.Image(file, kind, *size_of(array), len(content), hashlib.sha256(content).hexdigest())
            self._known[digest.digest()] = key
        return self._known[digest.digest()]

    def _texels(self, kind: str, array: np.ndarray) -> Path:
        """A new file of an image."""
        path = self.folder / m.IMAGES / f"new.{m.ENDINGS[kind][0]}"
        if kind == "bc1":
            path.write_bytes(dds.header(array.shape) + dds.body(array).tobytes())
            return path
        if self._ktx:
            packed = path.with_suffix(".ktx2")
            write_ktx2(self._ktx, packed, array)
            if array.nbytes <= m.DEFLATED * packed.stat().st_size:
                return packed
            packed.unlink()  # of one colour, and so small that readers refuse it: an EXR is small, too
        write_exr(path, array, compression="zip")
        return path

    def _shader(self, glsl: str, godot: str) -> str:
        """The id of a kernel, given in both languages."""
        text = self._text(glsl, m.GLSL)
        key = text.sha256[: m.DIGITS]
        if key not in self._shaders:
            self._shaders[key] = m.Shader(text.file, text.bytes, text.sha256, self._text(godot, m.GODOT))
        return key

    def _text(self, source: str, ending: str) -> m.Text:
        content = source.encode("ascii")
        return m.Text(self._file(m.SHADERS, "", ending, content), len(content), hashlib.sha256(content).hexdigest())

    def _file(self, folder: str, name: str, ending: str, content: bytes) -> str:
        path = self.folder / folder / f"new.{ending}"
        path.write_bytes(content)
        return self._named(path, name, ending)

    def _named(self, path: Path, name: str, ending: str) -> str:
        """Renames a file of the export by its content; its name below the folder."""
        digits = hashlib.sha256(path.read_bytes()).hexdigest()[: m.DIGITS]
        new = path.with_name(f"{name}{'-' * bool(name)}{digits}.{ending}")
        os.replace(path, new)
        return new.relative_to(self.folder).as_posix()


def surface_source(dialect: Dialect) -> str:
    """What a surface does before and after a ray is answered: how many rays a pixel sends (core/pixel_rays.py), and what it makes of what they bring (core/shading.py)."""
    mirrors = record_function(shading.reflectance, shading.REFLECTANCE_INPUTS, options={"has_metal": True, "has_dielectric": True})
    pixel = record_function(pixel_rays.rays, pixel_rays.INPUTS)
    parts = ((mirrors, ("reflectance", "opacity"), "surface_reflectance"), (pixel, ("rays", "line", "width", "spread"), "rays_of_pixel"))
    return "".join(emit_glsl(program, wanted, name, dialect=dialect).source for program, wanted, name in parts)
