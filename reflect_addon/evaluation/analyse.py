"""What Reflect sees in a scene: reflectors, what was simplified, what each method costs, what is baked and stale."""

from dataclasses import asdict
from functools import cache, partial

import bpy

from ..core import methods as registry
from ..core.errors import ReflectError
from ..core.job import BakeJob
from ..core.planning.goal import Goal
from ..core.planning.plan import Plan
from ..core.refresh import balls_of, duration
from ..scene.freshness import refresh_of, remark, settings_for
from ..scene.intersect import intersector
from ..scene.load import load_assets, plan_in
from ..scene.places import assets_of
from ..scene.planner import plan
from ..scene.ways import ways
from .frame import open_frame


def analyse_scene(scene: bpy.types.Scene, settings: dict[str, object] | None = None, planned: bool = False) -> dict:
    """JSON-ready: scene, reflectors, warnings, methods with the state and bytes of their assets, and what a bake with these
    settings would take; the plan that assets of `auto` were baked by, or, if asked for, the one that a bake would make now."""
    folder = assets_of(scene)
    with open_frame(scene, None) as snapshot:
        reflectors = []
        for instance in snapshot.reflectors():
            low, high = snapshot.bounds([instance])
            materials = [snapshot.materials[m] for m in dict.fromkeys(instance.materials)]
            reflectors.append(
                {
                    "name": instance.name,
                    "mark": instance.mark,
                    "triangles": len(snapshot.meshes[instance.mesh].triangles),
                    "size_m": [round(float(v), 6) for v in high - low],
                    "materials": [
                        {"name": m.name, "metallic": m.metallic, "roughness": m.roughness, "simplified": list(m.simplified)}
                        for m in materials
                    ],
                }
            )
        found_plan = _plan(scene, snapshot, folder, settings or {}, planned)
        methods = [_method(name, snapshot, folder, settings or {}) for name in (*registry.names(), registry.AUTO)]
        methods[-1]["predicted_bytes"] = sum(t.bytes for r in found_plan.rows for t in r.tried if r.is_taken(t)) if found_plan else None
    return {
        "file": bpy.data.filepath,
        "scene": scene.name,
        "frame": snapshot.frame,
        "objects": len(snapshot.instances),
        "triangles": sum(len(snapshot.meshes[i.mesh].triangles) for i in snapshot.instances),
        "diagonal_m": snapshot.diagonal(),
        "assets": str(folder),
        "reflectors": reflectors,
        "methods": methods,
        "plan": None if found_plan is None else asdict(found_plan),
        "warnings": list(snapshot.warnings),
    }


def _plan(scene, snapshot, folder, settings: dict, planned: bool) -> Plan | None:
    try:
        earlier = plan_in(folder)
    except ReflectError:
        earlier = None
    if not planned:
        return earlier
    goal = Goal.of(settings_for(registry.AUTO, settings))
    return plan(scene, snapshot, goal, settings, lambda share, text: None, earlier=earlier)[0]


def _method(name: str, snapshot, folder, settings: dict) -> dict:
    """State: 'not baked', 'fresh', 'stale', 'incomplete', or why it cannot be read. notes: what there is to say of its assets; stale: of each
    reflector with old ones why, what a bake of them takes, and about which share of what it sees is wrong, the largest first."""
    found = {"name": name, "bytes": None, "predicted_bytes": _predicted(name, snapshot, settings), "notes": [], "stale": []}
    try:
        assets = load_assets(snapshot, name, folder, alone=True)
    except ReflectError as error:
        return {**found, "state": f"unreadable: {error.message}"}
    if not assets:
        return {**found, "state": "not baked"}
    balls, named = cache(partial(balls_of, snapshot)), {r.name: r for r in snapshot.reflectors()}
    old = [refresh_of(snapshot, named[r], [asset, *asset.beside], balls) for r, asset in assets.items()]
    if old := sorted(filter(None, old), key=lambda one: -one.error):
        state = "stale"
    else:
        state = "fresh" if len(assets) == len(snapshot.reflectors()) else "incomplete"
    report = getattr(registry.get(name), "report", lambda asset: "")
    notes = [s for r in snapshot.reflectors() if r.name in assets for s in (remark(assets[r.name], snapshot, r), report(assets[r.name]))]
    size = sum(asset.bytes() for asset in {id(a): a for a in assets.values()}.values())
    return {**found, "state": state, "bytes": size, "notes": list(dict.fromkeys(filter(None, notes))), "stale": list(map(asdict, old))}


def _predicted(name: str, snapshot, settings: dict) -> int:
    """What the method says; else half floats of the cube maps in it and what it requires, with a third for mip levels: the part
    whose size the settings fix."""
    method = registry.get(name)
    if hasattr(method, "predicted_bytes"):
        asked = settings_for(name, settings)
        chosen, intersect, bounds = snapshot.reflectors(), intersector(snapshot), ways(snapshot)
        together = chosen if asked.get("shared") else ()
        jobs = [BakeJob(snapshot, r, None, intersect, asked, together=together, bounds=bounds) for r in chosen]
        return sum(method.predicted_bytes(job) for job in jobs[: 1 if together else None])
    kinds = registry.with_required((name,))
    texels = [6 * int(settings_for(k, settings).get("resolution", 0)) ** 2 for k in kinds]
    return int(sum(texels) * 8 * 4 / 3) * len(snapshot.reflectors())


def as_text(found: dict) -> str:
    lines = [
        f"{found['scene']}, frame {found['frame']}: {found['objects']} objects, {found['triangles']:,} triangles, "
        f"{found['diagonal_m']:.4g} m across",
        f"{len(found['reflectors'])} reflectors" if found["reflectors"] else "No reflector: nothing is metallic or glossy "
        "enough. Mark an object in the Reflect panel, or lower a material's roughness.",
    ]
    for r in found["reflectors"]:
        size = " x ".join(f"{v:.3g}" for v in r["size_m"])
        mark = "" if r["mark"] == "AUTO" else f", marked {r['mark'].lower()} by hand"
        lines.append(f"  {r['name']}: {r['triangles']:,} triangles, {size} m{mark}")
        for m in r["materials"]:
            lines.append(f"    {m['name']}: metallic {m['metallic']:.2g}, roughness {m['roughness']:.2g}")
            lines += [f"      simplified: {s}" for s in m["simplified"]]
    lines.append(f"Assets in {found['assets']}:")
    for m in found["methods"]:
        predicted = "--plan says what it would take" if m["predicted_bytes"] is None else f"about {m['predicted_bytes'] / 1e6:.2f} MB to bake"
        size = f"{m['bytes'] / 1e6:.2f} MB" if m["bytes"] else predicted
        lines.append(f"  {m['name']}: {m['state']}, {size}")
        lines += [f"    {note}" for note in m["notes"]]
        lines += [
            f"    {one['reflector']} is old: {'; '.join(one['reasons'])}. About {duration(one['seconds'])} to bake; {one['error']:.0%} of what it sees"
            for one in m["stale"]
        ]
    lines += _plan_lines(found["plan"]) if found["plan"] else []
    lines += [f"Warning: {w}" for w in found["warnings"]]
    return "\n".join(lines)


def _plan_lines(found: dict) -> list[str]:
    goal, rows = found["goal"], found["rows"]
    asked = f"{goal['tolerance']:g} {goal['unit']}" if goal["tolerance"] else "the best"
    lines = [f"Auto, asked for {asked}, for what {'the camera sees' if found['by_cameras'] else 'is seen from anywhere'}; planned in {found['seconds']:.1f} s:"]
    for row in rows:
        taken = next(t for t in row["tried"] if (t["method"], t["settings"]) == (row["method"], row["settings"]))
        measured = f", measured {row['measured']:.2g}" if row["measured"] >= 0 else ""
        lines.append(
            f"  {row['reflector']}: {row['method']}, promised {row['promised']:.2g} {goal['unit']}{measured}, {taken['cost']:.2g} look-ups, "
            f"about {taken['bytes'] / 1e6:.1f} MB and {taken['bake_seconds']:.0f} s of baking"
        )
        lines.append(f"    {row['reason']}")
        lines += [
            f"    left out: {one['what']}; {one['why']}; saves {one['cost']:.2g} look-ups, {one['bytes'] / 1e6:.1f} MB, {one['bake_seconds']:.0f} s"
            for one in row["left_out"]
        ]
    return lines + [f"  {sentence}" for sentence in found["warnings"]]
