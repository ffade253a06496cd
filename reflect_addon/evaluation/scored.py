"""Rows of results: what a method answered, or EEVEE's own picture, judged against a frame's truth."""

from dataclasses import asdict
from pathlib import Path

from ..core import methods as registry
from ..core import metrics
from ..core.asset import Asset, asset_of
from ..core.rays import Answer
from ..scene.freshness import remarks
from .judged import Judged, scores_of, truth_settings, whose
from .native import Drawn
from .peer import NAME, Picture
from .pictures import method_files
from .rows import Row, is_software

REPORTED = 3  # assets of a method that a row's notes describe
EEVEE = "EEVEE"  # the backend of what it draws
WHOLE_FRAME = (
    "Milliseconds are those of EEVEE's whole frame, the groups in the scene's own materials, without its ray tracing (on a software device of its CPU time, which other work on the "
    "machine does not stretch); hit points are told in half floats, right to a two-thousandth of their distance."
)


def method_row(judged: Judged, name: str, assets: dict[str, Asset], answer: Answer, out: Path, asked: dict, *, notes=(), composite=None, **rest) -> Row:
    """A method's row. asked: settings of the bake; rest: the row's other fields."""
    truth = judged.truth.hits
    picture, scores, said = scores_of(judged, answer.radiance)
    said += notes
    bad = metrics.nonfinite(answer.radiance, answer.coverage, answer.position)
    if bad:
        said.append("Values that are not finite count as black in the errors.")
    unanswered = sorted(i.name for i in judged.snapshot.reflectors() if asset_of(assets, i) is None)
    if unanswered:
        said.append(f"No asset answers for: {', '.join(unanswered)}.")
    kinds = list({id(a): a for a in assets.values()}.values())
    said += dict.fromkeys(sentence for asset in kinds for sentence in remarks(asset, judged.snapshot))
    if report := getattr(registry.get(name), "report", None):
        said += dict.fromkeys(report(asset) for asset in kinds[:REPORTED])
    first = kinds[0].settings if kinds else {}
    error = metrics.hit_distance_error(answer, truth, judged.rays, judged.diagonal)
    return Row(
        **whose(judged),
        method=name,
        settings={**asked, **first, **truth_settings(judged)},
        **scores,
        **asdict(metrics.hit_errors(answer, truth, judged.rays, judged.diagonal)),
        bake_s=float(sum(a.bake_seconds for a in kinds)),
        nonfinite=bad,
        pictures=method_files(judged, name, picture, out, hit_error=error, composite=composite),
        notes=tuple(said),
        **rest,
    )


def peer_rows(judged: Judged, samples: int, probe_side: int, pictures: list[Picture], out: Path) -> list[Row]:
    """EEVEE's rows: the same pixels and truth, but no hit points, no passes to time and nothing that was baked."""
    rows = []
    for found in pictures:
        picture, scores, notes = scores_of(judged, found.radiance)
        counts = {"samples": samples, "probes": sum(found.probes.values()), **_seconds(found.times), "volume_s": found.set_up}
        rows.append(
            Row(
                **whose(judged),
                method=NAME,
                settings={**found.setting, "samples": samples, "probe_side": probe_side, **truth_settings(judged)},
                device=found.device,
                backend=EEVEE,
                **scores,
                nonfinite=metrics.nonfinite(found.radiance),
                pictures=method_files(judged, f"{NAME}{len(rows) or ''}", picture, out),
                counts=counts,
                notes=(*notes, *found.notes()),
            )
        )
    return rows


def group_row(judged: Judged, drawn: Drawn, assets: dict[str, Asset], samples: int, out: Path, asked: dict) -> Row:
    """The row of a method as node groups; one without numbers where it has none."""
    if drawn.error is not None:
        return Row(
            **whose(judged), method=drawn.method, settings={**asked, **truth_settings(judged)}, device=drawn.device, backend=EEVEE, notes=(drawn.error,)
        )
    plain, traced = drawn.told["plain"], drawn.told["traced"]
    software = is_software(drawn.device)
    counts = {name: drawn.told[name] for name in ("nodes", "look_ups", "images", "groups")}
    if plain is not None:
        counts |= {"samples": samples, **_seconds(plain), "traced_frame_s": traced["seconds"], "traced_frame_cpu_s": traced["busy"]}
    return method_row(
        judged, drawn.method, assets, drawn.answer, out, asked, notes=(*drawn.notes, WHOLE_FRAME), device=drawn.device, backend=EEVEE,
        ms=None if plain is None else 1e3 * plain["busy" if software else "seconds"], bytes=drawn.told["image_bytes"], counts=counts,
    )  # fmt: skip


def _seconds(times: dict[str, float]) -> dict[str, float]:
    return {"frame_s": times["seconds"], "frame_cpu_s": times["busy"], "sample_cpu_s": times["sample"], "compile_s": times["compile"]}
