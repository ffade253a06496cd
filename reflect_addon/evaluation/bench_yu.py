"""The targets of yu-2005, Y1 to Y6, and what issue 4 claims of `columns`: two bakes, of the paper's size and of few views with
depths, and all that is measured on them.

The bake of the paper's size has one path a texel and one focal plane a slab, as the paper's. Half-float slabs keep depths in any case.
Frames are the reflection passes alone (ray map, look-up, resolve): a room drawn with them would bring every ratio nearer to 1.
"""

import numpy as np

from ..core.asset import Asset
from ..core.light_field import SLABS, cell_of
from ..core.methods import light_field
from ..core.processes import temporary_folder
from ..core.rays import RayMap, Rays
from ..scene.look import read_look
from . import bench_yu_bake, bench_yu_rays
from . import bench_yu_columns as room
from . import bench_yu_scene as scenes
from .bench_row import row

PAPER = {"views": 32, "view_texels": 128, "samples": 1, "depth": "false"}
FEW = {"views": 8, "view_texels": 128, "samples": 4}
SIZE = (512, 512)  # Y1, Y2
TURNS, FRAMES = 15, 2
PASS, PASSES = 1 << 17, 31  # rays of a pass, and turns
TILE, BUNDLE = 4, 1024  # px: squares of the frame that stay together in a pass, and the width of a gpu.fill.RayBundle
PAPERS_RATE = [80 / 400, 90 / 340, 70 / 260, 70 / 200]
LEVEL = 1.15
MEMORY = 2.0  # GiB
LOOK, PATHS = (160, 120), 32  # pictures of the claims, and Cycles' paths a ray of their truth
JUDGED = (320, 240)  # pictures of Y6: what is best for few rays is best for nothing else
TIMES = (1, 30, 60)  # frames of the claims
SMALL, MOVED, SMOOTH = (80, 60), range(13, 37), 32  # flicker: pictures, frames, paths a ray
ENVIRONMENT = {"samples": 4}  # over environment's defaults: its noise is nothing beside its lamps at wrong places


def measure(progress) -> list[dict]:
    """Rows for targets.json."""
    progress(0.0, "yu: rays and look-ups")
    rows = bench_yu_rays.measure()
    with temporary_folder("reflect-bench-") as folder:
        progress(0.03, "yu: baking columns with the paper's size, some minutes")
        large = scenes.baked_apart(folder / "large", **PAPER)
        progress(0.5, "yu: baking columns with few views")
        few = scenes.baked_apart(folder / "few", **FEW)
        small = room.compressed(large.asset)
        rows += _memory(large, small)
        progress(0.58, "yu: frames")
        scene = scenes.columns()
        environment = room.environment_at(scene, 1, **ENVIRONMENT)
        rows += _frames(large.asset, small, few.asset, environment)
        progress(0.75, "yu: the ball on its way")
        scene = scenes.columns()
        rows += _claims(scene, large.asset, small, few.asset)
        progress(0.9, "yu: baking beside a plain render")
        rows += bench_yu_bake.measure(scene)
    progress(1.0, "yu: done")
    return rows


def _memory(large: scenes.Baked, small: Asset) -> list[dict]:
    """Y3 and the bake's. small: the same slabs, compressed."""
    asset, peak = large.asset, large.peak / 2**30
    views, texels = asset.options["views"], asset.options["texels"]
    size, half = (a.bytes() / 2**20 for a in (small, asset))
    bits, all_bits = (a.bytes() * 8 / (SLABS * (views * texels) ** 2) for a in (small, asset))
    what = f"{len(cell_of(asset).slabs)} slabs of {views}x{views} views of {texels} texels a side"
    return [
        row("Y3", size, 48, size <= 48, f"MiB of {what} as the setting Compressed stores them, {bits:.0f} bits a ray.", paper=64),
        row("Y3-half", half, None, True, f"The same as half floats with depths, {all_bits:.0f} bits a ray."),
        row("I4-peak", peak, MEMORY, peak <= MEMORY,
            f"GiB, the most memory of the process that traced and saved {what} as half floats, {asset.uniforms['rays'] / 1e6:.0f} M rays of "
            "one path, Blender included."),
    ]  # fmt: skip


def _frames(large: Asset, small: Asset, few: Asset, environment: Asset) -> list[dict]:
    """Y1, Y2."""
    from ..gpu.renderer import Renderer

    shapes, plain, depth = scenes.shapes(SIZE), room.with_depth(large, False), room.with_depth(few, True)
    seen = []
    for shape in shapes:
        renderer = Renderer(shape.snapshot, {})
        seen.append(renderer.ray_map(shape.camera))
        renderer.free()
    rate = [_rate(s, plain, environment) for s in shapes]
    corrected = [_rate(s, depth, environment) for s in shapes]
    coded = [_rate(s, small, environment) for s in shapes]
    most = _rate(shapes[1], room.with_depth(large, True), environment)
    rays = [m.rays() for m in seen]
    each, each_coded = (_passes(a, seen) for a in (plain, small))
    level, level_coded = (float(e.max() / e.min()) for e in (each, each_coded))
    looks = [[bench_yu_rays.looks(a, Rays(r.origin[::16], r.direction[::16])) for r in rays] for a in (plain, depth)]
    covered = ", ".join(f"{m.covered().mean():.0%}" for m in seen)
    what = f"{', '.join(f'{s.name} ({s.faces:,} faces)' for s in shapes)} in columns, {SIZE[0]}x{SIZE[1]}, covering {covered}"
    return [
        row("Y1", rate, 0.5, min(rate) >= 0.5,
            f"Frame rate over environment's, 32x32 views of 128x128, one focal plane a slab: {what}; look-ups a ray {_listed(looks[0])}.",
            paper=PAPERS_RATE),
        row("Y1-compressed", coded, 0.5, min(coded) >= 0.5, "The same with block-compressed radiance, which a processor that draws decodes texel by texel."),
        row("Y1-depth", corrected, 0.35, min(corrected) >= 0.35,
            f"The same, 8x8 views with depths; texels a ray over 4: {_listed(looks[1])}. With 32x32 and depths {most:.2f} (sphere)."),
        row("Y2", level, LEVEL, level <= LEVEL,
            f"Longest over shortest pass of Y1's look-ups, without rasterising and resolve: {PASS:,} rays of each shape, in squares of {TILE}x{TILE} "
            f"pixels; {_listed(each / each.min())}. The same rays cost the same whatever the faces: what differs is how far apart neighbours look.",
            paper=90 / 70),
        row("Y2-compressed", level_coded, LEVEL, level_coded <= LEVEL, f"The same of Y1-compressed; {_listed(each_coded / each_coded.min())}."),
    ]  # fmt: skip


def _rate(shape: scenes.Shape, asset: Asset, environment: Asset) -> float:
    """Frames a second with the asset over those with environment."""
    from ..gpu.renderer import Renderer
    from ..gpu.timing import close_ratio, processor_clock

    base, own = (Renderer(shape.snapshot, {"": a}) for a in (environment, asset))
    ratio = close_ratio(base.work(shape.camera), own.work(shape.camera), TURNS, FRAMES, processor_clock())
    base.free()
    own.free()
    return ratio


def _passes(asset: Asset, seen: list[RayMap]) -> np.ndarray:
    """(shapes,) time of as many rays of each shape, over the turn's mean, median of PASSES turns."""
    from ..gpu.fill import RayBundle
    from ..gpu.timing import processor_clock

    clock, spent = processor_clock(), []
    works = [RayBundle(tiles(m)).work(asset, light_field.trace) for m in seen]
    for _ in range(PASSES + 1):
        spent.append([])
        for work in works:
            start = clock()
            work.submit()
            work.finish()
            spent[-1].append(clock() - start)
    times = np.array(spent[1:])  # the first compiles and uploads
    return np.median(times / times.mean(1, keepdims=True), axis=0)


def tiles(seen: RayMap, count: int = PASS) -> Rays:
    """`count` rays of covered squares of TILE x TILE pixels, some of them more than once, as neighbours in a RayBundle's rows as
    they are in the frame."""
    height, width = (n // TILE for n in seen.reflector.shape)

    def cut(image):
        image = image[: height * TILE, : width * TILE].reshape(height, TILE, width, TILE, -1)
        return image.swapaxes(1, 2).reshape(height * width, TILE, TILE, -1)

    whole = np.flatnonzero(cut(seen.covered()).all((1, 2, 3)))
    chosen = whole[np.arange(count // TILE**2) % len(whole)]

    def laid(image):
        rows = cut(image)[chosen].reshape(-1, BUNDLE // TILE, TILE, TILE, 3)
        return rows.swapaxes(1, 2).reshape(-1, 3)

    return Rays(laid(seen.origin), laid(seen.direction))


def _listed(values) -> str:
    return ", ".join(f"{v:.2f}" for v in values)


def _claims(scene, large: Asset, small: Asset, few: Asset) -> list[dict]:
    """Y6, and the issue's claims."""
    frames = [room.frame_of(scene, n, LOOK, PATHS) for n in TIMES]
    bases = [f.rmse(room.environment_at(scene, n, **ENVIRONMENT)) for n, f in zip(TIMES, frames, strict=True)]
    plain, depth = room.with_depth(large, False), room.with_depth(few, True)
    ours, coded, corrected, both = (
        [f.rmse(a) / b for f, b in zip(frames, bases, strict=True)] for a in (plain, small, depth, room.with_depth(large, True))
    )
    times = f"columns at frames {', '.join(map(str, TIMES))}, {LOOK[0]}x{LOOK[1]}: RMSE over that of environment baked anew at each frame"
    rows = [
        row("I4-columns", ours, 0.5, max(ours) <= 0.5, f"{times}; 32x32x128x128, one path a texel, one bake for all. Compressed: {_listed(coded)}."),
        row("I4-columns-depth", corrected, 1 / 3, max(corrected) <= 1 / 3,
            f"{times}; 8x8x128x128 with depths, four paths a texel. 32x32 with depths: {_listed(both)}."),
    ]  # fmt: skip
    look = read_look(scene)
    many = [room.frame_of(scene, n, SMALL, SMOOTH, truths=2) for n in MOVED]
    values = [room.flicker(asset, many, look) for asset in (plain, depth)]
    worst = [own / true for own, true in values]
    rows.append(row(
        "I4-flicker", worst, 2.0, max(worst) <= 2,
        f"Root mean square of second differences in time of display values over the truth's own, frames {MOVED[0]} to {MOVED[-1]} of columns, "
        f"{SMALL[0]}x{SMALL[1]}: 32x32 without depths, 8x8 with.",
    ))  # fmt: skip
    judged = [room.frame_of(scene, n, JUDGED, PATHS) for n in TIMES]
    found = room.scan(plain, judged)
    best = found.over_best()
    return [*rows, row(
        "Y6", best, 1.05, best <= 1.05,
        f"RMSE with the automatic focal planes over that with each slab's best of a scan of {room.SCAN}, columns at the same frames, "
        f"{JUDGED[0]}x{JUDGED[1]}; over the best one for all slabs {found.over_one():.3f}, over no disparity {found.over_sky():.2f}; slab by slab "
        f"{_listed(found.by_slab())} (share of the error {', '.join(f'{v:.3f}' for v in found.shares())}).",
    )]  # fmt: skip
