"""The two ways to answer a ray map, with one face: GPU (what users see) and NumPy (the reference, any machine)."""

import platform
from time import perf_counter

import numpy as np

from ..core import methods as registry
from ..core.asset import Asset, asset_of
from ..core.camera import Camera
from ..core.kernel import Counts, record, run_numpy
from ..core.look import Look
from ..core.rays import Answer, RayMap, Rays
from ..core.reflection_tree import Tree
from ..core.snapshot import SceneSnapshot
from ..core.spaces import FAR, STATUS_HIT
from ..gpu.timing import Work
from ..scene.raymap_numpy import numpy_ray_map


class _Backend:
    notes: tuple[str, ...] = ()

    def __init__(
        self, snapshot: SceneSnapshot, assets: dict[str, Asset], look: Look, camera: Camera, ray_map: RayMap, surfaces: Asset | None = None
    ):
        self.snapshot, self.assets, self.look, self.camera, self.ray_map = snapshot, assets, look, camera, ray_map
        self.surfaces = surfaces

    def answer(self) -> Answer:
        """For the covered pixels in row order, single rays without footprint; zeros where no asset answers."""
        mask = self.ray_map.covered()
        owner, rays = self.ray_map.reflector[mask], self.ray_map.rays()
        count = len(rays)
        out = Answer(*(np.zeros(s, np.float32) for s in ((count, 3), (count,), (count, 3), (count,))))
        for index, instance in enumerate(self.snapshot.reflectors()):
            asset = asset_of(self.assets, instance)
            chosen = owner == index
            if asset is None or not chosen.any():
                continue
            part = self._run(asset, Rays(rays.origin[chosen], rays.direction[chosen]))
            for name in ("radiance", "coverage", "position", "status"):
                getattr(out, name)[chosen] = getattr(part, name)
        return out


def tree_words(tree: Tree) -> str:
    """A sentence on the mirrored views of a frame."""
    culled = ", ".join(f"{count} {reason}" for reason, count in tree.culled.items() if count)
    energy = sum(tree.left_out.values())
    return f"Mirrored views: {len(tree.nodes)} drawn on {tree.levels} levels; not drawn: {culled or 'none'}; energy left out: {energy:.2g}."


class NumpyBackend(_Backend):
    """Kernels in NumPy. Its milliseconds are those of the kernels alone, on the CPU."""

    backend = "NUMPY"
    notes = ("Milliseconds are those of the NumPy kernels on the CPU: only ratios say something.",)

    def __init__(self, *args):
        super().__init__(*args)
        if self.surfaces is not None:
            self.notes += ("Surfaces are drawn by a GPU alone: this row is what answers where none is drawn.",)
        self.device = f"CPU {platform.machine()}, NumPy {np.__version__}"
        self._work = Counts()
        self._programs = {}

    @staticmethod
    def ray_map(snapshot: SceneSnapshot, camera: Camera) -> RayMap:
        return numpy_ray_map(snapshot, camera)

    def _run(self, asset: Asset, rays: Rays) -> Answer:
        if id(asset) not in self._programs:
            self._programs[id(asset)] = record(registry.get(asset.kind).trace, asset)
        return run_numpy(self._programs[id(asset)], asset, rays, counts=self._work)

    def cost(self) -> dict:
        """What does not vary from run to run: work, uploads."""
        self.answer()
        return {"counts": {"fetches_per_ray": self._work.fetches_per_ray, "steps_per_ray": self._work.steps_per_ray}}

    def work(self) -> Work:
        """One frame, to be timed."""
        return Work(self.answer, lambda: None)

    def composite(self, truth) -> None:
        return None


class GpuBackend(_Backend):
    """Kernels as the viewport runs them, through Blender's gpu module."""

    def __init__(self, *args):
        super().__init__(*args)
        from ..gpu.device import describe
        from ..gpu.renderer import Renderer

        found = describe()
        self.backend = found["backend"]
        self.device = f"{found['renderer']} ({found['device']})"
        self._renderer = Renderer(self.snapshot, self.assets, look=self.look, surfaces=self.surfaces)
        start = perf_counter()
        self._renderer.prepare()
        self._upload_ms = (perf_counter() - start) * 1e3

    @staticmethod
    def ray_map(snapshot: SceneSnapshot, camera: Camera) -> RayMap:
        from ..gpu.renderer import Renderer

        renderer = Renderer(snapshot, {})
        ray_map = renderer.ray_map(camera)
        renderer.free()
        return ray_map

    def answer(self) -> Answer:
        """Methods that draw are asked for the frame itself."""
        if self.surfaces is None:
            return super().answer()
        self._renderer.settle(self.camera)
        mask, frame = self.ray_map.covered(), self._renderer.answer(self.camera)
        found = Answer(frame.radiance[mask], frame.coverage[mask], frame.position[mask], frame.status[mask])
        drawn, sky = found.status == STATUS_HIT, np.abs(found.position).max(-1, initial=0) > FAR / 2
        shares = (100 * part.sum() / max(len(part), 1) for part in (drawn & ~sky, sky, ~sky & ~drawn))
        before = self._renderer.counts()["searches"]
        said = ", ".join(f"{count:,} {name}" for name, count in self._renderer.virtual_statuses(self.camera).items())
        searches = self._renderer.counts()["searches"] - before
        self.notes = ("Of the pixels {:.1f} % show what is drawn, {:.1f} % the sky, {:.1f} % fell back on distance maps.".format(*shares),)
        if searches:
            self.notes += (f"Vertices: {said or 'none'}; {searches:,} searches.",)
        if (tree := self._renderer.mirrored_views) is not None:
            self.notes += (tree_words(tree),)
        return found

    def _run(self, asset: Asset, rays: Rays) -> Answer:
        from ..gpu.fill import trace_rays

        return trace_rays(asset, registry.get(asset.kind).trace, rays, 0.0, 0.0, half=True)

    @property
    def views(self) -> int:
        """Mirrored views of the picture that was answered or drawn last."""
        tree = self._renderer.mirrored_views
        return 0 if tree is None else len(tree.nodes)

    def cost(self) -> dict:
        self._renderer.picture(self.camera)  # first: what a new size allocates and compiles is no frame's work
        before = self._renderer.counts()
        self._renderer.picture(self.camera)
        counts = {k: v - before[k] for k, v in self._renderer.counts().items()}
        work = Counts()
        rays = self.ray_map.rays()
        step = max(len(rays) // 4096, 1)  # counts of a sample of the rays, in NumPy: the same kernel, the same work
        owner = self.ray_map.reflector[self.ray_map.covered()][::step]
        for index, instance in enumerate(self.snapshot.reflectors()):
            asset = asset_of(self.assets, instance)
            chosen = owner == index
            if asset is not None and chosen.any():
                some = Rays(rays.origin[::step][chosen], rays.direction[::step][chosen])
                run_numpy(record(registry.get(asset.kind).trace, asset), asset, some, counts=work)
        counts |= {"fetches_per_ray": work.fetches_per_ray, "steps_per_ray": work.steps_per_ray}
        return {"upload_ms": self._upload_ms, "counts": counts}

    def work(self) -> Work:
        return self._renderer.work(self.camera)

    def composite(self, truth) -> np.ndarray:
        """(H, W, 3) display-encoded: the frame as the viewport draws it, over Cycles' frame without its mirror part."""
        background = np.where(self.ray_map.covered()[..., None], truth.frame - truth.frame_glossy, truth.frame)
        return self._renderer.picture(self.camera, np.maximum(background, 0.0), "display")[..., :3]
