"""The reflection buffer of any ray map: each reflector is answered as its asset's method does it, by what draws and by what gathers.

The window's own picture and each level of mirrors in mirrors (levels.py) are filled by the same passes.
"""

from collections.abc import Callable
from dataclasses import dataclass

from ..core import live_maps, lobe_rays, mirrors
from ..core.asset import Asset, asset_of
from ..core.camera import Camera
from ..core.snapshot import SceneSnapshot
from .background import BACKGROUND
from .counts import Counts
from .fill import Fill
from .glass import Bodies, Body, is_body
from .level_targets import Seen
from .levels import Levels
from .raymap import RayMapPass
from .resolve import Resolve
from .resolve_tables import MaterialTable
from .texture_cache import TextureCache
from .upload import triangle_batch
from .virtual import Projector

# Growth of a footprint by roughness up to which a reflector shows virtual objects: that of mirrors to mirrors.
SHARPEST = 4.0 * mirrors.ROUGHEST**2
# Pixels across: what a narrower reflector shows is a blur of colours, which distance maps give as well.
SMALLEST = 12


def background_kernel(kind: str) -> Callable | None:
    """A method's kernel for a camera's own rays, where it has another for them."""
    from ..core import methods

    return getattr(methods.get(kind), "trace_background", None) if kind in methods.names() else None


@dataclass(frozen=True)
class Group:
    """Neighbouring reflectors answered from one asset in one pass."""

    asset: Asset
    first: int  # index into SceneSnapshot.reflectors()
    last: int
    # Whether some surface sends several rays over its lobe: where that shows, at the outlines of stand-ins.
    is_rough: bool
    is_curved: bool  # whether some surface may stretch pixels


class Answers:
    """Fills, virtual objects and mirrored views of one renderer. kernel: kind -> trace function."""

    def __init__(self, gpu, counts: Counts, textures: TextureCache, kernel: Callable[[str], Callable], most_rays: int, most_along: int):
        self.gpu, self._textures, self._kernel, self.most_rays, self.most_along = gpu, textures, kernel, most_rays, most_along
        self._batch = triangle_batch()
        self.projector = Projector(counts, textures)
        self.levels = Levels(counts, textures, self._batch, most_rays)
        self._bodies = Bodies(textures)
        self._fills: dict[tuple[int, str | None, bool, Callable], tuple[Asset, Fill]] = {}

    def keep_only(self, assets):
        """Let go of what was made of other assets."""
        used = {id(a) for a in assets}
        self._fills = {key: value for key, value in self._fills.items() if key[0] in used}
        self._bodies.keep_only(assets)

    def update(self, snapshot: SceneSnapshot, assets: dict[str, Asset], surfaces: Asset | None, raymap: RayMapPass, materials: MaterialTable):
        """Take another snapshot, with its ray map's pass and its materials."""
        self._snapshot, self._raymap, self._materials = snapshot, raymap, materials
        self.projector.update(snapshot, assets.values(), surfaces)
        self.levels.update(snapshot, assets, surfaces, raymap, materials)
        self._groups = self._group_reflectors(assets)
        self.has_glass = self.levels.has_panes or any(is_body(group.asset) for group in self._groups)

    @property
    def draws(self) -> bool:
        """Whether anything is drawn into reflection buffers, which then need depth."""
        return self.projector.draws or self.levels.draws

    def _group_reflectors(self, assets: dict[str, Asset]) -> list[Group]:
        groups: list[Group] = []
        rough = {s.reflector for s in self._raymap.sections if s.roughness_spread > lobe_rays.FINE}
        live = {c.reflector for c in self.levels.maps.curved}
        for index, instance in enumerate(self._snapshot.reflectors()):
            asset = asset_of(assets, instance)
            if asset is None:
                continue
            is_rough = index in rough and lobe_rays.has_outlines(asset)
            is_curved = self._snapshot.meshes[instance.mesh].is_bent
            if groups and groups[-1].asset is asset and groups[-1].last == index - 1 and not live & {index, index - 1}:
                one = groups[-1]
                groups[-1] = Group(asset, one.first, index, one.is_rough or is_rough, one.is_curved or is_curved)
            else:
                groups.append(Group(asset, index, index, is_rough, is_curved))
        return groups

    def prepare(self, beside: str | None, resolve: Resolve):
        """Upload and compile everything now, seen or not. resolve: what makes light of answers."""
        for group in self._groups:
            self.fill(group.asset, beside, group.is_rough or group.is_curved)
            if self._projects(group):
                self.projector.prepare(group.asset, beside)
            if is_body(group.asset):
                self._body(group, None)
        self.levels.prepare(beside, resolve)

    def plan(self, camera: Camera, resolve, attenuates: bool):
        """What the next picture needs is decided, and cube maps that are due are drawn; see Levels.plan."""
        self.levels.plan(camera, resolve, attenuates)
        gone = {id(asset) for asset in self.levels.draw_maps(self.draw)}
        self._fills = {key: value for key, value in self._fills.items() if key[0] not in gone}
        self._bodies.drop(gone)

    def draw(self, seen: Seen, background: Asset | None = None):
        """Answers to all rays that are seen. background: an asset, for the camera's own rays."""
        target = seen.target
        target.clear(seen.window)
        for group in self._groups:
            bounds = _common(self._raymap.screen_bounds(seen.camera, range(group.first, group.last + 1)), seen.window)
            self.levels.draw(seen, range(group.first, group.last + 1), bounds, self.draw)
            if bounds is None:
                continue
            if self._projects(group):
                shown = [i for i in self._sharp(group) if self._is_large(seen.camera, i)]
                self.projector.draw(seen.camera, seen.rays, target, group.asset, shown, bounds)
            live = self.levels.maps.asset_of(group.first)
            pixels = group.is_rough and live is None or group.is_curved
            textures = (*seen.rays.textures, self._materials.texture) if pixels else seen.rays.textures[:3]
            fill = self.fill(live or group.asset, target.beside, pixels, live and live_maps.trace)
            most = self.most_rays if group.is_rough and live is None else 1, self.most_along
            fill.draw(self.gpu, self._batch, textures, target, group.first, group.last, bounds, most)
            if is_body(group.asset):
                self._body(group, live).draw(self._batch, seen, self._materials, group.first, group.last, bounds)
        if background is not None:
            fill = self.fill(background, target.beside, kernel=background_kernel(background.kind))
            fill.draw(self.gpu, self._batch, seen.rays.textures[:3], target, BACKGROUND, BACKGROUND)

    def _body(self, group: Group, live: Asset | None) -> Body:
        """What draws a solid body of glass; its live map's kernel answers rays that leave it, where it has one."""
        answers = live or group.asset
        return self._bodies.body(group.asset, answers, self._kernel(answers.kind))

    def _projects(self, group: Group) -> bool:
        """Whether virtual objects are drawn for it."""
        return self.projector.draws and self.projector.has(group.asset)

    def _sharp(self, group: Group) -> list[int]:
        """The reflectors of a group that are smooth enough for virtual objects, which know one ray a pixel."""
        sharp = {s.reflector for s in self._raymap.sections if s.roughness_spread <= SHARPEST}
        return sorted(sharp & set(range(group.first, group.last + 1)))

    def _is_large(self, camera: Camera, reflector: int) -> bool:
        """Whether a reflector may cover enough of the picture to be worth the search for virtual vertices."""
        bounds = self._raymap.screen_bounds(camera, {reflector})
        return bounds is not None and min(bounds[2:]) >= SMALLEST

    def fill(self, asset: Asset, beside: str | None, pixels: bool = False, kernel: Callable | None = None) -> Fill:
        kernel = kernel or self._kernel(asset.kind)
        key = (id(asset), beside, pixels, kernel)
        if key not in self._fills:
            self._fills[key] = (asset, Fill(asset, kernel, beside, self._textures, pixels))
        return self._fills[key][1]

    def bytes(self) -> int:
        """Memory on the GPU besides the assets' own."""
        return self.projector.bytes() + self.levels.bytes()

    def free(self):
        self._fills = {}
        self._bodies.free()
        self.projector.free()
        self.levels.free()


def _common(one, other):
    """The rectangle (x, y, width, height) that two have in common; None: nothing. other: None is everywhere."""
    if one is None or other is None:
        return one
    low = max(one[0], other[0]), max(one[1], other[1])
    high = min(one[0] + one[2], other[0] + other[2]), min(one[1] + one[3], other[1] + other[3])
    size = high[0] - low[0], high[1] - low[1]
    return (*low, *size) if min(size) > 0 else None
