"""Kinds of edits, each alone: what must be made again is what is called old and what a bake makes again, and nothing else."""

import shutil

import bpy
import pytest
from stale_scene import bake, build, loaded

from reflect_addon.core.refresh import balls_of
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.scene.freshness import refresh_of, remark, why_stale
from reflect_addon.scene.properties import object_properties

BOTH = ("Left", "Right")
ENDS = ("sphere_proxy", "box_proxy", "distance_map")  # where rays end, and no light
SEEN = ("environment", "layered_distance", "billboards", "depth_maps", "light_field")  # light and where it comes from
DRAWN = ("virtual_objects", "recursive")  # the reflector's own shape, and whose surfaces are drawn
KINDS = (*SEEN, *ENDS, *DRAWN)
SURFACES = "surface_radiance-all"


def of(kinds, names=BOTH, surfaces=True) -> set[str]:
    return {f"{kind}-{name}" for kind in kinds for name in names} | ({SURFACES} if surfaces else set())


NOTHING = set()
LIT = of((*SEEN, "recursive"))
PAINTED = of(SEEN)
PLACED = of((*SEEN, *ENDS))
LIT_AND_PLACED = LIT | PLACED
ALL = of(KINDS)

D = bpy.data


def node(material: str, kind: str):
    return next(n for n in D.materials[material].node_tree.nodes if n.type == kind)


def bsdf(material: str, socket: str, value) -> None:
    node(material, "BSDF_PRINCIPLED").inputs[socket].default_value = value


def vertex(name: str) -> None:
    D.objects[name].data.vertices[0].co.x += 0.03
    D.objects[name].data.update()


def modifier(**values) -> None:
    made = D.objects["Crate"].modifiers.new("Subdivision", "SUBSURF")
    for name, value in values.items():
        setattr(made, name, value)


def uv() -> None:
    D.objects["Crate"].data.uv_layers[0].uv[0].vector = (0.3, 0.7)


def new_object() -> None:
    bpy.context.scene.collection.objects.link(D.objects.new("Vase", D.objects["Crate"].data))
    D.objects["Vase"].location = (-2, 2, 0.5)


def animated() -> None:
    crate, scene = D.objects["Crate"], bpy.context.scene
    for frame, x in ((1, 0.2), (10, 1.0)):
        crate.location.x = x
        crate.keyframe_insert("location", frame=frame)
    scene.frame_end = 10
    scene.frame_set(5)


def attribute() -> None:
    made = D.materials["Red"].node_tree.nodes.new("ShaderNodeAttribute")
    made.attribute_type, made.attribute_name = "OBJECT", '["shade"]'


def blocked() -> None:
    D.objects["Lamp"].light_linking.blocker_collection = D.collections.new("Blockers")


def put(block, name, value):
    return lambda: setattr(eval(block), name, value)  # after the scene was made


EDITS = {
    "crate moved": (put("D.objects['Crate']", "location", (0.3, 1.2, 0.25)), PLACED, "Crate was moved"),
    "crate turned": (put("D.objects['Crate']", "rotation_euler", (0, 0, 0.2)), PLACED, "Crate was moved"),
    "crate scaled": (put("D.objects['Crate']", "scale", (1, 1, 1.2)), PLACED, "Crate was moved"),
    "crate reshaped": (lambda: vertex("Crate"), PLACED, "Crate has another shape"),
    "crate subdivided in renders": (lambda: modifier(render_levels=1), PLACED, "Crate has another shape"),
    "crate subdivided in the viewport": (lambda: modifier(levels=1, show_render=False), NOTHING, ""),
    "crate's UVs moved": (uv, PAINTED, "Crate has other UVs or colors"),
    "crate painted": (lambda: D.objects["Crate"].data.color_attributes.new("Col", "BYTE_COLOR", "CORNER"), PAINTED, "Crate has other UVs or colors"),
    "crate has another material": (put("D.objects['Crate'].material_slots[0]", "material", None), LIT, "Crate has other materials"),
    "crate hidden from reflections": (put("D.objects['Crate']", "visible_glossy", False), ALL, "Crate is gone"),
    "crate casts no shadow": (put("D.objects['Crate']", "visible_shadow", False), PAINTED, "Crate is seen by other rays"),
    "crate hidden from cameras": (put("D.objects['Crate']", "visible_camera", False), NOTHING, ""),
    "crate off in renders": (put("D.objects['Crate']", "hide_render", True), ALL, "Crate is gone"),
    "crate off in viewports": (put("D.objects['Crate']", "hide_viewport", True), NOTHING, ""),
    "crate's eye closed": (lambda: D.objects["Crate"].hide_set(True), NOTHING, ""),
    "crate deleted": (lambda: D.objects.remove(D.objects["Crate"]), ALL, "Crate is gone"),
    "crate renamed": (put("D.objects['Crate']", "name", "Box"), ALL, "Crate is now called Box"),
    "crate's mesh renamed": (put("D.objects['Crate'].data", "name", "Box"), NOTHING, ""),
    "crate's color in the viewport": (put("D.objects['Crate']", "color", (1, 0, 0, 1)), NOTHING, ""),
    "crate selected": (lambda: D.objects["Crate"].select_set(True), NOTHING, ""),
    "crate has a property": (lambda: D.objects["Crate"].__setitem__("shade", 1.0), NOTHING, ""),
    "crate animated, another frame": (animated, PLACED, "Crate was moved"),
    "vase is new": (new_object, ALL, "Vase is new"),
    "material changed": (lambda: bsdf("Red", "Roughness", 0.5), LIT, "material Red was changed"),
    "ramp recolored": (put("node('Red', 'VALTORGB').color_ramp.elements[0]", "color", (0, 1, 0, 1)), LIT, "material Red was changed"),
    "texture asks for a property": (attribute, LIT, "material Red was changed"),
    "texture's anchor moved": (put("D.objects['Anchor']", "location", (0.5, 0, 0)), LIT, "material Red was changed"),
    "holes of a leaf": (lambda: bsdf("Green", "Alpha", 0.0), LIT_AND_PLACED, "material Green was changed"),
    "material renamed": (put("D.materials['Red']", "name", "Rouge"), NOTHING, ""),
    "material's viewport color": (put("D.materials['Red']", "diffuse_color", (0, 1, 0, 1)), NOTHING, ""),
    "material's node moved": (put("node('Red', 'VALTORGB')", "location", (500, 0)), NOTHING, ""),
    "another material": (put("D.materials['Unused']", "roughness", 0.9), NOTHING, ""),
    "lamp's power": (put("D.lights['Lamp']", "energy", 99), LIT, "Lamp was changed"),
    "lamp's color": (put("D.lights['Lamp']", "color", (1, 0, 0)), LIT, "Lamp was changed"),
    "lamp moved": (put("D.objects['Lamp']", "location", (0.5, 0, 4)), LIT_AND_PLACED, "Lamp was changed"),
    "lamp blocked by nothing": (blocked, LIT, "Lamp was changed"),
    "lamp off in renders": (put("D.objects['Lamp']", "hide_render", True), ALL, "Lamp is gone"),
    "sun turned": (put("D.objects['Sun']", "rotation_euler", (0.3, 0, 0)), LIT, "Sun was changed"),
    "world brighter": (put("D.worlds[0].node_tree.nodes['Background'].inputs[1]", "default_value", 2.0), LIT, "the world was changed"),
    "world's viewport color": (put("D.worlds[0]", "color", (1, 0, 0)), NOTHING, ""),
    "fewer bounces": (put("D.scenes[0].cycles", "diffuse_bounces", 1), LIT, "light bounces or color management were changed"),
    "camera moved": (put("D.objects['Camera']", "location", (3, -5, 1)), NOTHING, ""),
    "camera's lens": (put("D.cameras[0]", "lens", 85), NOTHING, ""),
    "no camera": (put("D.scenes[0]", "camera", None), NOTHING, ""),
    "output's size": (put("D.scenes[0].render", "resolution_x", 320), NOTHING, ""),
    "output's samples": (put("D.scenes[0].cycles", "samples", 7), NOTHING, ""),
    "exposure": (put("D.scenes[0].view_settings", "exposure", 2), NOTHING, ""),
    "another frame": (lambda: D.scenes[0].frame_set(12), NOTHING, ""),
    "more frames": (put("D.scenes[0]", "frame_end", 100), NOTHING, ""),
    "empty moved": (put("D.objects['Empty']", "location", (1, 1, 1)), NOTHING, ""),
    "ghost moved": (put("D.objects['Ghost']", "location", (1, 1, 1)), NOTHING, ""),
    "left reflector moved": (put("D.objects['Left']", "location", (-1.3, 0, 0.5)), PLACED, "Left was moved"),
    "left reflector reshaped": (lambda: vertex("Left"), PLACED | of(DRAWN, ["Left"]), "Left has another shape"),
    "left reflector a little rougher": (lambda: bsdf("Mirror", "Roughness", 0.05), LIT, "material Mirror was changed"),
    "left reflector dull": (lambda: (bsdf("Mirror", "Roughness", 1), bsdf("Mirror", "Metallic", 0)), of((*SEEN, "recursive"), ["Right"]), "material Mirror was changed"),
    "left reflector unmarked": (put("D.objects['Left']", "reflect_mark", "NO"), of(("billboards", "depth_maps"), ["Right"]), "Left mirrors no longer"),
    "left reflector marked": (put("D.objects['Left']", "reflect_mark", "YES"), of(["recursive"], ["Left"], surfaces=False), "Left mirrors elsewhere"),
}  # fmt: skip


@pytest.fixture(scope="module")
def baked(tmp_path_factory):
    """(file, folder of its assets): made once."""
    folder = tmp_path_factory.mktemp("stale")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with object_properties():
        build()
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / "stale.blend"))
        assert set(bake(folder / "assets", KINDS)) == ALL
    return folder / "stale.blend", folder / "assets"


@pytest.mark.parametrize("name", EDITS)
def test_an_edit_makes_old_exactly_what_it_concerns(baked, name, tmp_path):
    edit, wanted, reason = EDITS[name]
    with object_properties():
        bpy.ops.wm.open_mainfile(filepath=str(baked[0]))
        shutil.copytree(baked[1], tmp_path / "assets")
        assert bake(tmp_path / "assets", KINDS) == [], "nothing was changed yet"
        edit()
        bpy.context.view_layer.update()
        assets = loaded(tmp_path / "assets")
        old, said = called_old(assets)
        assert old == wanted - {SURFACES}
        assert (reason in said) if reason else not said
        assert set(bake(tmp_path / "assets", KINDS)) == wanted
        assert bake(tmp_path / "assets", KINDS) == [] and called_old(loaded(tmp_path / "assets")) == (set(), set())


def called_old(assets) -> tuple[set[str], set[str]]:
    """(folders' names of assets that are old, of reflectors that are there; what is said of them)."""
    old, said = set(), set()
    with open_frame(bpy.context.scene, None) as snapshot:
        for reflector in snapshot.reflectors():
            found = [assets[kind, reflector.name] for kind in KINDS if (kind, reflector.name) in assets]
            for asset in found:
                changes, left = why_stale(snapshot, asset, found), remark(asset, snapshot, reflector)
                if changes or left:
                    old.add(f"{asset.kind}-{reflector.name}")
                said |= {change.sentence for change in changes}
            refresh = refresh_of(snapshot, reflector, found, lambda: balls_of(snapshot))
            assert (refresh is None) == (not any(name.endswith(reflector.name) for name in old))
            assert refresh is None or (0 < refresh.error <= 1 and refresh.seconds > 0 and set(refresh.reasons) >= said & set(refresh.reasons))
    return old, said
