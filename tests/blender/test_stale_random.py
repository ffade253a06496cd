"""A thousand random edits, undone and redone: whatever is called fresh is so, and what is as it was when it was baked is called fresh.

Two witnesses that share nothing with scene/fingerprint.py. At every step a list of what bakes read, written out here for what these edits touch; now and
then a whole bake into another folder, byte by byte. Bakes take no light, so the second is asked of where things are, the first of light as well.
"""

import itertools

import bpy
import numpy as np
import pytest
from stale_scene import bake, build, loaded, same_content

from reflect_addon.evaluation.frame import open_frame
from reflect_addon.scene.freshness import remark, why_stale
from reflect_addon.scene.properties import object_properties

EVERY = 50  # steps from one comparison with fresh bakes to the next
LIGHT = ("environment", "layered_distance", "billboards")
ENDS = ("sphere_proxy", "box_proxy")
SHAPES = ("virtual_objects",)
KINDS = (*LIGHT, *ENDS, *SHAPES)
THINGS = ("Crate", "Floor", "Leaf", "Left", "Right")
GREYS = ("Red", "Grey", "Green")


def place(rng, name):
    bpy.data.objects[name].location = rng.choice([-1.5, 0.0, 0.3, 1.7], 3) * [1, 1, 0] + [0, 0, 0.5]


def turn(rng, name):
    bpy.data.objects[name].rotation_euler.z = rng.choice([0.0, 0.5, 1.0])


def vertex(rng, name):
    mesh = bpy.data.objects[name].data
    mesh.vertices[int(rng.integers(4))].co.z += float(rng.choice([-0.05, 0.05]))
    mesh.update()


def uv(rng, _name):
    bpy.data.objects["Crate"].data.uv_layers[0].uv[int(rng.integers(6))].vector = rng.random(2)


def color(rng, _name):
    bsdf(rng.choice(GREYS)).inputs["Emission Color"].default_value = (*rng.choice([0.1, 0.5, 0.9], 3), 1)


def alpha(rng, _name):
    bsdf("Green").inputs["Alpha"].default_value = rng.choice([0.0, 0.5, 1.0])


def slot(rng, name):
    if name in ("Crate", "Floor", "Leaf"):
        bpy.data.objects[name].material_slots[0].material = bpy.data.materials[rng.choice(GREYS)]


def seen(rng, name):
    if name in ("Crate", "Floor", "Leaf"):
        kind = rng.choice(["visible_glossy", "visible_diffuse", "hide_render"])
        setattr(bpy.data.objects[name], kind, not getattr(bpy.data.objects[name], kind))


def lamp(rng, _name):
    bpy.data.lights["Lamp"].energy = float(rng.integers(1, 4))
    bpy.data.objects["Lamp"].location.x = float(rng.integers(0, 2))


def world(rng, _name):
    bpy.data.worlds[0].node_tree.nodes["Background"].inputs["Strength"].default_value = float(rng.integers(1, 4))


def new_or_gone(rng, _name):
    if vase := bpy.data.objects.get("Vase"):
        bpy.data.objects.remove(vase)
    else:
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("Vase", bpy.data.objects["Crate"].data))
        place(rng, "Vase")


def bounces(rng, _name):
    bpy.context.scene.cycles.diffuse_bounces = int(rng.integers(1, 5))


def camera(rng, _name):
    bpy.data.objects["Camera"].location = rng.random(3)


def viewport(rng, name):
    bpy.data.objects[name].color = (*rng.random(3), 1)
    bpy.data.materials["Red"].diffuse_color = (*rng.random(3), 1)
    bpy.data.objects["Ghost"].location = rng.random(3)
    bpy.data.objects["Empty"].location = rng.random(3)
    bpy.data.objects[name]["mine"] = float(rng.random())


EDITS = (place, turn, vertex, uv, color, alpha, slot, seen, lamp, world, new_or_gone, bounces, camera, viewport)


def bsdf(material):
    return next(n for n in bpy.data.materials[material].node_tree.nodes if n.type == "BSDF_PRINCIPLED")


def read_by_bakes() -> dict[str, object]:
    """By scope: what a bake of that scope reads of all that these edits touch, straight from Blender's data."""
    scene = bpy.context.scene
    shown = sorted((o for o in scene.objects if o.type == "MESH" and not o.hide_render), key=lambda o: o.name)
    points = {o.name: tuple(v.co[:] for v in o.data.vertices) for o in shown}
    values = {m: (tuple(bsdf(m).inputs["Emission Color"].default_value), bsdf(m).inputs["Alpha"].default_value) for m in GREYS}
    holes = {m: "solid" if alpha == 1.0 and m != "Green" else (color, alpha) for m, (color, alpha) in values.items()}
    holes["Green"] = "solid" if values["Green"][1] == 1.0 else values["Green"]
    of = {o.name: [s.material.name for s in o.material_slots] for o in shown}
    there = [(o.name, points[o.name], tuple(map(tuple, o.matrix_world))) for o in shown]
    lamps = [(o.name, tuple(map(tuple, o.matrix_world))) for o in scene.objects if o.type == "LIGHT"]
    ends = there, [(o.name, o.visible_glossy, [holes.get(m) for m in of[o.name]]) for o in shown], [one for one in lamps if one[0] == "Lamp"]
    light = [
        ends, lamps, [(n, [(m, values.get(m)) for m in ms]) for n, ms in of.items()], [o.visible_diffuse for o in shown], bpy.data.lights["Lamp"].energy,
        [tuple(uv.vector) for uv in bpy.data.objects["Crate"].data.uv_layers[0].uv] if of.keys() & {"Crate", "Vase"} else (),
        bpy.data.worlds[0].node_tree.nodes["Background"].inputs["Strength"].default_value, scene.cycles.diffuse_bounces,
    ]  # fmt: skip
    shapes = {name: (points[name], [o.name for o in shown if o.visible_glossy]) for name in ("Left", "Right")}
    return {**dict.fromkeys(LIGHT, repr(light)), **dict.fromkeys(ENDS, repr(ends)), **{f"virtual_objects-{n}": repr(s) for n, s in shapes.items()}}


def scope(read, kind, name):
    return read.get(kind) or read[f"{kind}-{name}"]


def called_fresh(assets) -> set[tuple[str, str]]:
    with open_frame(bpy.context.scene, None) as snapshot:
        reflectors = {r.name: r for r in snapshot.reflectors()}
        return {
            key for key, asset in assets.items() if key[0] in KINDS
            and not why_stale(snapshot, asset, [a for (_, n), a in assets.items() if n == key[1]]) and not remark(asset, snapshot, reflectors[key[1]])
        }  # fmt: skip


@pytest.mark.parametrize(("steps", "seed"), [(250, 20261129), pytest.param(1000, 1, marks=pytest.mark.slow)])
def test_no_stale_picture_is_called_fresh(fresh_file, tmp_path, steps, seed):
    rng, folder = np.random.default_rng(seed), tmp_path / "assets"
    with object_properties():
        build()
        bpy.ops.ed.undo_push(message="built")
        bake(folder, KINDS)
        assets, now = loaded(folder), read_by_bakes()
        baked_from = {key: scope(now, *key) for key in assets if key[0] in KINDS}
        counts = dict.fromkeys(("edit", "undo", "redo", "bake", "fresh", "old", "witness"), 0)
        depth = undone = 0
        for step in range(steps):
            roll = rng.random()
            if roll < 0.25 and depth:
                assert bpy.ops.ed.undo() == {"FINISHED"}
                depth, undone, what = depth - 1, undone + 1, "undo"
            elif roll < 0.7 and undone:
                assert bpy.ops.ed.redo() == {"FINISHED"}
                depth, undone, what = depth + 1, undone - 1, "redo"
            else:
                edit, name = EDITS[int(rng.integers(len(EDITS)))], str(rng.choice(THINGS))
                edit(rng, name)
                bpy.ops.ed.undo_push(message=f"{step} {edit.__name__}")
                depth, undone, what = min(depth + 1, bpy.context.preferences.edit.undo_steps - 2), 0, "edit"
            counts[what] += 1
            bpy.context.view_layer.update()
            if rng.random() < 0.06:
                bake(folder, KINDS)
                assets, now = loaded(folder), read_by_bakes()
                baked_from, counts["bake"] = {key: scope(now, *key) for key in assets if key[0] in KINDS}, counts["bake"] + 1
            now, fresh = read_by_bakes(), called_fresh(assets)
            wanted = {key for key, read in baked_from.items() if read == scope(now, *key)}
            assert fresh == wanted, f"step {step}, {what}, {edit.__name__} {name}: {sorted(fresh ^ wanted)}"
            counts["fresh"] += len(fresh)
            counts["old"] += len(baked_from) - len(fresh)
            if step % EVERY == 0:
                bake(tmp_path / f"anew{step}", KINDS)
                for key, asset in loaded(tmp_path / f"anew{step}").items():
                    if key in fresh and key[0] not in SHAPES:  # whose maps follow what moved
                        assert same_content(assets[key], asset), (step, key)
                        counts["witness"] += 1
        assert min(counts.values()) > steps / 50 and counts["undo"] > steps / 10 and counts["redo"] > steps / 20
        assert sum(counts[what] for what in ("edit", "undo", "redo")) == steps


def test_undo_and_redo_work_here(fresh_file):
    """What the other test stands on: in background mode, too, each step of the history is a state of the scene."""
    build()
    bpy.ops.ed.undo_push(message="0")
    for x in (1.0, 2.0, 3.0):
        bpy.data.objects["Crate"].location.x = x
        bpy.ops.ed.undo_push(message=str(x))
    at = lambda: bpy.data.objects["Crate"].location.x  # noqa: E731
    for way, wanted in itertools.chain(zip(("undo",) * 3, (2.0, 1.0, pytest.approx(0.2))), zip(("redo",) * 3, (1.0, 2.0, 3.0))):
        getattr(bpy.ops.ed, way)()
        assert at() == wanted
