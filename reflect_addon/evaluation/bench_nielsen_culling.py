"""What each culling of recursive mirrors saves: frames at rest with all of them but one, and with that one alone (nielsen-2002 section 4).

The paper culls back faces and says that "simple frustum culling improves the frame rates by a factor of 2 to 3". Ours are seven
(core/reflection_tree.py), settings of the method, so that each can be switched off. Their effects overlap: what is outside of a mirror is
often outside of the picture too. So a culling is worth at least what the frame costs more without it, and at most what it saves alone.
Counts stand beside times, which are of small pictures on what draws here: many pixels are dear on software, many views on a card.
Limits. At rest no cube map is made, so `size` shows in bytes and in the texels that maps have when they are made.
"""

from dataclasses import dataclass, fields, replace

from ..core.reflection_tree import NOTHING_CULLED, Culling
from ..gpu.timing import processor_clock, time_in_turns
from .bench_row import row
from .exhibit import Exhibit

NAMES = tuple(field.name for field in fields(Culling))
TURNS = 3
CULLINGS = {
    "every": Culling(), "none": NOTHING_CULLED,
    **{f"all but {name}": replace(Culling(), **{name: False}) for name in NAMES},
    **{f"{name} alone": replace(NOTHING_CULLED, **{name: True}) for name in NAMES},
}  # fmt: skip


@dataclass(frozen=True)
class Frame:
    """What a frame at rest costs."""

    views: int
    pixels: int  # px of all views
    triangles: int  # handed to the device, the picture's own ray map included
    texels: int  # of a whole set of cube maps' faces
    bytes: int  # of the targets of views and of cube maps
    time: float  # over that with every culling

    @property
    def counts(self) -> tuple[int, ...]:
        return self.views, self.pixels, self.triangles, self.texels, self.bytes


def table(scenes, live, progress) -> list:
    """Rows for targets.json and an Exhibit. scenes: baked ones; live(scene, culling) -> a renderer with all its cube maps."""
    found = {}
    for number, scene in enumerate(scenes):
        progress(number / len(scenes), f"culling: {scene.name}")
        found[scene.name] = frames(scene, live)
    return [*(_row(name, found) for name in NAMES), _shown(found)]


def frames(scene, live) -> dict[str, Frame]:
    """By name of CULLINGS."""
    renderers = [live(scene, culling) for culling in CULLINGS.values()]
    times = time_in_turns([one.work(scene.camera) for one in renderers], TURNS, 1, processor_clock())
    made = {name: _frame(scene, one, times.ratio(i, 0) or 1.0) for i, (name, one) in enumerate(zip(CULLINGS, renderers, strict=True))}
    for renderer in renderers:
        renderer.free()
    return made


def _frame(scene, renderer, time: float) -> Frame:
    before = renderer.counts()
    renderer.answer(scene.camera, positions=False)
    after, maps = renderer.counts(), renderer.mirrors.maps
    return Frame(
        after["views"] - before["views"], renderer.mirrors.passes.pixels, after["triangles"] - before["triangles"],
        sum(6 * (side + 2) ** 2 for side in maps.sides.values()), renderer.mirrors.targets.bytes() + maps.targets_bytes(), time,
    )  # fmt: skip


def _row(name: str, found: dict[str, dict[str, Frame]]) -> dict:
    pairs = [(one["every"], one[f"all but {name}"], one[f"{name} alone"], one["none"]) for one in found.values()]
    more = all(a <= b for every, without, _, _ in pairs for a, b in zip(every.counts, without.counts, strict=True))
    told = "; ".join(f"{scene} {e.views} of {w.views} views, {e.pixels} of {w.pixels} px, {e.triangles} of {w.triangles} triangles"
                     for scene, (e, w, _, _) in zip(found, pairs, strict=True))  # fmt: skip
    return row(
        f"N-cull-{name}", [w.time for _, w, _, _ in pairs], None, more,
        f"Time of a frame at rest without culling by {name}, all others on, over that with every culling; alone it takes the time of none to "
        f"{', '.join(f'{a.time / n.time:.2f}' for _, _, a, n in pairs)}. What is left of it: {told}. No count may fall without it.",
    )  # fmt: skip


def _shown(found: dict[str, dict[str, Frame]]) -> Exhibit:
    heads = ("scene", "culled by", "views", "pixels", "triangles", "texels of cube maps", "kB of targets", "time over every")
    lines = [
        (scene, name, str(f.views), str(f.pixels), str(f.triangles), str(f.texels), f"{f.bytes / 1024:.0f}", f"{f.time:.2f}")
        for scene, frames_ in found.items() for name, f in frames_.items()
    ]  # fmt: skip
    lead = (
        "Frames at rest, view-independent, cube maps kept: with every culling, with none, with all but one and with one alone. Triangles are those of "
        "surfaces and of ray maps."
    )
    return Exhibit("What each culling saves where frames are drawn", lead, heads, tuple(lines))
