"""Grows the tree of mirrored views: who is looked at through whom, until it no longer shows.

Problem. The recursion of nielsen-2002 (Figs 4 and 5) makes n (n - 1)^(d - 1) views for n mirrors and depth d; an eye sees few of them.
Idea. Views are accepted in order of what they can add to the picture. A mirror is looked through only where it is seen: its outline is clipped by its
parent's near plane and by the polygon in which its parent is seen (mirror_outline.py), as through portals [Luebke and Georges 1995]. So every
view that is left shows something unless other things hide it, and two facing mirrors have as many views as reflections that are seen.
A branch ends where the mirror is seen from behind, is not seen, is smaller than a few pixels, or where its weight (the product of reflectances
along it) times its share of the picture is below a threshold [3.1]; and at `depth` and `most` views, for good. What is left out is
counted by reason, and its energy summed: what the picture's mean may lose where everything reflected has radiance 1.
Where we depart: the paper's program culled nothing but back faces. The mirror that a view was made by is not entered again: in Figs 4 to 6
it is, but the eye is behind it, and back-face culling drops it there too.
Limits. Things that hide mirrors are not known. Reflectance rises to `grazing` by Schlick's curve at the most grazing corner: a bound, but
for the dip of some metals' edges. Through a curved mirror's one view, shares are those of that view's pixels.
"""

import heapq
from dataclasses import replace
from itertools import count

import numpy as np

from .camera import Camera
from .curved_views import CurvedMirror, approximate_view, outline_of
from .glass_shapes import Pane
from .glossy_window import fineness, widened
from .map_size import side_of
from .mirror_outline import Polygon, area, seen_through, window_of
from .mirror_planes import MirrorPlane
from .mirrored_view import IN_PLANE, height_of, image_of, mirrored
from .mirrors import ROUGHEST
from .pane_view import through
from .reflection_tree import BEHIND, COVERED, DEPTH, FAINT, MOST, OUTSIDE, REASONS, ROOT, SMALL, Ended, Node, Tree, TreeSettings


def grow(
    root: Camera,
    mirrors: tuple[MirrorPlane | CurvedMirror, ...],
    settings: TreeSettings,
    *,
    before: Tree | None = None,
    depth: int = 0,
    weight: float = 1.0,
) -> Tree:
    """The tree of views from a camera. before: the last frame's, whose maps keep their sizes while they serve; depth: of the root, 1 for
    the face of a cube map; weight: what its picture counts."""
    sides = {node.path: node.camera.width for node in before.nodes} if before else {}
    return _Growth(root, tuple(mirrors), settings, sides, depth, weight).tree()


class _Growth:
    """Views are accepted in order of energy, best first; `open` holds those seen and not accepted yet."""

    def __init__(self, root: Camera, mirrors, settings: TreeSettings, sides: dict, depth: int, weight: float):
        self.root, self.mirrors, self.settings, self.cull = root, mirrors, settings, settings.culling
        self.planes = [(i, m) for i, m in enumerate(mirrors) if isinstance(m, MirrorPlane)]
        self.curved = [(i, m) for i, m in enumerate(mirrors) if not isinstance(m, MirrorPlane)]
        if self.planes:
            self.origin, self.normal = (np.array([getattr(p, name) for _, p in self.planes]) for name in ("origin", "normal"))
            corners = np.concatenate([p.outline for _, p in self.planes])
            self.corners = np.column_stack([corners, np.ones(len(corners))])
            self.indices = np.array([i for i, _ in self.planes])
            self.dull = np.array([p.roughness[1] > ROUGHEST for _, p in self.planes])
            self.first = np.cumsum([0, *(len(p.outline) for _, p in self.planes)])
        self.nodes: list[Node] = []
        self.open: list = []
        self.number = count()
        self.culled, self.ended = dict.fromkeys(REASONS, 0), []
        self.start = (depth, weight)
        self.sides = sides

    def tree(self) -> Tree:
        depth, weight = self.start
        self.expand(ROOT, self.root, None, _picture(self.root), depth, weight, 1.0 / (self.root.width * self.root.height))
        while self.open and len(self.nodes) < self.settings.most:
            _, _, node, pixel = heapq.heappop(self.open)
            camera = self.camera_of(node)
            if camera is None:
                self.culled[OUTSIDE] += 1  # beyond the far plane
                continue
            planar = isinstance(self.mirrors[node["mirror"]], MirrorPlane)
            size = (0, 0, camera.width, camera.height)
            drawn, finer = size, 1
            if planar:
                roughness, window = self.mirrors[node["mirror"]].roughness[1], node["window"] if self.cull.scissor else size
                if node["depth"] == 1:  # deeper ones are filtered once more, or are a cube map's
                    finer = fineness(window, roughness, camera)
                camera = camera.finer(finer)
                drawn = widened(tuple(finer * side for side in window), roughness, camera)
            made = Node(camera=camera, drawn=drawn, finer=finer, **node)
            self.nodes.append(made)
            polygon, each = tuple((finer * x, finer * y) for x, y in made.polygon), pixel / finer**2
            if not planar:
                polygon = _picture(camera)
                each = made.share / (camera.width * camera.height)
            self.expand(len(self.nodes) - 1, camera, made.mirror, polygon, made.depth, made.weight, each)
        for _, _, node, _ in sorted(self.open, key=lambda entry: entry[:2]):
            self.end(node, MOST)
        return self.ordered()

    def camera_of(self, node: dict) -> Camera | None:
        mirror = self.mirrors[node["mirror"]]
        camera = self.root if node["parent"] == ROOT else self.nodes[node["parent"]].camera
        if isinstance(mirror, CurvedMirror):
            side = self.settings.side
            if self.cull.size:
                side = side_of(max(node["window"][2:]), side, self.sides.get(node["path"]))
            return approximate_view(mirror, camera, side)
        if isinstance(mirror, Pane):
            return through(camera, mirror)
        seen = mirrored(camera, mirror) if node["facing"] else image_of(camera, mirror)
        if seen is None and not (self.cull.window or self.cull.frustum):
            return image_of(camera, mirror)  # not seen, and drawn all the same
        return seen

    def expand(self, index: int, camera: Camera, by: int | None, polygon: Polygon, depth: int, weight: float, pixel: float) -> None:
        """Everything that the view shows is opened, ended or culled. by: the mirror it was made by; pixel: a pixel's share."""
        last = depth >= self.settings.depth  # nothing deeper is drawn: what is not seen is not counted as culled
        within = polygon if self.cull.window else _picture(camera)
        path = () if index == ROOT else self.nodes[index].path
        for mirror, facing, clip in self.looked_at(camera, by, within, last):
            found: Polygon = within
            if clip is not None and (self.cull.window or self.cull.frustum):
                found = seen_through(clip, camera.width, camera.height, within)
                if not found:
                    self.culled[COVERED if self.cull.window else OUTSIDE] += not last
                    continue
            share = min(area(found), area(within)) * pixel  # rounding apart it is no more than its parent's
            node = {
                "mirror": mirror, "parent": index, "depth": depth + 1, "facing": facing, "polygon": found, "share": share, "path": (*path, mirror),
                "weight": weight * _reflectance(self.mirrors[mirror], camera, facing), "window": window_of(found, camera.width, camera.height),
            }  # fmt: skip
            energy = node["weight"] * share
            if last:
                self.end(node, DEPTH)
            elif self.cull.area and share * self.root.width * self.root.height < self.settings.least_pixels:
                self.end(node, SMALL)
            elif self.cull.energy and energy < self.settings.least_energy:
                self.end(node, FAINT)
            else:
                heapq.heappush(self.open, (-energy, next(self.number), node, pixel))

    def looked_at(self, camera: Camera, by: int | None, within: Polygon, last: bool):
        """(mirror, facing, (K, 4) clip coordinates of its outline or None for all of the picture) of all mirrors but `by` and those culled at
        once: seen from behind, or with all corners on the wrong side of the near plane, of a side of the picture or of the polygon's box."""
        if self.planes:
            facing = height_of(camera, self.origin, self.normal) > IN_PLANE
            clip = self.corners @ camera.clip_from_world().T
            xs, ys = (np.array([p[k] for p in within]) / size * 2 - 1 for k, size in ((0, camera.width), (1, camera.height)))
            # What is no mirror to mirrors (mirrors.py) shows its lobe as captured.
            left = (self.indices != by) & ~(self.dull & (by is not None))
            for reason, culled in (
                (BEHIND, ~facing & self.cull.back_faces),
                (OUTSIDE, self.all_outside(clip, (-1.0, -1.0, 1.0, 1.0)) & self.cull.frustum),
                (COVERED, self.all_outside(clip, (xs.min(), ys.min(), xs.max(), ys.max())) & self.cull.window),
            ):
                self.culled[reason] += 0 if last else int((left & culled).sum())
                left &= ~culled
            for k in np.flatnonzero(left).tolist():
                yield self.planes[k][0], bool(facing[k]), clip[self.first[k] : self.first[k + 1]]
        for mirror, curved in self.curved:
            if mirror != by:
                outline = outline_of(curved, camera)
                clip = None if outline is None else np.column_stack([outline, np.ones(len(outline))]) @ camera.clip_from_world().T
                yield mirror, True, clip

    def all_outside(self, clip: np.ndarray, box: tuple[float, float, float, float]) -> np.ndarray:
        """(P,) bool: whether all corners of an outline are beyond one side of a box (x, y, x, y) or nearer than the near plane."""
        x, y, z, w = clip.T
        heights = np.stack([x - box[0] * w, y - box[1] * w, box[2] * w - x, box[3] * w - y, z + w])
        return (np.maximum.reduceat(heights, self.first[:-1], axis=1) < 0).any(0)

    def end(self, node: dict, reason: str) -> None:
        self.culled[reason] += 1
        self.ended.append(Ended(node["mirror"], node["parent"], reason, node["window"], node["weight"] * node["share"]))

    def ordered(self) -> Tree:
        """The nodes depth first."""
        below: dict[int, list[int]] = {i: [] for i in range(ROOT, len(self.nodes))}
        for i, node in enumerate(self.nodes):
            below[node.parent].append(i)
        order, stack = [], [ROOT]
        while stack:
            at = stack.pop()
            order += [at] if at != ROOT else []
            stack += sorted(below[at], key=lambda i: -self.nodes[i].mirror)
        place = {old: new for new, old in enumerate(order)} | {ROOT: ROOT}
        nodes = tuple(replace(self.nodes[old], parent=place[self.nodes[old].parent]) for old in order)
        children = {place[old]: tuple(sorted(place[i] for i in kids)) for old, kids in below.items()}
        ended = tuple(replace(e, parent=place[e.parent]) for e in self.ended)
        return Tree(self.root, self.mirrors, nodes, children, self.culled, ended)


def _picture(camera: Camera) -> Polygon:
    return ((0.0, 0.0), (camera.width, 0.0), (camera.width, camera.height), (0.0, camera.height))


def _reflectance(mirror: MirrorPlane | CurvedMirror, camera: Camera, facing: bool) -> float:
    if isinstance(mirror, CurvedMirror):
        return mirror.mean
    least = float(np.min(height_of(camera, mirror.outline, mirror.normal))) if facing else 1.0
    return mirror.specular + (mirror.grazing - mirror.specular) * (1.0 - min(max(least, 0.0), 1.0)) ** 5
