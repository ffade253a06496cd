"""What bakes read beside meshes and materials: hair, points, volumes, values of objects; settings; assets of before there were items; analyse."""

from dataclasses import replace

import bpy
import numpy as np
import pytest
from stale_scene import SMALL, bake, build

from reflect_addon.core.asset_files import load_asset, save_asset
from reflect_addon.core.scene_items import COVER, MATERIAL, MATERIALS, PAINT, STRANDS
from reflect_addon.core.staleness import UNKNOWN
from reflect_addon.evaluation import analyse
from reflect_addon.evaluation.frame import open_frame
from reflect_addon.scene import bake as baking
from reflect_addon.scene.freshness import is_stale, refresh_of, remark, why_stale
from reflect_addon.scene.load import load_assets

D = bpy.data


@pytest.fixture
def stage(fresh_file):
    return build()


def items():
    bpy.context.view_layer.update()
    with open_frame(bpy.context.scene, None) as snapshot:
        return snapshot.items


def differs(edit) -> set[tuple[str, str]]:
    """(aspect, name) of the items that an edit changes."""
    before = items()
    edit()
    after = items()
    keys = {(a, n) for table in (before, after) for a, named in table.items() for n in named}
    return {(a, n) for a, n in keys if before.get(a, {}).get(n) != after.get(a, {}).get(n)}


def ask(kind: str, **values) -> None:
    """A node in the crate's material."""
    node = D.materials["Red"].node_tree.nodes.new(kind)
    for name, value in values.items():
        setattr(node, name, value)


def link(name: str, data) -> bpy.types.Object:
    made = D.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    return made


def test_colors_of_objects_count_where_a_material_asks_for_them(stage):
    crate = D.objects["Crate"]
    paint = lambda *rgb: lambda: setattr(crate, "color", (*rgb, 1))  # noqa: E731
    assert differs(paint(1, 0, 0)) == set()
    ask("ShaderNodeObjectInfo")
    items()
    assert differs(paint(0, 1, 0)) == {(PAINT, "Crate")}


def test_properties_of_objects_count_where_a_material_asks_for_them(stage):
    crate = D.objects["Crate"]
    give = lambda value: lambda: (crate.__setitem__("shade", value), crate.update_tag())  # noqa: E731
    assert differs(give(1.0)) == set()
    ask("ShaderNodeAttribute", attribute_type="OBJECT", attribute_name="shade")
    items()
    assert differs(give(2.0)) == {(PAINT, "Crate")}
    assert differs(lambda: crate.__setitem__("other", 1.0)) == set()


def test_hair_points_and_volumes(stage, tmp_path):
    points = link("Points", D.pointclouds.new("Points"))
    points.data.resize(3)
    assert differs(lambda: setattr(points, "location", (1, 0, 0))) == {(STRANDS, "Points")}
    assert differs(lambda: (setattr(points.data.points[0], "co", (1, 2, 3)), points.data.update_tag())) == {(STRANDS, "Points")}
    hair = D.hair_curves.new("Hair")
    hair.add_curves([4])
    link("Hair", hair)
    assert differs(lambda: (setattr(hair.points[1], "position", (1, 2, 3)), hair.update_tag())) == {(STRANDS, "Hair")}
    (tmp_path / "smoke.vdb").write_bytes(b"one")
    smoke = link("Smoke", D.volumes.new("Smoke"))
    assert differs(lambda: setattr(smoke.data, "filepath", str(tmp_path / "smoke.vdb"))) == {(STRANDS, "Smoke")}
    assert differs(lambda: (tmp_path / "smoke.vdb").write_bytes(b"another")) == {(STRANDS, "Smoke")}
    assert differs(lambda: setattr(smoke, "hide_render", True)) == {(STRANDS, "Smoke")}


def test_hair_that_particles_are(stage):
    def grow():
        D.objects["Floor"].modifiers.new("Hair", "PARTICLE_SYSTEM")
        settings = D.objects["Floor"].particle_systems[0].settings
        settings.type, settings.count = "HAIR", 5

    assert (STRANDS, "Floor") in differs(grow)
    settings = D.objects["Floor"].particle_systems[0].settings
    assert (STRANDS, "Floor") in differs(lambda: setattr(settings, "hair_length", 0.2))


def test_curves_of_values_and_displacement(stage):
    tree = D.materials["Grey"].node_tree
    curve = tree.nodes.new("ShaderNodeRGBCurve")
    items()
    bend = lambda: (setattr(curve.mapping.curves[3].points[1], "location", (1.0, 0.4)), curve.mapping.update(), D.materials["Grey"].update_tag())  # noqa: E731
    assert differs(bend) == {(MATERIAL, "Grey"), (MATERIALS, "Floor")}
    displace = tree.nodes.new("ShaderNodeDisplacement")
    output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
    found = differs(lambda: tree.links.new(displace.outputs[0], output.inputs["Displacement"]))
    assert found == {(MATERIAL, "Grey"), (MATERIALS, "Floor"), (COVER, "Floor")}, "it may move the surface"
    assert (COVER, "Floor") in differs(lambda: setattr(displace.inputs["Scale"], "default_value", 2.0))


def test_holes_by_a_material_for_all_and_by_a_link_that_is_off(stage):
    clear = D.materials.new("Clear")
    next(n for n in clear.node_tree.nodes if n.type == "BSDF_PRINCIPLED").inputs["Alpha"].default_value = 0.0
    found = differs(lambda: setattr(bpy.context.view_layer, "material_override", clear))
    assert {("light", ""), (COVER, "Crate"), (COVER, "Leaf")} <= found and not any(aspect == MATERIALS for aspect, _ in found)
    bpy.context.view_layer.material_override = None
    link = next(link for link in D.materials["Grey"].node_tree.links if link.to_socket.name == "Surface")
    assert (COVER, "Floor") in differs(lambda: setattr(link, "is_muted", True))


def test_no_camera_makes_anything_old_though_a_bake_looks_where_it_is(stage, tmp_path, monkeypatch):
    """A light field whose cell holds the camera: that it left is said, and a bake makes a larger cell."""
    monkeypatch.setitem(SMALL, "cameras", True)
    bake(tmp_path, ["light_field"])
    assert bake(tmp_path, ["light_field"]) == []
    D.objects["Camera"].location = (9, -9, 3)
    bpy.context.view_layer.update()
    with open_frame(stage, None) as snapshot:
        for reflector in snapshot.reflectors():
            asset = load_assets(snapshot, "light_field", tmp_path)[reflector.name]
            assert why_stale(snapshot, asset) == () and not is_stale(snapshot, asset)
            assert refresh_of(snapshot, reflector, [asset], dict) is None and "The camera has left" in remark(asset, snapshot, reflector)
    assert bake(tmp_path, ["light_field"]) == ["light_field-Left", "light_field-Right"]


def test_copies_have_their_own_items(stage):
    vases = D.collections.new("Vases")
    vases.objects.link(D.objects.new("Vase", D.objects["Crate"].data))
    for name, x in (("First", -2), ("Second", 2)):
        empty = link(name, None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", vases, (x, 2, 0.5)
    found = items()["place"]
    assert {"Vase/1", "Vase/2"} <= found.keys() and found["Vase/1"] != found["Vase/2"]
    moved = differs(lambda: setattr(D.objects["Second"], "location", (2, 3, 0.5)))
    assert moved == {("place", "Vase/2")}


def test_another_setting_makes_what_reads_it_again(stage, tmp_path, monkeypatch):
    kinds = ("environment", "box_proxy", "billboards", "virtual_objects")
    bake(tmp_path, kinds)
    for settings, wanted in (
        ({"texels": 16}, {"billboards"}), ({"map_texels": 32}, {"virtual_objects"}), ({"search_steps": 9}, {"virtual_objects"}),
        ({"resolution": 16}, {"environment", "box_proxy", "billboards", "layered_distance"}), ({"layers": 1}, {"layered_distance"}),
    ):  # fmt: skip
        monkeypatch.setitem(SMALL, *next(iter(settings.items())))
        assert {name.partition("-")[0] for name in bake(tmp_path, kinds)} == wanted, settings
    assert bake(tmp_path, kinds) == []


def test_only_one_reflector_is_baked_and_the_others_stay_old(stage, tmp_path):
    bake(tmp_path, ["environment"])
    D.objects["Crate"].location.x += 0.1
    assert bake(tmp_path, ["environment"], reflectors=["Right"]) == ["environment-Right"]
    with open_frame(stage, None) as snapshot:
        assert {name for name, asset in load_assets(snapshot, "environment", tmp_path).items() if is_stale(snapshot, asset)} == {"Left"}


def test_an_asset_of_before_there_were_items_knows_that_but_not_what(stage, tmp_path):
    bake(tmp_path, ["environment"])
    path = tmp_path / "environment-Left"
    save_asset(replace(load_asset(path), items={}, balls={}), path)
    with open_frame(stage, None) as snapshot:
        assert why_stale(snapshot, load_asset(path)) == ()
    D.objects["Crate"].location.x += 0.1
    with open_frame(stage, None) as snapshot:
        assert [change.sentence for change in why_stale(snapshot, load_asset(path))] == [UNKNOWN]
    assert bake(tmp_path, ["environment"]) == ["environment-Left", "environment-Right"]


def test_of_very_many_things_the_hash_alone_is_kept(stage, tmp_path, monkeypatch):
    monkeypatch.setattr("reflect_addon.scene.freshness.MOST_KEPT", 3)
    bake(tmp_path, ["environment"])
    asset = load_asset(tmp_path / "environment-Left")
    assert asset.items == asset.balls == {} and asset.inputs_hash
    D.objects["Crate"].location.x += 0.1
    assert bake(tmp_path, ["environment"]) == ["environment-Left", "environment-Right"]


def test_analyse_says_what_is_old_why_and_what_it_takes(stage, tmp_path, monkeypatch):
    monkeypatch.setattr(analyse, "assets_of", lambda scene: tmp_path)
    kinds = ("environment", "box_proxy", "virtual_objects")
    bake(tmp_path, kinds)
    path = tmp_path / "environment-Right"
    save_asset(replace(load_asset(path), bake_seconds=7.0), path)

    def found():
        bpy.context.view_layer.update()
        made = analyse.analyse_scene(stage)
        return {m["name"]: m for m in made["methods"]}, analyse.as_text(made)

    methods, text = found()
    assert {methods[kind]["state"] for kind in kinds} == {"fresh"} and not methods["environment"]["stale"] and "is old" not in text
    D.objects["Crate"].location = (1.3, 0.9, 0.25)
    methods, text = found()
    assert {kind: methods[kind]["state"] for kind in kinds} == dict.fromkeys(kinds, "stale"), "proxies by the places, virtual objects by their distance maps"
    first, second = methods["environment"]["stale"]
    assert (first["reflector"], first["reasons"], first["seconds"]) == ("Right", ("Crate was moved",), 7.0) and first["error"] > second["error"] > 0
    assert "Right is old: Crate was moved. About 7 s to bake; " in text and text.index("Right is old") < text.index("Left is old")
    bake(tmp_path, kinds)
    D.lights["Lamp"].energy = 50
    methods, _ = found()
    assert [one["reasons"] for one in methods["environment"]["stale"]] == [("Lamp was changed",)] * 2
    assert methods["box_proxy"]["state"] == "stale", "what it shows is the environment"
    bake(tmp_path, ("environment",))
    assert found()[0]["box_proxy"]["state"] == "fresh", "its box is where it was"


def test_a_bake_that_is_cut_off_leaves_old_what_it_had_not_made(stage, tmp_path, monkeypatch):
    bake(tmp_path, ["environment", "box_proxy"])
    D.objects["Crate"].location.x += 0.1
    saved, calls = baking.save_asset, []

    def full_disk(asset, path):
        calls.append(path.name)
        if len(calls) > 1:
            raise OSError("full")
        return saved(asset, path)

    monkeypatch.setattr(baking, "save_asset", full_disk)
    with pytest.raises(OSError, match="full"):
        bake(tmp_path, ["environment", "box_proxy"])
    monkeypatch.setattr(baking, "save_asset", saved)
    assert bake(tmp_path, ["environment", "box_proxy"]) == ["box_proxy-Left", "box_proxy-Right", "environment-Right"]


def test_reading_paint_takes_all_kinds_of_values(stage):
    from reflect_addon.scene.paint import paint_digest

    mesh = D.meshes.new("Kinds")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    kinds = {item.identifier for item in bpy.types.AttributeGroupMesh.bl_rna.functions["new"].parameters["type"].enum_items}
    seen = {paint_digest(mesh)}
    for kind in sorted(kinds):
        try:
            mesh.attributes.new(f"of {kind}", kind, "POINT")
        except RuntimeError:
            continue  # Blender has it for other things than meshes
        seen.add(paint_digest(mesh))
    assert len(seen) > 8
    values = np.linspace(0, 1, 3, dtype=np.float32)
    mesh.attributes["of FLOAT"].data.foreach_set("value", values)
    assert paint_digest(mesh) not in seen
