"""An export's stand-ins as assets on disk again, where a bake would have put them: what Reflect wrote, it draws as before."""

from collections.abc import Callable
from pathlib import Path

from ..core import dds, methods
from ..core.asset import Asset
from ..core.asset_files import save_asset
from ..core.asset_places import asset_name
from ..core.errors import ReflectError
from ..core.exchange.checked import EXPORT_AGAIN
from ..core.exchange.manifest import shape_of
from ..core.exchange.reading import Export
from ..core.planning.plan import plan_of, write_plan
from .exr import read_whole_exr
from .ktx2 import read_ktx2
from .load import PLANNED


def import_assets(export: Export, folder: Path, say: Callable[[float, str], object]) -> list[Path]:
    """Writes them below `folder`, those of `auto` with its plan where a bake has them. Returns the assets' folders. ReflectError where an image is damaged."""
    places: dict[Path, str] = {}
    for reflector in export.manifest.reflectors:
        for method, answer in reflector.methods.items():
            below = Path(folder) / PLANNED if method == methods.AUTO else Path(folder)
            for key in answer.assets:
                asset = export.asset(key)
                places[below / asset_name(asset.kind, asset.reflector)] = key
    if not places:
        raise ReflectError(f"{export.folder} has no asset.", EXPORT_AGAIN)
    for k, (place, key) in enumerate(places.items()):
        say(k / len(places), f"reading {key}")
        save_asset(asset_of(export, key), place)
    if export.bakes.plan is not None:
        write_plan(plan_of(export.bakes.plan), Path(folder) / PLANNED)
    return list(places)


def asset_of(export: Export, key: str) -> Asset:
    """The whole asset of an id."""
    asset = export.asset(key)
    images = {name: image_of(export, image) for name, image in export.bakes.assets[key]["images"].items()}
    asset.images.update(images)
    return asset


def image_of(export: Export, key: str):
    """The array of an image's id, as an asset keeps it. ReflectError where the file is damaged."""
    image = export.manifest.images[key]
    data, path = export.content(image), export.folder / image.file
    if image.kind == "bc1":
        if (blocks := dds.blocks(data, shape_of(image))) is None:
            raise ReflectError(f"{path} is damaged: it does not hold the blocks that the manifest declares.", EXPORT_AGAIN)
        return blocks
    if image.file.endswith(".ktx2"):
        return read_ktx2(path, data)
    return read_whole_exr(path, image.height, image.width, "float" if image.kind == "buf" else "half")
