"""A bake in independent parts: which assets each makes, so that all parts together are what one process would have made, bit for bit.

Problem. In one run assets take from each other: a stand-in of something flat is captured for the first reflector and taken over for the others, and the
surfaces that methods draw are one asset for all. Captured by itself in another process, the same texel would have other noise.
Idea. The unit is an asset, a method for a reflector, with what it requires made beside it where it is needed (an environment map more costs seconds). Units that
take from each other stay together: those of methods with the same word TOGETHER, for all reflectors; those that one asset serves (`shared`); and all whose
surfaces are baked (SURFACES, `live`). What stays together is baked by bake_assets in the order in which the whole would have been, and so is the same.
`auto` is one unit: its choices weigh all reflectors against each other, and what its proofs find decides what else is baked.
What is left out: a single asset is not split. Its rays are traced in bundles, whose noise depends on where a ray stands in its bundle.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import bpy

from ..core import methods, surface_asset
from ..core.asset_places import asset_name
from ..core.part_record import PartRecord, begin, file_sum, finish, version
from ..core.parts import Part, dealt, joined
from ..core.planning.plan import words
from ..core.progress import Progress
from ..core.scene_items import digest, items_of
from ..core.snapshot import Instance, SceneSnapshot
from .auto import bake_auto
from .bake import bake_assets, chosen_reflectors
from .freshness import settings_for
from .load import PLANNED, draws_surfaces
from .raytrace import trace

SURFACES = "surfaces"  # what units whose surfaces are baked have in common
SURFACES_EFFORT = 5.0  # of the surfaces of a scene, in environment maps'
AUTO_EFFORT = 10.0  # of a reflector that is planned, in the same


@dataclass(frozen=True)
class Unit:
    """The asset of a method for a reflector; of `auto`, all of them."""

    kind: str
    reflector: Instance | None
    words: frozenset[str]  # units that have one in common are made together
    effort: float
    shared: bool = False  # one asset for all reflectors

    def name(self) -> str:
        return f"{self.kind} of {self.reflector.name}" if self.reflector else self.kind

    def folder(self) -> str:
        """Of the asset, below the bake's."""
        return PLANNED if self.reflector is None else asset_name(self.kind, "" if self.shared else self.reflector.name)


def units_of(scene: SceneSnapshot, wanted: tuple[str, ...], reflectors: list[str] | tuple[str, ...], settings: dict[str, object]) -> list[Unit]:
    """All units of a bake, in the order in which it makes them. As bake_assets' arguments; ReflectError as there."""
    units = []
    chosen = chosen_reflectors(scene, reflectors)
    for reflector in chosen:
        for kind in methods.with_required(tuple(k for k in wanted if k != methods.AUTO)):
            asked = settings_for(kind, settings)
            common = {getattr(methods.get(kind), "TOGETHER", "")} | ({kind} if asked.get("shared") else set())
            common |= {SURFACES} if asked.get("live") or draws_surfaces(kind) else set()
            effort = getattr(methods.get(kind), "BAKE_EFFORT", 1.0)
            units.append(Unit(kind, reflector, frozenset(common - {""}), effort, bool(asked.get("shared"))))
    if methods.AUTO in wanted:
        units.append(Unit(methods.AUTO, None, frozenset(), AUTO_EFFORT * len(chosen)))
    return units


def parts_of(units: list[Unit], of: int) -> list[int]:
    """For each unit its part, 1 .. of."""
    common = sorted({word for unit in units for word in unit.words})
    groups = joined(len(units), [[i for i, unit in enumerate(units) if word in unit.words] for word in common])
    efforts = [unit.effort for unit in units]
    for first in [i for i, unit in enumerate(units) if SURFACES in unit.words][:1]:
        efforts[first] += SURFACES_EFFORT
    return dealt(efforts, groups, of)


def bake_part(
    scene: bpy.types.Scene, snapshot: SceneSnapshot, wanted: tuple[str, ...], folder: Path, part: Part, *, reflectors: list[str] = (), settings: dict[str, object],
    progress: Progress | None = None, again: bool = False, tracer: Callable | None = None,
) -> list[Path]:  # fmt: skip
    """Bakes one part into a folder that it has for itself; returns the folders of its assets. Arguments as bake_assets', errors too, and begin's."""
    units = units_of(snapshot, wanted, reflectors, settings)
    mine = [unit for unit, number in zip(units, parts_of(units, part.of), strict=True) if number == part.index]
    job = job_of(scene, snapshot) | {
        "methods": ", ".join(wanted),
        "reflectors": ", ".join(i.name for i in chosen_reflectors(snapshot, reflectors)),
        "settings": ", ".join(words(settings)),
    }
    record = PartRecord("bake", str(part), job, tuple(u.name() for u in units), tuple(u.name() for u in mine), False, {}, (), ())
    begin(record, folder)
    more = {"reflectors": reflectors, "settings": settings, "progress": progress, "again": again, "tracer": tracer or partial(trace, scene=scene)}
    paths: list[Path] = []
    if only := {(kind, unit.reflector.name) for unit in mine if unit.reflector for kind in methods.with_required((unit.kind,))}:
        named = tuple(name for name in wanted if name != methods.AUTO)
        paths += bake_assets(snapshot, named, folder, only=only, **more)
    if any(unit.reflector is None for unit in mine):
        bake_auto(scene, snapshot, folder, **more)
        paths.append(folder / PLANNED)
    owned = [folder / unit.folder() for unit in mine]
    surfaces = folder / asset_name(surface_asset.KIND, "")
    if any(SURFACES in unit.words for unit in mine) and surfaces.is_dir():
        paths, owned = [*paths, surfaces], [*owned, surfaces]
    replaces = [asset_name(unit.kind, unit.reflector.name) for unit in mine if unit.shared]
    finish(record, folder, paths, owned, replaces)
    return list(dict.fromkeys(owned))


def job_of(scene: bpy.types.Scene, snapshot: SceneSnapshot) -> dict[str, str]:
    """What decides the content of any part, whatever it makes: by words for people."""
    path = Path(bpy.data.filepath)
    return {
        "file": f"{path.name} {file_sum(path)}" if bpy.data.filepath else "",
        "scene": scene.name,
        "frame": str(snapshot.frame),
        "scene's content": digest(items_of(snapshot)),
        "Blender": bpy.app.version_string,
        "Reflect": version(),
    }
