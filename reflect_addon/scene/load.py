"""What was baked, read back: a reflector's asset joined with what its method requires, ready to be drawn."""

import os
from pathlib import Path

from ..core import methods, surface_asset
from ..core.asset import Asset
from ..core.asset_files import BAKE_AGAIN, load_asset
from ..core.asset_places import asset_name
from ..core.errors import ReflectError
from ..core.kernel import record
from ..core.planning.plan import Plan, read_plan
from ..core.snapshot import Instance, SceneSnapshot

PLANNED = "auto"  # folder of what a plan took (auto.py), below that of the assets that were asked for by name


def draws_surfaces(method: str) -> bool:
    """Whether the method needs the scene's surface radiance."""
    return bool(getattr(methods.get(method), "SURFACES", None))


def load_surfaces(method: str, folder: Path) -> Asset | None:
    """The scene's surface radiance where the method needs it, of `auto` one that its plan has. ReflectError when it is damaged or was never baked."""
    kinds = [method]
    if method == methods.AUTO:
        folder, plan = Path(folder) / PLANNED, plan_in(folder)
        kinds = [row.method for row in plan.rows] if plan else []
    needed = any(kind in methods.names() and draws_surfaces(kind) for kind in kinds)
    return load_kind(Path(folder) / asset_name(surface_asset.KIND, ""), surface_asset.KIND) if needed else None


def load_assets(scene: SceneSnapshot, method: str, folder: Path, alone: bool = False) -> dict[str, Asset]:
    """Reflector name -> asset joined with what it requires, for every reflector that has one on disk; unless `alone`, with the
    method's companion, too, where one is there.

    Of `auto`: whichever method its plan has for each. Damaged assets raise ReflectError; reflectors that were never baked are simply missing
    from the result.
    """
    if method == methods.AUTO:
        return _load_planned(scene, Path(folder) / PLANNED)
    found, joined = {}, {}
    loaded: dict[Path, Asset] = {}

    def load(kind: str, reflector: Instance) -> Asset | None:
        path = _path(folder, kind, reflector)
        if path is not None and path not in loaded:
            loaded[path] = load_kind(path, kind)
        return loaded.get(path)

    for reflector in scene.reflectors():
        own, *others = assets = [load(kind, reflector) for kind in (method, *methods.get(method).REQUIRES)]
        if None in assets:
            continue
        beside = (load(kind, reflector) for kind in (() if alone else methods.companions(method, own.settings)))
        others += [asset for asset in beside if asset is not None][:1]
        key = (id(own), *map(id, others))  # one object where reflectors share all of it
        if key not in joined:
            joined[key] = answering(own, others, _path(folder, method, reflector))
        found[reflector.name] = joined[key]
    return found


def _path(folder: Path, kind: str, reflector: Instance) -> Path | None:
    """Where the asset for this reflector lies: its own, or the one for all."""
    places = (Path(folder) / asset_name(kind, name) for name in (reflector.name, ""))
    return next((path for path in places if os.path.isfile(path / "asset.json")), None)


def load_kind(path: Path, kind: str) -> Asset:
    """The asset in the folder, which must be of this kind."""
    asset = load_asset(path)
    if asset.kind != kind:
        raise ReflectError(f"{path} is an asset of {asset.kind}, not of {kind}.", BAKE_AGAIN)
    return asset


def answering(own: Asset, others: list[Asset], path: Path) -> Asset:
    """The asset joined with those it requires, when it has all that its kernel asks for: a whole asset of another version
    or program may not."""
    try:
        asset = own.joined(*others)
        record(methods.get(own.kind).trace, asset)
    except (KeyError, ValueError, TypeError) as error:
        raise ReflectError(f"{path} lacks what {own.kind} needs ({error}).", BAKE_AGAIN) from error
    return asset


def plan_in(folder: Path) -> Plan | None:
    """The plan that a folder's assets of `auto` were baked by. ReflectError where it is damaged or of a newer version."""
    return read_plan(Path(folder) / PLANNED)


def _load_planned(scene: SceneSnapshot, below: Path) -> dict[str, Asset]:
    plan = read_plan(below)
    if plan is None:
        return {}
    by_method: dict[str, set[str]] = {}
    for row in plan.rows:
        if row.method not in methods.names():
            raise ReflectError(f"{below} has a plan with the method {row.method}, which this version does not know.", BAKE_AGAIN)
        by_method.setdefault(row.method, set()).add(row.reflector)
    found = {}
    for method, names in by_method.items():
        found |= {name: asset for name, asset in load_assets(scene, method, below, alone=True).items() if name in names}
    return found
