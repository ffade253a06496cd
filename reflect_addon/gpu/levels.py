"""Mirrors in mirrors, drawn [nielsen-2002 3.1, Fig 4]: each level is a picture made by the passes that make the window's.

The schedule (core/reflection_tree.py) says which views there are. Where a picture's ray map shows a mirror that has one, that view is drawn
into its level's targets: the surfaces with what they send out, the rays of the reflectors among them, the answers to these (answers.py,
which calls here for the next level), and what the reflectors make of the answers. Then the pixels of the mirror take the view's
radiance and places over as their own ray's answer (shown_mirrors.py), and the targets (level_targets.py) are free for the next mirror of the
level (Fig 3).
A curved mirror's one view (core/curved_views.py) is drawn like a planar one's, from the mirror's middle and without the mirror itself.
Lamps hide nothing and are no surfaces: each ray adds them (virtual_lamps.py). Where no view is drawn, the reflector's kernel answers.
"""

from collections import Counter
from dataclasses import fields

import numpy as np

from ..core.asset import Asset, asset_of
from ..core.camera import Camera
from ..core.clear_of_mirror import clear_of
from ..core.curved_views import WIDE, CurvedMirror
from ..core.glass_shapes import Pane
from ..core.methods import recursive
from ..core.mirror_series import branch, continued, rows_of
from ..core.mirrors import ROUGHEST
from ..core.reflection_passes import Passes, view_dependent, view_independent
from ..core.reflection_tree import Culling, Node, Tree, TreeSettings
from ..core.snapshot import SceneSnapshot
from .counts import Counts
from .cube_maps import CubeMaps
from .device import ensure
from .found_mirrors import FoundMirrors
from .level_programs import add_light
from .level_surfaces import LevelSurfaces
from .level_targets import Level, LevelTargets, Seen
from .mirror_series import MirrorSeries
from .resolve import Resolve
from .resolve_tables import MaterialTable
from .shown_mirrors import ShownMirrors, near_plane
from .texture_cache import TextureCache
from .view import View
from .viewport_views import ViewportViews


class Levels:
    """The mirrored views of a renderer."""

    def __init__(self, counts: Counts, textures: TextureCache, batch, most_rays: int):
        self.counts, self._batch, self.view = counts, batch, View()
        self.shown = ShownMirrors(counts, textures, batch, most_rays)
        self._series = MirrorSeries(counts, textures, batch)
        self._surfaces = LevelSurfaces(counts, textures, batch)
        self.targets = LevelTargets(counts)
        self._planes: tuple = ()
        self._viewed: tuple[CurvedMirror, ...] = ()  # the curved mirrors that have one view for each picture that shows them
        self._found = FoundMirrors()
        self._settings: TreeSettings | None = None
        self._mirrors: MaterialTable | None = None
        self.maps = CubeMaps(counts, textures)
        self.continues = True  # mirrors beyond the last level through the branch's pictures; False: distance maps, to measure against
        self.viewport: ViewportViews | None = None  # of the 3D view that is drawn, where its shading is what mirrors show
        self.tree: Tree | None = None  # of the picture that is being drawn, or was last
        self.passes: Passes | None = None  # of the last frame
        self.triangles: Counter[int] = Counter()  # drawn of surfaces in the last frame, by depth

    def update(self, snapshot: SceneSnapshot, assets: dict[str, Asset], surfaces: Asset | None, raymap, materials: MaterialTable):
        """Take another snapshot. Planes are looked for, and surfaces uploaded, where an asset asks for it."""
        self._raymap, self._scene = raymap, snapshot
        own = [asset_of(assets, r) for r in snapshot.reflectors()]
        chosen = {i: asset for i, asset in enumerate(own) if asset is not None and asset.kind == recursive.NAME and surfaces is not None}
        self._planes, self._viewed, self._settings, self._assets = (), (), None, chosen
        self._series.keep_only(chosen.values())
        self.shown.update(snapshot, chosen, materials)
        sky = next((recursive.sky_of(asset) for asset in chosen.values()), None)
        deep = any(int(asset.settings["depth"]) > 1 for asset in chosen.values())
        self._surfaces.update(snapshot, surfaces if chosen else None, sky, deep)
        if not chosen:
            self.tree = None
            self.targets.free()
            self.maps.free()
            return
        asked = [{**recursive.DEFAULTS, **asset.settings} for asset in chosen.values()]
        culls = [recursive.culling_of(s) for s in asked]
        self._settings = TreeSettings(
            depth=max(int(s["depth"]) for s in asked), least_energy=min(float(s["least_energy"]) for s in asked),
            side=int(WIDE * max(int(s["map_side"]) for s in asked)),
            culling=Culling(*(all(getattr(c, f.name) for c in culls) for f in fields(Culling))),
        )  # fmt: skip
        self._endless = any(bool(s["endless"]) for s in asked)
        planes, curved = self._found.of(snapshot)
        self._planes = tuple(plane for plane in planes if plane.reflector in chosen)
        self._viewed, live = recursive.answered_by(curved, dict(zip(chosen, asked, strict=True)))
        side, most = (max(int(s[name]) for s in asked) for name in ("map_side", "maps_per_frame"))
        mirroring = tuple(plane for plane in self._planes if not isinstance(plane, Pane))
        self.maps.update(snapshot, surfaces, live, mirroring, side, most, self._settings.depth)
        # Of what is no mirror to mirrors surface radiance holds all that it shows.
        rows = MaterialTable.rows_of(snapshot)
        for row, material in zip(rows, snapshot.materials, strict=False):
            row[2, 0] *= material.is_reflector and material.roughness <= ROUGHEST
        if self._mirrors is None or not np.array_equal(self._mirrors.rows, rows):
            self._mirrors = MaterialTable(rows, self.counts)

    @property
    def draws(self) -> bool:
        """Whether there are mirrors to be drawn."""
        return bool(self._planes or self.maps.curved or self._viewed)

    @property
    def has_panes(self) -> bool:
        return any(isinstance(plane, Pane) for plane in self._planes)

    def prepare(self, beside: str | None, resolve: Resolve):
        """Compile now. resolve: as for plan."""
        if self.draws:
            self._surfaces.prepare()
            self._surfaces.lamps.prepare(beside)
            self.shown.prepare((*self._planes, *self._viewed), beside)
            if self._endless:
                self._series.prepare(self._planes, self._assets, resolve, beside, self._surfaces.lamps)
        self.maps.prepare()

    def plan(self, camera: Camera, resolve: Resolve, attenuates: bool):
        """The views of the next picture, and of the cube maps before it. resolve: what makes light of answers (resolve.py), which reads
        distances where it `attenuates`."""
        self._resolve, self._beside = resolve, "distance" if attenuates else None
        before, self.tree, self.passes = self.tree, None, None
        self.triangles.clear()
        if self.draws:
            if self._viewed:
                self.passes = view_dependent(camera, self._planes, self._viewed, self._settings, before)
            else:
                remade = self.maps.due(camera, self._settings.culling.size)
                self.passes = view_independent(camera, self._planes, self.maps.curved, self._settings, remade, border=1)
                self.maps.make_room({*remade.values()})
            self.tree = self.passes.main
            nodes = tuple(node for tree in self.passes.trees for node in tree.nodes)
            self.targets.make_room((camera.width, camera.height), nodes, self._beside, self._settings.culling.size)
            if self.viewport is not None:
                self.viewport.want(self.tree)
            self.counts.faces += len(self.passes.faces)
            for tree in self.passes.trees:
                self.counts.views += len(tree.nodes)
                self.counts.views_culled += sum(tree.culled.values())
            self.counts.energy_left_out += sum(self.tree.left_out.values())

    def draw_maps(self, answer) -> list[Asset]:
        """The cube maps that are due, before the picture. answer: Answers.draw. Returns assets that no longer serve."""
        gone = []
        for face in self.passes.faces if self.passes else ():
            self.tree, camera, target = face.tree, face.tree.root, self.maps.targets[self.maps.side_of(face.curved)]
            target.answers.clear()
            self._draw_picture(target, camera, (0, 0, *target.size), 1, Seen(camera, target.rays, target.answers, (0, 0, *target.size)), answer,
                               self.maps.name_of(face.curved))
            self.view.set(camera)
            target.take(face.face, self.view, self.maps.reach(face.curved), self._surfaces.lamps, self._per_metre(), self._batch)
            if face.face == 5:
                gone.append(self.maps.complete(face.curved, self._batch))
        self.tree = self.passes.main if self.passes else None
        return [asset for asset in gone if asset is not None]

    def draw(self, seen: Seen, reflectors: range, bounds, answer):
        """What mirrors with a view among these reflectors show, into seen.target, within bounds; None: they are not seen, and drawn only
        where that is not culled. answer: Answers.draw."""
        if self.tree is None or bounds is None and self._settings.culling.frustum:
            return
        drawn = set()
        for index in self.tree.children.get(seen.node, ()):
            node = self.tree.nodes[index]
            mirror = self.tree.mirrors[node.mirror]
            if mirror.reflector in reflectors:
                self._draw_view(index, node, answer)
                self.shown.draw(mirror, self._camera_of(node), self.targets[node.depth].picture, node, seen, self._per_metre())
                if not isinstance(mirror, Pane):
                    drawn.add(mirror.reflector)
        if bounds is None:
            return
        if self._endless and self.continues:
            drawn |= self._continue(seen, reflectors)
        partly = {mirror.reflector for mirror in self._viewed}  # what no view shows of them is answered with its lamps
        for reflector in sorted(drawn):
            self._surfaces.lamps.draw(seen.rays, seen.target, reflector, self._per_metre(), bounds, reflector not in partly)

    def _continue(self, seen: Seen, reflectors: range) -> set[int]:
        """The mirrors among them without a view, by the pictures of the branch. Returns their reflectors."""
        found = branch(self.tree, seen.node, self.tree.mirrors)
        ended = [one for one in continued(self.tree, seen.node, found) if self._planes[one.mirror].reflector in reflectors]
        if ended:
            pictures = [self._picture_of(self.tree.nodes[index]) for index in found.values()]
            reach = 4.0 * (self._scene.diagonal() + float(np.linalg.norm(seen.camera.world_from_camera[:3, 3])))
            for one in ended:
                plane, own = self._planes[one.mirror], list(found).index(one.mirror)
                self._series.draw(one.window, plane, pictures, own, seen, self._assets[plane.reflector], self._resolve, self._mirrors,
                                  self._surfaces.lamps, self._per_metre(), reach)  # fmt: skip
        return {self._planes[one.mirror].reflector for one in ended}

    def _picture_of(self, node: Node) -> tuple[Level, np.ndarray]:
        """A view that is being drawn, as a series reads it."""
        camera, plane = self._camera_of(node), self._planes[node.mirror]
        return self.targets[node.depth], rows_of(camera, plane, (0, 0, *node.drawn[2:]), near_plane(plane, camera))

    def _draw_view(self, index: int, node: Node, answer):
        """The picture of one view, into its level's targets."""
        self.counts.views_drawn += 1
        level, corner, window = self.targets[node.depth], node.drawn[:2], (0, 0, *node.drawn[2:])
        camera = self._camera_of(node)
        mirror, seen, near = self.tree.mirrors[node.mirror], Seen(camera, level.rays, level.answers, window, index, corner), 0.0
        is_curved = isinstance(mirror, CurvedMirror)
        if node.depth > 1 and self._settings.culling.coarse_meshes and not is_curved:
            near = abs(float((camera.world_from_camera[:3, 3] - mirror.origin) @ mirror.normal))
        hidden = self._scene.reflectors()[mirror.reflector].name if is_curved else ""
        self._draw_picture(level, camera, window, node.depth, seen, answer, hidden, near)

    def _draw_picture(self, level, camera: Camera, window, depth: int, seen: Seen, answer, hidden: str = "", near: float = 0.0):
        """What a camera sees, into a level's targets or a cube face's. hidden: an instance that it does not see; near: as LevelSurfaces.draw takes it."""
        self.view.set(camera)
        level.picture.clear(window)
        cull = self._settings.culling.frustum
        self.triangles[depth] += self._surfaces.draw(self.view, camera, level.picture, window, hidden, near, cull)
        reflects = self._raymap.any_seen(camera, window) or not cull and bool(self.tree.children.get(seen.node))
        live = self.viewport is not None and self.tree is self.passes.main and self.viewport.has(self.tree.nodes[seen.node].path)
        answers = reflects and (depth < self._settings.depth or self._endless)
        if answers or reflects and live:
            within = camera if cull else None
            self._raymap.draw(self.view, level.rays, ensure(), window=window, in_mirrors=True, hidden=hidden, within=within)
        if live:
            self.viewport.put(self.tree.nodes[seen.node].path, level.picture, window, level.rays if reflects else None)
        if answers:
            answer(seen)
            add_light(level, window, self._resolve, self._mirrors, self._batch, self.counts)

    def _camera_of(self, node: Node) -> Camera:
        """Of the part of a view that is drawn, as large as its target."""
        mirror, camera = self.tree.mirrors[node.mirror], node.camera
        if not isinstance(mirror, CurvedMirror):
            camera = clear_of(camera, mirror.beyond if isinstance(mirror, Pane) else mirror)
        return camera.part(*node.drawn[:2], *self.targets[node.depth].size)

    def _per_metre(self) -> float:
        """The unit of depth in reflection buffers: the scene's size."""
        return 1.0 / max(self._scene.diagonal(), 1e-30)

    def bytes(self) -> int:
        """Memory on the GPU: surfaces, levels, and what cube maps are made in."""
        return self._surfaces.bytes() + self.maps.targets_bytes() + self.targets.bytes()

    def free(self):
        self._planes, self._mirrors, self.tree, self.passes = (), None, None, None
        self.targets.free()
        self.shown.free()
        self._series.free()
        self.maps.free()
        self._surfaces.free()
