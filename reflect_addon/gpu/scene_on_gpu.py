"""What the GPU holds of a snapshot and its assets: meshes, textures, tables, programs, and stand-ins that follow what moves.

What is visible is uploaded and compiled when it is first seen; `prepare` does it for everything. Only what changed is uploaded again.
"""

import numpy as np

from ..core.asset import Asset
from ..core.look import Look
from ..core.snapshot import SceneSnapshot
from .answers import Answers
from .counts import Counts
from .follow import Followed, Followers
from .raymap import RayMapPass
from .resolve import Resolve, ResolvePlan
from .resolve_tables import LookTexture, MaterialTable
from .texture_cache import TextureCache
from .upload import MeshBuffer


class SceneOnGpu:
    """Of one renderer. assets: by reflector (core.asset.asset_of), already joined with what they require; surfaces: the scene's surface
    radiance (core/surface_asset.py), from which stand-ins follow what moves. answers: what fills the reflection buffer, let know of each
    change. attenuation: half distance in metres, None = off. Holds nothing before the first `update`."""

    snapshot: SceneSnapshot
    raymap: RayMapPass
    resolve: Resolve
    materials: MaterialTable | None = None

    def __init__(
        self, assets: dict[str, Asset], surfaces: Asset | None, look: Look, attenuation: float | None, textures: TextureCache,
        answers: Answers, resolve: type[Resolve], counts: Counts,
    ):  # fmt: skip
        self.assets, self.surfaces, self.attenuation = dict(assets), surfaces, attenuation
        self.look = LookTexture(look, counts)
        self.followed = Followed()  # what the last update made again
        self._meshes: dict[str, MeshBuffer] = {}  # by content
        self._textures, self._answers, self._counts = textures, answers, counts
        self._followers = Followers(counts, textures)
        self._resolve_type = resolve

    def update(self, snapshot: SceneSnapshot, assets: dict[str, Asset] | None = None, surfaces: Asset | None = None) -> dict[str, int | bool]:
        """Take another snapshot (and assets, with the surfaces that go with them); upload only what changed, and let stand-ins
        follow. Returns {'meshes': uploaded, 'dropped': meshes let go, 'materials': bool, 'assets': bool}."""
        changed = {"meshes": 0, "dropped": 0, "materials": False, "assets": False}
        if assets is not None and (assets.keys() != self.assets.keys() or any(assets[k] is not self.assets[k] for k in assets)):
            self.assets = dict(assets)
            changed["assets"] = True
            self._answers.keep_only(assets.values())
            self._textures.keep_only(assets.values())
        if assets is not None:
            self.surfaces = surfaces
        self.snapshot = snapshot
        changed["meshes"], changed["dropped"] = self._upload_meshes(snapshot)
        materials = MaterialTable.rows_of(snapshot)
        if self.materials is None or not np.array_equal(self.materials.rows, materials):
            self.materials = MaterialTable(materials, self._counts)
            changed["materials"] = True
        self.followed = self._followers.update(snapshot, self.assets.values(), self.surfaces)
        self._answers.update(snapshot, self.assets, self.surfaces, self.raymap, self.materials)
        self._plan_resolve()
        return changed

    def _upload_meshes(self, snapshot: SceneSnapshot) -> tuple[int, int]:
        """(how many were uploaded, how many let go)."""
        in_use: dict[str, MeshBuffer] = {}
        by_index: dict[int, MeshBuffer] = {}
        uploaded = 0
        for index in {i.mesh for i in snapshot.instances}:
            key = snapshot.meshes[index].key
            buffer = in_use.get(key) or self._meshes.get(key)
            if buffer is None:
                buffer = MeshBuffer(snapshot.meshes[index], self._counts)
                uploaded += 1
            in_use[key] = by_index[index] = buffer
        dropped = len(self._meshes.keys() - in_use.keys())
        self._meshes = in_use
        self.raymap = RayMapPass(snapshot, by_index, self._counts)
        return uploaded, dropped

    def set_look(self, look: Look):
        """Another view transform or exposure; only a new table is an upload."""
        self.look.set(look)
        self._plan_resolve()

    def _plan_resolve(self):
        used = {s.material for s in self.raymap.sections}
        plan = ResolvePlan.of(self.snapshot, used, self.attenuation, self.look.look, self._answers.has_glass)
        self.resolve = self._resolve_type(plan, self.attenuation, self._counts)

    def asset_shown(self, asset: Asset) -> Asset:
        """One of the assets as it stands on the GPU, read back: it may have followed what moved."""
        return self._followers.asset(asset)

    def asset_placed(self, asset: Asset) -> Asset:
        """The same, but for its images: where its stand-ins are."""
        return self._followers.placed(asset)

    def prepare(self, beside: str | None, overlay: bool):
        """Upload and compile everything now, seen or not, so that moving the camera never does, nor the first thing that moves."""
        self._answers.prepare(beside, self.resolve)
        if self._answers.levels.draws:
            self.resolve.level_program()
        self._followers.prepare(self.surfaces)
        if overlay and self.raymap.sections:
            self.resolve.overlay_program()

    def bytes(self) -> int:
        return sum(m.bytes for m in self._meshes.values()) + self._textures.bytes() + self._followers.bytes() + self._answers.bytes()

    def free(self):
        """Let go of every texture and buffer; shaders stay in the session's cache."""
        self._meshes = {}
        self.raymap = self.materials = self.look = self.resolve = None
        self._followers.free()
        self._answers.free()
        self._textures.keep_only(())
