"""Targets E2, E3 and E7 of estalella-2005 where they are meant: grids against full searches on the device (gpu/virtual_grid.py).

What is searched is bench_estalella_grid's, all vertices for one part. Every search begins anew, as the paper's do: what the last frame
found is forgotten before each run (`how` has the ratios with it). Milliseconds are the processor's where it draws.
Where a grid cannot say, vertices are searched after all, and that is in the times: the paper interpolates there.
"""

from dataclasses import replace

import numpy as np

from ..core.asset import Asset
from ..core.methods import virtual_objects
from ..core.virtual_grid import CORNERS
from ..core.virtual_mesh import VirtualMesh
from ..core.virtual_status import CONVERGED
from .bench_estalella_grid import AWAY, FASTER, SHARES, TENTH, VISIBLE
from .bench_estalella_scene import STEPS, Kitchen, kitchen
from .bench_row import row

TURNS, FRAMES = 5, 2
CLEAR = (0.0, 0.0, 0.0, 0.0)


class _Device:
    """The bench's vertices on the device, and their searches."""

    def __init__(self, scene: Kitchen):
        from ..gpu.counts import Counts
        from ..gpu.texture_cache import TextureCache
        from ..gpu.virtual_scene import VirtualScene, image
        from ..gpu.virtual_search import Found, place

        self.counts, self.kitchen = Counts(), scene
        self.textures = TextureCache(self.counts)
        self.scene = VirtualScene(_mesh(scene), self.counts)
        self.found = Found(self.scene.virtual_img, self.scene.place_img, image(len(scene.positions), "RGBA16F", self.counts))
        names = self.scene.mesh.names
        place(self.found, scene.space.from_objects(np.tile(np.eye(4), (len(names), 1, 1))), self.counts)
        fixed = scene.fixed
        self.part = virtual_objects.TablePart(
            fixed["block"], scene.space.center, 1.0 / scene.space.units_per_metre, fixed["ball"], fixed["cone"], np.zeros(4)
        )
        self._texel = image(1, "R32F", self.counts)
        self.shown, self.ranges = np.ones(len(names), bool), [(0, len(scene.positions))]

    def _asset(self, name: str, tolerance: float) -> Asset:
        options = {"paper": name == "midpoint", "search_steps": STEPS[name], "grid_tolerance": tolerance}
        return Asset(virtual_objects.NAME, self.kitchen.reflector, self.kitchen.asset.images, options=options)

    def full(self, name: str, cold: bool = True):
        """Submits a search of all vertices."""
        from ..gpu.virtual_search import Search

        search = Search(self._asset(name, 0.0), self.textures, self.counts)

        def submit():
            if cold:
                self.found.start.clear(format="FLOAT", value=CLEAR)
            search.run(self.scene, self.found, self.kitchen.observer, self.part, self.ranges)

        return submit

    def grid(self, name: str, share: float = 0.0, tolerance: float = 0.0, scene: Kitchen | None = None, cold: bool = True):
        """Submits one with a grid, by share or to a tolerance; returns with it how many it searches, read back."""
        from ..gpu.device import ensure
        from ..gpu.virtual_draw import frame_of
        from ..gpu.virtual_grid import GridSearch, Seen
        from ..gpu.virtual_tables import GridTables, Nodes

        there = scene or self.kitchen
        search = GridSearch(self._asset(name, tolerance), self.textures, self.counts)
        tables = GridTables(self.scene.mesh, share, self.counts)
        nodes = Nodes(tables, tables.starts(self.counts))
        frame = ensure().types.GPUUniformBuf(frame_of(there.space, there.camera, 0, there.space.units_per_metre))

        def submit(counted: bool = False) -> int:
            before = self.counts.searches
            for start in (self.found.start, nodes.start) if cold else ():
                start.clear(format="FLOAT", value=CLEAR)
            seen = Seen(frame, there.camera.width, there.camera.height, counted)
            search.run(self.scene, nodes, self.found, there.observer, self.part, self.shown, self.ranges, seen)
            return self.counts.searches - before

        return submit

    def read(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(virtual (V, 4) homogeneous, status (V,), searched (V,) bool) of the last run."""
        from ..gpu.upload import read_texture

        count, textures = len(self.kitchen.positions), (self.found.virtual, self.found.place)
        held, place = (read_texture(texture, self.counts).reshape(-1, 4)[:count] for texture in textures)
        return np.column_stack([held[:, :3], np.ones(len(held))]).astype(np.float64), held[:, 3], place[:, 3] > 0.5

    def finish(self):
        """Waits for all that was submitted: the processor needs a texel of it."""
        self._texel.read()


def measure(progress) -> list[dict]:
    """Rows of targets.json (bench.Target)."""
    progress(0.0, "grids on the device: kitchen")
    device = _Device(kitchen())
    progress(0.2, "grids on the device: time")
    rows = [_faster(device)]
    progress(0.8, "grids on the device: displacement and cost")
    return [*rows, _displaced(device), _cost(device)]


def _faster(device: _Device) -> dict:
    from ..gpu.device import describe
    from ..gpu.timing import Work, processor_clock, time_in_turns

    ratios, full_ms, searches = {}, {}, []
    for name in STEPS:
        for cold in (True, False):
            grids = [device.grid(name, share, cold=cold) for share in SHARES]
            works = [Work(submit, device.finish) for submit in (device.full(name, cold), *grids)]
            times = time_in_turns(works, TURNS, FRAMES, processor_clock())
            ratios[name, cold] = [1.0 / max(times.ratio(1 + n, 0) or 0.0, 1e-6) for n in range(len(SHARES))]
            full_ms[name, cold] = times.median(0)
            searches = [submit(True) for submit in grids]

    def told(values, form):
        return ", ".join(format(value, form) for value in values)

    ours, vertices = ratios["midpoint", True], len(device.kitchen.positions)
    how = (
        f"on {describe()['renderer']}: {vertices} vertices, searched as published in {full_ms['midpoint', True]:.0f} ms; grids search "
        f"{told((count / vertices for count in searches), '.1%')} of as many, nodes and what they cannot say. From where the last frame ended "
        f"({full_ms['midpoint', False]:.0f} ms) {told(ratios['midpoint', False], '.1f')}. Newton ({full_ms['newton', True]:.0f} ms) "
        f"{told(ratios['newton', True], '.1f')}, from the last frame ({full_ms['newton', False]:.0f} ms) {told(ratios['newton', False], '.1f')}"
    )
    return row("E2 on the device", ours, list(FASTER), all(a >= b for a, b in zip(ours, FASTER, strict=True)), how, list(FASTER))


def _displaced(device: _Device) -> dict:
    scene = device.kitchen
    device.full("newton")()
    truth, said, _ = device.read()
    device.grid("newton", TENTH)()
    virtual, status, searched = device.read()
    seen = (said == CONVERGED) & (status == CONVERGED)
    off = np.linalg.norm(scene.project(virtual) - scene.project(truth), axis=1)
    ours = np.percentile(off[seen & ~searched], [50, 95, 99])
    how = (
        f"px, at {scene.camera.width} x {scene.camera.height}, of interpolated vertices against searched ones, both read back; median "
        f"{ours[0]:.3f}, 99th percentile {ours[2]:.2f}. Reflected are {(said == CONVERGED).sum()}, {seen.sum()} with the grid as well, of "
        f"which {(seen & searched).sum()} were searched"
    )
    return row("E3 on the device", ours[1], VISIBLE, ours[1] < VISIBLE, how)


def _cost(device: _Device) -> dict:
    """Searches of an octree over the reflector's size on the screen."""
    scene, told = device.kitchen, []
    low, high = scene.scene.bounds([scene.scene.named()[scene.reflector]])
    corners = np.column_stack([scene.space.points(np.where(CORNERS, high, low)), np.ones(8)])
    for away in AWAY:
        pose = scene.camera.world_from_camera.copy()
        pose[:3, 3] = scene.space.center + (pose[:3, 3] - scene.space.center) * away
        there = scene.seen_from(replace(scene.camera, world_from_camera=pose))
        told.append((float(np.prod(np.ptp(there.project(corners), axis=0))), device.grid("newton", tolerance=VISIBLE, scene=there)(True)))
    falls = all(b[1] < a[1] for a, b in zip(told, told[1:], strict=False))
    how = f"of {len(scene.positions)} vertices, octrees to {VISIBLE} px; (px^2 of the reflector's box, searches): " + ", ".join(
        f"({area:.0f}, {count})" for area, count in told
    )
    return row("E7 on the device", [count for _, count in told], None, falls, how)


def _mesh(scene: Kitchen) -> VirtualMesh:
    """The vertices without triangles, a chunk for each instance."""
    count, owners = len(scene.positions), np.unique(scene.instance)
    first = np.searchsorted(scene.instance, owners)
    sizes = np.diff([*first, count])
    none = np.zeros((count, 3), np.float32)
    return VirtualMesh(
        scene.positions, scene.instance.astype(np.int32), none, none, none[:, 0], np.zeros((0, 3), np.int32),
        tuple(str(owner) for owner in range(int(owners.max(initial=-1)) + 1)), np.stack([first, sizes, 0 * first, 0 * first], -1), owners,
        np.zeros((len(owners), 4)),
    )  # fmt: skip
