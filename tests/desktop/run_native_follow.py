"""Runs inside a real Blender window: a thing whose reflection follows it from frame to frame in the Rendered view, and what is said of assets
that are old, damaged or missing; see artist.py and native_room.py.
"""

import shutil
import sys
from pathlib import Path

import bpy
from desktop import view3d

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]
from artist import bake, inside, key, picture, press, results, run, scene, state  # noqa: E402
from blender_dump import dump  # noqa: E402
from native_room import PLACES, add_lantern, entered, lantern_in, settled, shown, use  # noqa: E402

FOLLOW = ("depth_maps", "billboards")
NOTHING = "Nothing is baked for this method yet: press Bake"


def materials():
    """All that "untouched" is about, to be compared. Not blender_dump: of a thousand nodes it takes half a minute."""
    slots = [(o.name, s.link, s.material and s.material.name) for o in bpy.data.objects for s in o.material_slots]
    trees = [(m.name, m.session_uid, *nodes(m.node_tree)) for m in bpy.data.materials]
    trees += [(g.name, g.session_uid, *nodes(g)) for g in bpy.data.node_groups]
    return slots, trees, [(i.name, i.session_uid) for kind in (bpy.data.images, bpy.data.actions) for i in kind]


def nodes(tree):
    """A tree's nodes with their settings and their sockets' values, and its links."""
    values = [
        ([repr(getattr(n, p.identifier)) for p in n.bl_rna.properties if p.type != "COLLECTION"], [repr(getattr(s, "default_value", None)) for s in n.inputs])
        for n in tree.nodes
    ]
    return values, [(link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier) for link in tree.links]


def original():
    """All that Remove brings back, to be compared."""
    return dump(("objects", "materials", "node_groups", "actions")), sorted(image.name for image in bpy.data.images)


def said():
    """The last thing that operators reported, as Blender's own Info editor has it."""
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type not in ("VIEW_3D", "PROPERTIES", "OUTLINER"))
    kept, area.ui_type = area.ui_type, "INFO"
    with bpy.context.temp_override(window=window, area=area, region=next(r for r in area.regions if r.type == "WINDOW")):
        bpy.ops.info.select_all(action="SELECT")
        bpy.ops.info.report_copy()
        lines = bpy.context.window_manager.clipboard.strip().splitlines()
    area.ui_type = kept
    return [line for line in lines if line and not line.startswith("bpy.")][-1]


def refused(name, words):
    """A click on Use in Materials changes nothing, and a report has these words."""
    before = materials()
    yield from press("reflect.use_in_materials")
    picture(name)
    yield from key("Escape")  # the report stands below the mouse and takes the next key
    assert materials() == before, f"{name}: materials are not what they were"
    tell(name, said(), words)


def greyed(name, words, panel=""):
    """A click on the button does nothing, for a reason with these words; what the panel says of assets has those of `panel`."""
    state().reload(scene())
    before = materials()
    yield from press("reflect.use_in_materials")
    picture(name)
    assert materials() == before, f"{name}: materials are not what they were"
    try:
        inside(bpy.ops.reflect.use_in_materials)
    except RuntimeError as error:
        tell(name, str(error), words)
    else:
        raise AssertionError(f"{name}: the button is not greyed")
    tell(f"{name}, in the panel", " ".join((*state().problems, *state().compared.missing)), panel)


def tell(name, sentence, words):
    results.setdefault("said", {})[name] = sentence
    assert words in sentence, (name, sentence)


def story():
    ball = yield from entered(add_lantern)
    *_, space = view3d()
    untouched = original()
    for method in FOLLOW:
        scene().reflect.method = method
        yield from bake()
    space.shading.type = "RENDERED"
    for method in FOLLOW:
        clicked = yield from use(method)
        yield from settled(f"02-{method}-first-frame", ball, lantern_in(ball, -1), clicked)
        yield from key("shift+Right")
        assert scene().frame_current == max(PLACES)
        yield from settled(f"02-{method}-last-frame", ball, lantern_in(ball, 1))
        if method == FOLLOW[0]:
            yield from key("shift+Left")
    yield from refused("03-old", "Ball was baked from another state of the scene")
    yield from key("shift+Left")
    yield from settled("04-first-frame-again", ball, lantern_in(ball, -1))

    kept = next(state().folder.glob(f"{FOLLOW[-1]}-*"))
    damaged = max(kept.iterdir(), key=lambda path: path.stat().st_size)
    damaged.write_bytes(damaged.read_bytes()[:100])
    yield from greyed("05-damaged", NOTHING, str(kept))
    shutil.rmtree(kept)
    yield from greyed("06-missing", NOTHING, "Ball")
    assert shown() == FOLLOW[-1]
    yield from press("reflect.remove_from_materials")
    assert original() == untouched, "Remove leaves a trace"


run(story)
