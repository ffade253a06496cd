"""The targets, measured: DIR/targets.json with a row per target. One module per paper adds its rows here. `stability` is no
paper: it writes DIR/stability.json (stability.py). What rows cannot show is in DIR/exhibits.json (exhibit.py). The report shows all."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from ..core.errors import ReflectError
from ..core.safe_write import write_whole
from . import (
    bench_depth,
    bench_eevee,
    bench_eevee_farm,
    bench_eevee_overlay,
    bench_estalella_device,
    bench_estalella_flicker,
    bench_estalella_grid,
    bench_estalella_iterations,
    bench_estalella_kitchen,
    bench_estalella_reflectors,
    bench_estalella_search,
    bench_estalella_stable,
    bench_ground,
    bench_limits,
    bench_mirrors,
    bench_nielsen_counts,
    bench_nielsen_curved,
    bench_nielsen_draw,
    bench_nielsen_endless,
    bench_nielsen_glass,
    bench_nielsen_glossy,
    bench_nielsen_maps,
    bench_nielsen_motion,
    bench_nielsen_planar,
    bench_nielsen_stable,
    bench_planner,
    bench_popescu,
    bench_srdm,
    bench_yu,
    exhibit,
    stability,
)  # fmt: skip

FORMAT = 1
FILE_NAME = "targets.json"
STABILITY = "stability"
# paper -> what measures its targets, each measure(progress) -> rows, and Exhibits among them. A paper whose methods do not exist yet has no entry.
PAPERS: dict[str, tuple[Callable, ...]] = {
    "popescu": (
        bench_popescu.measure, bench_mirrors.measure, bench_limits.measure, bench_ground.measure, bench_srdm.measure,
        bench_depth.measure,
    ),
    "yu": (bench_yu.measure,),
    "nielsen": (
        bench_nielsen_counts.measure, bench_nielsen_planar.measure, bench_nielsen_draw.measure, bench_nielsen_motion.measure,
        bench_nielsen_curved.measure, bench_nielsen_maps.measure, bench_nielsen_glossy.measure, bench_nielsen_endless.measure,
        bench_nielsen_stable.measure, bench_nielsen_glass.measure,
    ),
    "estalella": (
        bench_estalella_search.measure, bench_estalella_iterations.measure, bench_estalella_grid.measure, bench_estalella_flicker.measure,
        bench_estalella_kitchen.measure, bench_estalella_reflectors.measure, bench_estalella_stable.measure, bench_estalella_device.measure,
    ),
    "planner": (bench_planner.measure,),
    "eevee": (bench_eevee.measure,),
    "eevee-overlay": (bench_eevee_overlay.measure,),
    "eevee-farm": (bench_eevee_farm.measure,),
}  # fmt: skip


# No papers but issues 8 and 7, each up to an hour and more: `all` leaves them out.
ALONE = ("planner", "eevee", "eevee-overlay", "eevee-farm")
# Those that can be measured scene by scene: measure(progress, only).
SCENES_OF = {"planner": bench_planner.NAMES, "eevee": tuple(case.name for case in bench_eevee.CASES)}


@dataclass(frozen=True)
class Target:
    """One line of targets.json; numbers or lists of numbers, all measured in this run except paper and target."""

    id: str
    paper: float | list[float] | None
    ours: float | list[float]
    target: float | list[float] | None  # None: reported, nothing is asked of it
    holds: bool
    how: str  # one sentence


def bench(which: str, out: Path, progress: Callable[[float, str], object], only: tuple[str, ...] = ()) -> list[Path]:
    """Measures one paper's targets, the numerical stability, or all there is; returns the paths of what it wrote in out. only: names of scenes, for SCENES_OF."""
    if only and which not in SCENES_OF:
        raise ReflectError(f"{which} has no scenes to choose among.", f"Leave --only out, or measure one of: {', '.join(SCENES_OF)}.")
    if unknown := set(only) - set(SCENES_OF.get(which, ())):
        raise ReflectError(f"{which} has no scene named {', '.join(sorted(unknown))}.", f"Choose among: {', '.join(SCENES_OF[which])}.")
    papers = [name for name in PAPERS if name not in ALONE] if which == "all" else [which] if which != STABILITY else []
    missing = [name for name in papers if name not in PAPERS]
    if missing:
        raise ReflectError(
            f"No target of {missing[0]} can be measured yet: its methods do not exist in this version.",
            f"Measure one of: {', '.join(PAPERS)}, {STABILITY}, all.",
        )
    written = []
    if papers:
        written += _targets(papers, Path(out), progress, only)
    if which in (STABILITY, "all"):
        written.append(stability.write(stability.measure(progress), Path(out)))
    return written


def _targets(papers: list[str], out: Path, progress, only: tuple[str, ...]) -> list[Path]:
    parts = [partial(measure, only=only) if only else measure for name in papers for measure in PAPERS[name]]
    rows, exhibits = [], []
    for number, measure in enumerate(parts):

        def tell(share: float, what: str, number=number):
            return progress((number + share) / len(parts), what)

        for one in measure(tell):
            if isinstance(one, exhibit.Exhibit):
                exhibits.append(one)
            else:
                rows.append(Target(**one))
    return write_targets(rows, exhibits, out)


def write_targets(rows: list[Target], exhibits: list[exhibit.Exhibit], out: Path) -> list[Path]:
    """Writes DIR/targets.json and, where there are exhibits, DIR/exhibits.json with their pictures; returns their paths."""
    path = out / FILE_NAME
    data = {"format": FORMAT, "rows": [asdict(row) for row in rows]}
    write_whole(path, (json.dumps(data, indent=1, allow_nan=False) + "\n").encode())
    shown = exhibit.write(exhibits, out)
    return [path] if shown is None else [path, shown]
