"""Mirrors in mirrors, drawn [nielsen-2002 3.1, Fig 4]: each level is a picture made by the passes that make the window's.

The schedule (core/reflection_tree.py) says which views there are. Where a picture's ray map shows a planar mirror, the view of that mirror is drawn
into its level's targets: the surfaces with what they send out, the rays of the reflectors among them, the answers to these (answers.py,
which calls here for the next level), and what the reflectors make of the answers. Then the pixels of the mirror take the view's
radiance and places over as their own ray's answer, and the targets are free for the next mirror of the level (Fig 3).
Targets are as large as what is seen of their level's mirrors, in steps: deep in a row of mirrors they are small.
Lamps hide nothing and are no surfaces: each ray adds them (virtual_lamps.py). Where no view is drawn, the reflector's kernel answers.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..core.asset import Asset, asset_of
from ..core.camera import Camera
from ..core.clear_of_mirror import clear_of
from ..core.glass_shapes import Pane
from ..core.methods import recursive
from ..core.mirrors import ROUGHEST
from ..core.reflection_passes import Passes, view_independent
from ..core.reflection_tree import ROOT, Culling, Node, Tree, TreeSettings
from ..core.snapshot import SceneSnapshot
from .counts import Counts
from .cube_maps import CubeMaps
from .device import ensure
from .fill import TextureCache
from .glass import SEEN, shown_through
from .glossy_mirrors import GlossyMirror
from .level_programs import shown_in
from .level_surfaces import LevelSurfaces
from .program import Program, program
from .resolve import MaterialTable
from .targets import LevelTarget, RayMapTarget, ReflectionTarget
from .view import View

# Of the outline of a mirror's plane, and float32 steps of places: how far from the plane a point of the mirror may be.
IN_PLANE, STEPS = 2e-3, 2.0**-20
# Sizes that a target's side may have.
SIDES = 8


@dataclass(frozen=True)
class Seen:
    """What a camera sees of the reflectors, and where its answers go."""

    camera: Camera
    rays: RayMapTarget
    target: ReflectionTarget
    window: tuple[int, int, int, int] | None = None  # (x, y, width, height) px: nothing outside it is touched; None: all
    node: int = ROOT  # of the schedule; ROOT: the picture itself
    corner: tuple[int, int] = (0, 0)  # px of the schedule's picture where this one's pixel (0, 0) is


class Level:
    """The targets of one depth of recursion. beside: what stands in its reflection buffer beside radiance."""

    def __init__(self, size: tuple[int, int], beside: str | None, counts: Counts):
        self.size, self.beside, (width, height) = size, beside, size
        self.picture = LevelTarget(width, height, counts)
        self.rays = RayMapTarget(width, height, counts)
        self.answers = ReflectionTarget(width, height, beside, counts, depth=True)

    @property
    def bytes(self) -> int:
        return self.picture.bytes + self.rays.bytes + self.answers.bytes


class Levels:
    """The mirrored views of a renderer."""

    def __init__(self, counts: Counts, textures: TextureCache, batch, most_rays: int):
        self.counts, self._batch, self._view, self._textures, self._most_rays = counts, batch, View(), textures, most_rays
        self._glossy: dict[tuple[int, str | None], GlossyMirror] = {}  # by asset and what stands beside radiance
        self._surfaces = LevelSurfaces(counts, textures, batch)
        self._levels: dict[int, Level] = {}  # by depth
        self._whole = (0, 0)  # px of the picture that the levels were made for
        self._planes: tuple = ()
        self._looked_for: tuple | None = None  # what mirrors were looked for in, and those found
        self._settings: TreeSettings | None = None
        self._mirrors: MaterialTable | None = None
        self.maps = CubeMaps(counts, textures)
        self.culling = Culling()
        self.tree: Tree | None = None  # of the picture that is being drawn, or was last
        self.passes: Passes | None = None  # of the last frame

    def update(self, snapshot: SceneSnapshot, assets: dict[str, Asset], surfaces: Asset | None, raymap, materials: MaterialTable):
        """Take another snapshot. Planes are looked for, and surfaces uploaded, where an asset asks for it."""
        self._raymap, self._scene, self._materials = raymap, snapshot, materials
        own = [asset_of(assets, r) for r in snapshot.reflectors()]
        chosen = {i: asset for i, asset in enumerate(own) if asset is not None and asset.kind == recursive.NAME and surfaces is not None}
        self._planes, self._settings, self._assets = (), None, chosen
        self._glossy = {key: made for key, made in self._glossy.items() if any(made.asset is asset for asset in chosen.values())}
        sky = next((recursive.sky_of(asset) for asset in chosen.values()), None)
        self._surfaces.update(snapshot, surfaces if chosen else None, sky)
        if not chosen:
            self._levels, self.tree = {}, None
            self.maps.free()
            return
        asked = [asset.settings for asset in chosen.values()]
        self._settings = TreeSettings(
            depth=max(int(s["depth"]) for s in asked), least_energy=min(float(s["least_energy"]) for s in asked)
        )
        self._endless = any(bool(s["endless"]) for s in asked)
        planes, curved = self._mirrors_of(snapshot)
        self._planes = tuple(plane for plane in planes if plane.reflector in chosen)
        live = tuple(c for c in curved if c.reflector in chosen and chosen[c.reflector].settings["curved"])
        side, most = (max(int(s[name]) for s in asked) for name in ("map_side", "maps_per_frame"))
        mirroring = tuple(plane for plane in self._planes if not isinstance(plane, Pane))
        self.maps.update(snapshot, surfaces, live, mirroring, side, most)
        # Of what is no mirror to mirrors surface radiance holds all that it shows.
        rows = MaterialTable.rows_of(snapshot)
        for row, material in zip(rows, snapshot.materials, strict=False):
            row[2, 0] *= material.is_reflector and material.roughness <= ROUGHEST
        if self._mirrors is None or not np.array_equal(self._mirrors.rows, rows):
            self._mirrors = MaterialTable(rows, self.counts)

    def _mirrors_of(self, scene: SceneSnapshot):
        """Looked for again when a reflector moved or changed: half a second in a kitchen. (Whether somebody looks at a closed mesh from
        inside is then as it was.)"""
        key = scene.materials, tuple(
            (scene.meshes[r.mesh].key, np.asarray(r.world_from_object).tobytes(), r.materials, r.mark) for r in scene.reflectors()
        )
        if self._looked_for is None or self._looked_for[0] != key:
            self._looked_for = key, recursive.drawn_mirrors(scene)
        return self._looked_for[1]

    @property
    def draws(self) -> bool:
        """Whether there are mirrors to be drawn."""
        return bool(self._planes or self.maps.curved)

    @property
    def has_panes(self) -> bool:
        return any(isinstance(plane, Pane) for plane in self._planes)

    def prepare(self, beside: str | None):
        """Compile now."""
        if self.draws:
            self._surfaces.prepare()
            program(shown_in(beside), self.counts)
            self._surfaces.lamps.prepare(beside)
            if self.has_panes:
                program(shown_through(), self.counts)
            for plane in self._planes:
                if plane.roughness[1] > 0:
                    self._glossy_mirror(plane.reflector, beside).prepare()
        self.maps.prepare()

    def plan(self, camera: Camera, resolve, attenuates: bool):
        """The views of the next picture, and of the cube maps before it. resolve: what makes light of answers (resolve.py), which reads
        distances where it `attenuates`."""
        self._resolve, self._beside = resolve, "distance" if attenuates else None
        self.tree = self.passes = None
        if self.draws:
            settings = replace(self._settings, culling=self.culling)
            self.passes = view_independent(
                camera, self._planes, self.maps.curved, settings, self.maps.due(camera), self.maps.side, border=1
            )
            self.tree = self.passes.main
            self._make_room(camera)
            self.counts.faces += len(self.passes.faces)
            for tree in self.passes.trees:
                self.counts.views += len(tree.nodes)
                self.counts.views_culled += sum(tree.culled.values())
            self.counts.energy_left_out += sum(self.tree.left_out.values())

    def draw_maps(self, answer) -> list[Asset]:
        """The cube maps that are due, before the picture. answer: Answers.draw. Returns assets that no longer serve."""
        gone = []
        for face in self.passes.faces if self.passes else ():
            self.tree, camera, target = face.tree, face.tree.root, self.maps.targets
            target.answers.clear()
            self._draw_picture(target, camera, (0, 0, *target.size), 1, Seen(camera, target.rays, target.answers, (0, 0, *target.size)), answer,
                               self.maps.name_of(face.curved))
            self._view.set(camera)
            target.take(face.face, self._view, self.maps.reach(face.curved), self._surfaces.lamps, self._per_metre(), self._batch)
            if face.face == 5:
                gone.append(self.maps.complete(face.curved, self._batch))
        self.tree = self.passes.main if self.passes else None
        return [asset for asset in gone if asset is not None]

    def draw(self, seen: Seen, reflectors: range, bounds, answer):
        """What planar mirrors among these reflectors show, into seen.target, within bounds. answer: Answers.draw."""
        if self.tree is None:
            return
        drawn = set()
        for index in self.tree.children.get(seen.node, ()):
            node = self.tree.nodes[index]
            plane = self._planes[node.mirror]
            if plane.reflector in reflectors:
                self._draw_view(index, node, answer)
                self._take_over(node, seen)
                if not isinstance(plane, Pane):
                    drawn.add(plane.reflector)
        for reflector in sorted(drawn):
            self._surfaces.lamps.draw(seen.rays, seen.target, reflector, self._per_metre(), bounds)

    def _draw_view(self, index: int, node: Node, answer):
        """The picture of one view, into its level's targets."""
        level, corner, window = self._levels[node.depth], node.drawn[:2], (0, 0, *node.drawn[2:])
        camera = self._camera_of(node)
        self._draw_picture(level, camera, window, node.depth, Seen(camera, level.rays, level.answers, window, index, corner), answer)

    def _draw_picture(self, level, camera: Camera, window, depth: int, seen: Seen, answer, hidden: str = ""):
        """What a camera sees, into a level's targets or a cube face's. hidden: an instance that it does not see."""
        self._view.set(camera)
        level.picture.clear(window)
        self._surfaces.draw(self._view, camera, level.picture, window, hidden)
        last = depth >= self._settings.depth and not self._endless
        if last or not self._raymap.any_seen(camera, window):
            return
        self._raymap.draw(self._view, level.rays, ensure(), window=window, in_mirrors=True, hidden=hidden)
        answer(seen)
        self._light(level, window)

    def _light(self, level: Level, window):
        """Adds what the reflectors of a view make of their answers."""
        gpu, target = ensure(), level.picture.lit
        with target.bind():
            target.viewport_set(0, 0, level.rays.width, level.rays.height)
            gpu.state.blend_set("ALPHA_PREMULT")
            gpu.state.depth_test_set("NONE")
            gpu.state.scissor_set(*window)
            gpu.state.scissor_test_set(True)
            shader = self._resolve.level_program()
            shader.bind()
            self._resolve.bind_level(shader, level.rays, level.answers, self._mirrors)
            shader.draw(self._batch)
            gpu.state.scissor_test_set(False)
            gpu.state.blend_set("NONE")
        self.counts.passes += 1

    def _take_over(self, node: Node, seen: Seen):
        """The view's radiance and places, as answers to the rays of the mirror's pixels in the picture that shows it."""
        gpu, target, plane = ensure(), seen.target, self._planes[node.mirror]
        picture, (x, y, width, height) = self._levels[node.depth].picture, node.window
        is_pane = isinstance(plane, Pane)
        framebuffer = target.through.framebuffer if is_pane else target.framebuffer
        with framebuffer.bind():
            framebuffer.viewport_set(0, 0, target.width, target.height)
            gpu.state.blend_set("NONE")
            gpu.state.depth_test_set("NONE" if is_pane else "LESS")
            gpu.state.depth_mask_set(not is_pane)
            gpu.state.scissor_set(x - seen.corner[0], y - seen.corner[1], width, height)
            gpu.state.scissor_test_set(True)
            if is_pane:
                shader = self._through(seen, picture)
            else:
                shader = self._rough(node, seen, picture) if plane.roughness[1] > 0 else self._sharp(seen, picture)
            size = float(np.linalg.norm(np.ptp(plane.outline, axis=0)))
            reach = float(np.abs(plane.outline).max() + np.abs(seen.camera.world_from_camera[:3, 3]).max())
            shader.set("plane_origin", (*plane.origin, IN_PLANE * size + STEPS * reach))
            shader.set("plane_normal", (*plane.normal, plane.reflector))
            shader.set("sizes_per_metre", self._per_metre())
            shader.set("offset", (seen.corner[0] - node.drawn[0], seen.corner[1] - node.drawn[1]))
            shader.draw(self._batch)
            gpu.state.scissor_test_set(False)
            gpu.state.depth_mask_set(False)
            gpu.state.depth_test_set("NONE")
        self.counts.passes += 1

    def _sharp(self, seen: Seen, picture: LevelTarget) -> Program:
        """Pixel for pixel."""
        shader = program(shown_in(seen.target.beside), self.counts)
        shader.bind()
        for name, texture in zip(("origin_tx", "direction_tx", "normal_tx"), seen.rays.textures, strict=False):
            shader.image(name, texture)
        shader.image("picture_tx", picture.color_tx)
        shader.image("place_tx", picture.place_tx)
        return shader

    def _through(self, seen: Seen, picture: LevelTarget) -> Program:
        """A pane's pixels show those of the view through it."""
        shader = program(shown_through(), self.counts)
        shader.bind()
        for name, texture in zip(SEEN, (*seen.rays.textures, self._materials.texture), strict=True):
            shader.image(name, texture)
        shader.image("picture_tx", picture.color_tx)
        return shader

    def _rough(self, node: Node, seen: Seen, picture: LevelTarget) -> Program:
        """Ray by ray of each pixel's lobe."""
        self._view.set(self._camera_of(node))
        made = self._glossy_mirror(self._planes[node.mirror].reflector, seen.target.beside)
        far = 4.0 * (self._scene.diagonal() + np.linalg.norm(node.camera.world_from_camera[:3, 3]))
        window = (0, 0, *node.drawn[2:])
        return made.bind(self._view, seen.rays, picture, self._materials, window, self._most_rays, self._view.footprint, far)

    def _glossy_mirror(self, reflector: int, beside: str | None) -> GlossyMirror:
        asset = self._assets[reflector]
        if (id(asset), beside) not in self._glossy:
            self._glossy[id(asset), beside] = GlossyMirror(asset, beside, self._textures)
        return self._glossy[id(asset), beside]

    def _camera_of(self, node: Node) -> Camera:
        """Of the part of a view that is drawn, as large as its target."""
        plane = self._planes[node.mirror]
        return clear_of(node.camera, plane.beyond if isinstance(plane, Pane) else plane).part(*node.drawn[:2], *self._levels[node.depth].size)

    def _per_metre(self) -> float:
        """The unit of depth in reflection buffers: the scene's size."""
        return 1.0 / max(self._scene.diagonal(), 1e-30)

    def _make_room(self, camera: Camera):
        """Targets that hold every view of the tree; sides grow in steps of an eighth of the picture's and never shrink, so that a camera's
        move seldom makes new ones."""
        self.maps.make_room()
        least = self.maps.targets.size if self.maps.targets else (1, 1)
        whole = max(camera.width, least[0]), max(camera.height, least[1])
        if whole != self._whole:
            self._levels, self._whole = {}, whole
        nodes = [node for tree in self.passes.trees for node in tree.nodes]
        for depth in {node.depth for node in nodes}:
            level = self._levels.get(depth)
            held = level.size if level else (0, 0)
            drawn = np.max([node.drawn[2:] for node in nodes if node.depth == depth], axis=0)
            steps = np.maximum(np.ceil(np.array(whole) / SIDES), 1)
            size = tuple(int(max(h, min(np.ceil(d / s) * s, max(w, d)))) for h, d, s, w in zip(held, drawn, steps, whole, strict=True))
            if level is None or size != held or level.beside != self._beside:
                self._levels[depth] = Level(size, self._beside, self.counts)

    def level_bytes(self) -> int:
        """Memory on the GPU of the targets, one set a level."""
        return sum(level.bytes for level in self._levels.values())

    def bytes(self) -> int:
        """Memory on the GPU: surfaces, levels, and what cube maps are made in."""
        return self._surfaces.bytes() + self.maps.targets_bytes() + self.level_bytes()

    def free(self):
        self._levels, self._glossy, self._planes, self._mirrors, self.tree, self.passes = {}, {}, (), None, None, None
        self.maps.free()
        self._surfaces.free()
