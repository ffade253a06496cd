"""The cube maps of curved mirrors, drawn while the window is drawn, kept between frames [nielsen-2002 3.2, Fig 6].

Each picture asks which maps are due (core/map_updates.py): those whose expected error is largest, a few a frame, none at rest. Their faces are
drawn by levels.py, each as a picture with the planar mirrors in it; curved mirrors in any picture are answered from the map they have.
A map is as large as its mirror is seen (core/map_size.py): one that has become too small is due, one that is too large shrinks when it is due.
A mirror without a map yet is answered by its own asset, where the paper leaves it bare.
"""

import numpy as np

from ..core import map_mirrors
from ..core.asset import Asset
from ..core.camera import Camera
from ..core.curved_views import CurvedMirror
from ..core.live_maps import asset_of_map, reach_of
from ..core.map_size import CUBE_STEP, cube_sides, side_of
from ..core.map_updates import Kept, coupling_of, moved_share, none_yet, settle_frames, solid_share, update
from ..core.mirror_planes import MirrorPlane
from ..core.scene_moves import all_changed, moved_between
from ..core.snapshot import SceneSnapshot
from .counts import Counts
from .cube_targets import CubeTargets, prepare_programs
from .texture_cache import TextureCache

# Share of a map's light: what is expected to be wrong by less is not made again.
TOLERANCE = 1e-3
# A mirror that is not seen counts as one that takes this share of all directions: others may show it.
UNSEEN = 1e-3


class CubeMaps:
    """Of one renderer."""

    def __init__(self, counts: Counts, textures: TextureCache):
        self.counts, self._textures = counts, textures
        self.curved: tuple[CurvedMirror, ...] = ()
        self.side, self.per_frame = 0, 0  # texels along an edge, and maps made in a frame, at most
        self.kept, self.frame = none_yet(0), 0
        self.targets: dict[int, CubeTargets] = {}  # by texels along an edge
        self.sides: dict[str, int] = {}  # by reflector, texels along an edge of its map
        self._names: tuple[str, ...] = ()
        self._scene: SceneSnapshot | None = None
        self._surfaces: Asset | None = None
        self._images: dict[str, tuple[np.ndarray, object]] = {}  # by reflector: what stands for the texture in assets; the texture
        self._assets: dict[str, Asset] = {}  # by reflector, of maps that are there

    def update(self, scene: SceneSnapshot, surfaces: Asset | None, curved: tuple[CurvedMirror, ...], planes: tuple[MirrorPlane, ...], side: int, per_frame: int, depth: int):
        """Take another snapshot. side, per_frame: as named above; depth: reflections along a path."""
        names = tuple(scene.reflectors()[c.reflector].name for c in curved)
        if side != self.side or not curved:
            self._images, self._assets, self.targets, self.sides, self._names = {}, {}, {}, {}, ()
        before = dict(zip(self._names, zip(self.curved, self.kept.made, self.kept.stale, strict=True), strict=True))
        again = self._scene is None or surfaces is not self._surfaces or all_changed(self._scene, scene)
        moved = () if again else moved_between(self._scene, scene)
        made, stale = [], []
        for name, mirror in zip(names, curved, strict=True):
            old, frame, error = before.get(name, (mirror, None, 1.0))
            by = float(np.linalg.norm(mirror.center - old.center))
            own = scene.named()[name]
            others = tuple(m for m in moved if m.instance != own.name)
            made.append(frame)
            stale.append(1.0 if again else min(error + moved_share(mirror, others, by), 1.0))
        self.kept = Kept(tuple(made), np.array(stale))
        self._coupling = coupling_of(curved, planes)
        self._names, self.curved, self.side, self.per_frame = names, curved, side, per_frame
        self._planes, self._bounces = planes, max(min(map_mirrors.BOUNCES, depth - 1), 0)
        self._scene, self._surfaces = scene, surfaces
        for kept in (self._images, self._assets, self.sides):
            for name in kept.keys() - set(names):
                del kept[name]
        for image, texture in self._images.values():
            self._textures.replace(image, texture)

    def due(self, camera: Camera, by_area: bool = True) -> dict[int, int]:
        """The maps to make for the next picture, into `curved`, and texels along an edge of each; they count as made. by_area: they are as
        large as their mirrors are seen."""
        if not self.curved:
            return {}
        wanted = self._wanted(camera, by_area)
        eye = camera.world_from_camera[:3, 3]
        weights = np.array([UNSEEN + solid_share(c.center, eye, c.radius) for c in self.curved])
        self.frame += 1
        small = np.array([self.sides.get(name, 0) < side for name, side in zip(self._names, wanted, strict=True)], float)
        remade, self.kept = update(self.kept, small, self._coupling, weights, self.frame, self.per_frame, TOLERANCE)
        self.sides |= {self._names[index]: wanted[index] for index in remade}
        return {index: wanted[index] for index in remade}

    def _wanted(self, camera: Camera, by_area: bool) -> list[int]:
        """Texels along an edge that each map should have."""
        if not by_area:
            return [self.side] * len(self.curved)
        needed = cube_sides(np.array([c.center for c in self.curved]), np.array([c.radius for c in self.curved]), camera)
        return [side_of(n, self.side, self.sides.get(name), CUBE_STEP) for n, name in zip(needed, self._names, strict=True)]

    def expire(self):
        """All maps are to be made again, as if everything had moved."""
        self.kept = Kept(self.kept.made, np.ones(len(self.curved)))

    @property
    def settled(self) -> bool:
        """Whether the next picture would make no map."""
        return None not in self.kept.made and bool((self.kept.stale <= TOLERANCE).all())

    @property
    def frames_to_settle(self) -> int:
        """Pictures at rest after which `settled` holds, whatever moved before."""
        return settle_frames(self._coupling, self.per_frame, TOLERANCE) if self.curved else 0

    def make_room(self, sides: set[int]):
        """Targets for maps of these sizes."""
        for side in sides - self.targets.keys():
            self.targets[side] = CubeTargets(side, self.counts)

    def side_of(self, index: int) -> int:
        """Texels along an edge of the map that is being made."""
        return self.sides[self._names[index]]

    def name_of(self, index: int) -> str:
        """The instance that a map is of."""
        return self._names[index]

    def reach(self, index: int):
        return reach_of(self._scene, self.curved[index])

    def complete(self, index: int, batch) -> Asset | None:
        """The six faces are drawn. Returns the asset that no longer serves, where another takes its place."""
        name = self._names[index]
        old, side = self._assets.get(name), self.sides[name]
        if old is None or old.uniforms["cube_size"] != side:
            image = self._images[name][0] if old is not None else np.zeros((1, 1, 4), np.float16)
            self._images[name] = image, self.targets[side].new_image()
            self._textures.replace(*self._images[name])
        image, texture = self._images[name]
        self.targets[side].complete(texture, batch)
        curved = self.curved[index]
        met = map_mirrors.met_exactly(curved, self._planes)
        new = asset_of_map(self.reach(index), side, self.side, image, curved, met, self._bounces)
        if old is not None and (old.uniforms, old.options) == (new.uniforms, new.options):
            return None
        self._assets[name] = new
        return old

    def asset_of(self, reflector: int) -> Asset | None:
        """What answers a reflector's rays; None where it has no map."""
        return next((self._assets.get(name) for name, c in zip(self._names, self.curved, strict=True) if c.reflector == reflector), None)

    def prepare(self):
        """Compile now."""
        if self.curved:
            prepare_programs(self.counts)

    def targets_bytes(self) -> int:
        """Memory on the GPU of what maps are made in; the maps themselves are in the cache of textures."""
        return sum(targets.bytes for targets in self.targets.values())

    def free(self):
        self._images, self._assets, self.targets, self.sides = {}, {}, {}, {}
        self.curved, self._names, self.kept = (), (), none_yet(0)
