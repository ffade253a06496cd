"""A scene, exported by every method and by `auto`, and what a browser and Godot make of it: FLIP against `render`, bytes, and times."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from reflect_addon.core.exchange.folder import named_by_gltf
from reflect_addon.core.exchange.reading import read_export
from reflect_addon.evaluation.bench import Target
from reflect_addon.evaluation.exhibit import Exhibit
from reflect_addon.evaluation.export_file import Shot, write_export
from reflect_addon.evaluation.frame import open_frame

from tools import godot

from .compared import Compared, compared, reflector_pixels
from .node_package import Failed, drawn

PROJECT = Path(__file__).resolve().parents[2] / "reflect-godot"
TEXELS = 64  # resolution of maps, and of pictures of things
ASKED = 0.05  # FLIP over the reflectors' pixels
A_METHOD_S = 900  # of a page on software OpenGL, which compiles a kernel for each kind of reflector
HEADS = (
    "method", "FLIP", "beside", "download MB", "on the card MB", "environment shown s", "loaded s", "compiled s", "frame ms",
)  # fmt: skip
GODOT_HEADS = ("method", "FLIP", "beside", "on the card MB", "loaded s", "first frames s")
# Settings of bakes in a scene of more reflectors than MANY, where the others would take hours: pictures agree as they do with fine ones, sizes are smaller.
MANY, LIGHT = 10, {"resolution": 32, "texels": 32, "samples": 2, "maps": 1, "points": 8, "turns": 12, "order": 2, "views": 4, "view_texels": 16}
RAYS = 7  # most of a pixel, as `render` sends


@dataclass(frozen=True)
class Exported:
    name: str
    folder: Path
    mask: np.ndarray  # (H, W) bool, reflectors' pixels
    methods: tuple[str, ...]
    settings: dict  # of the bakes


def exported(blend: Path, folder: Path, wanted: tuple[str, ...], shot: Shot, settings: dict, progress: Callable[[float, str], object]) -> Exported:
    """Writes folder/export, and bakes what is missing in folder/assets: a sample's own folder stays as it is. settings: beside the default ones."""
    out = folder / "export"
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    with open_frame(bpy.context.scene, None) as snapshot:
        settings = (LIGHT if len(snapshot.reflectors()) > MANY else {"resolution": TEXELS, "texels": TEXELS}) | settings
    write_export(bpy.context.scene, wanted, out, shot=shot, settings=settings, progress=progress)
    export = read_export(out)
    return Exported(blend.stem, out, reflector_pixels(blend, export), tuple(name for name in wanted if name in export.manifest.pictures[0].methods), settings)


def in_a_browser(export: Exported) -> tuple[list[Target], Exhibit]:
    """Rows of FLIP, and the table with pictures (the browser's, Blender's, eight times their difference)."""
    out = export.folder.parent / "browser"
    told = drawn(export.folder, out, export.methods, seconds=A_METHOD_S * len(export.methods))
    pairs = {name: compared(export.folder, out, name, export.mask) for name in export.methods}
    rows = [_target(export, "web", "reflect-three in headless Chromium", name, pair) for name, pair in pairs.items()]
    lead = f"{told['width']} x {told['height']} pixels, {told['device']}. Each method on a page of its own, from a server on the same machine; the environment is shown first. "
    lead += f"Opening takes {_opening(export) / 1e6:.2f} MB (manifest and glTF) and {told['opened'] / 1e3:.2f} s. Baked with {export.settings}."
    if told["said"]:
        lead += f" The page said: {told['said'][0][:200]}"
    table = tuple(_cells(name, pair, told["drawn"][name]) for name, pair in pairs.items())
    pictures = tuple((f"{name}: page, render, 8 x difference", pair.sheet()) for name, pair in pairs.items())
    return rows, Exhibit(f"{export.name} in a browser", lead, HEADS, table, pictures)


def _opening(export: Exported) -> int:
    """Bytes that are read before a method is asked for."""
    names = {"reflect.json", *named_by_gltf(export.folder), read_export(export.folder).manifest.scene.file}
    return sum((export.folder / name).stat().st_size for name in names)


def in_godot(export: Exported) -> tuple[list[Target], Exhibit]:
    """The same of Godot. tools.godot.NoGodot where there is none."""
    out = export.folder.parent / "godot"
    out.mkdir(parents=True, exist_ok=True)
    words = ["--", "--export", export.folder, "--method", ",".join(export.methods), "--rays", RAYS, "--out", out]
    done = godot.run(PROJECT, *words, limit=A_METHOD_S * len(export.methods))
    if done.returncode:
        raise Failed(f"Godot: {done.stdout[-3000:]}")
    told = json.loads((out / "drawn.json").read_text())
    picture = read_export(export.folder).manifest.pictures[0]
    pairs = {name: compared(export.folder, out, name, export.mask) for name in export.methods}
    rows = [_target(export, "godot", "reflect-godot (Compatibility)", name, pair) for name, pair in pairs.items()]
    table = tuple(
        (name, f"{pair.flip():.3f}", f"{pair.beside():.3f}", f"{told[name]['megabytes']:.1f}", f"{told[name]['loaded_ms'] / 1e3:.2f}", f"{told[name]['drawn_ms'] / 1e3:.2f}")
        for name, pair in pairs.items()
    )
    lead = f"{picture.width} x {picture.height} pixels. The export opened in {told['opened_ms'] / 1e3:.2f} s; first frames are with what the driver compiles."
    pictures = tuple((f"{name}: Godot, render, 8 x difference", pair.sheet()) for name, pair in pairs.items())
    return rows, Exhibit(f"{export.name} in Godot", lead, GODOT_HEADS, table, pictures)


def _target(export: Exported, program: str, words: str, name: str, pair: Compared) -> Target:
    error = round(pair.flip(), 4)
    how = f"FLIP of {words} against `render`, {export.name} by {name}, {int(export.mask.sum())} reflectors' pixels"
    return Target(f"export {program} {export.name} {name}", None, error, ASKED, error <= ASKED, how)


def _cells(name: str, pair: Compared, told: dict) -> tuple[str, ...]:
    first = next(step["at"] for step in told["progress"] if step["shown"] is not None)
    size = told["size"]
    numbers = (first / 1e3, told["load"] / 1e3, told["compile"] / 1e3)
    return (
        name, f"{pair.flip():.3f}", f"{pair.beside():.3f}", f"{size['download'] / 1e6:.2f}", f"{size['memory'] / 1e6:.1f}", *(f"{n:.2f}" for n in numbers), f"{told['frame']:.0f}",
    )  # fmt: skip
