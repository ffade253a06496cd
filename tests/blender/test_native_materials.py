"""Native reflections come and go: whatever a file holds, "Use in materials" adds beside it and "Remove" leaves no trace."""

from dataclasses import replace

import bpy
import pytest
from blender_dump import dump, dump_saved
from native_scene import animated, apply, ball, everything, mixed, principled, room_asset, save_assets, snapshot_of
from panel_text import drawn

import reflect_addon
from reflect_addon.core.errors import ReflectError
from reflect_addon.scene import native_materials, properties
from reflect_addon.scene.native_marks import OURS, original_of
from reflect_addon.scene.native_materials import remove_from_materials


@pytest.fixture
def file(fresh_file):
    properties.register()
    yield fresh_file
    properties.unregister()


def changed(before, after) -> list[str]:
    return sorted(key for key in before.keys() | after.keys() if before.get(key) != after.get(key))


def blocks() -> dict[str, int]:
    """Names and users of every data-block."""
    kinds = [p.identifier for p in bpy.data.bl_rna.properties if p.type == "COLLECTION"]
    return {f"{kind}/{b.name_full}": b.users for kind in kinds for b in getattr(bpy.data, kind) if hasattr(b, "users")}


def slots() -> list:
    """What every slot shows, and from where."""
    return [(o.name_full, s.link, s.material and s.material.name_full) for o in bpy.data.objects for s in o.material_slots]


def shown(name: str, index: int = 0):
    return bpy.data.objects[name].material_slots[index].material


def node_of(material, kind: str, ours: bool):
    (found,) = (n for n in material.node_tree.nodes if n.bl_idname == kind and (OURS in n) == ours)
    return found


def test_remove_leaves_no_trace(file):
    everything()
    before = dump()
    hashes = snapshot_of(file.context.scene).geometry_hash, snapshot_of(file.context.scene).light_hash
    done = apply()
    assert (done.materials, done.objects) == (5, 6) and done.nodes > 6 * 50 and not done.sentences
    assert shown("One") == shown("Twin") == shown("Many", 2) and shown("One").name == "Metal · Reflect"
    assert [original_of(s.material) and original_of(s.material).name for s in bpy.data.objects["Many"].material_slots] == [
        "Dull", None, "Metal", "Mixed"]  # fmt: skip
    assert shown("Many").name == "Dull", "what does not mirror stays"
    after = snapshot_of(file.context.scene)
    assert (after.geometry_hash, after.light_hash) == hashes, "what was baked is fresh still"
    assert remove_from_materials(file.context.scene.objects).materials == 5
    assert changed(before, dump()) == []


def test_normals_are_fine_while_in_use(file):
    """EEVEE's ten bits a component turn what a mirror shows; what the artist chose comes back, and what is on stays on."""
    scene = file.context.scene
    ball("Ball", principled("Metal", Metallic=1.0))
    for chosen in (False, True):
        scene.render.use_high_quality_normals = chosen
        before = dump()
        apply()
        apply()
        assert scene.render.use_high_quality_normals
        remove_from_materials(scene.objects)
        assert scene.render.use_high_quality_normals == chosen and changed(before, dump()) == []


def test_twice_is_once(file):
    everything()
    before = blocks(), slots()
    apply()
    once = blocks()
    apply()
    assert blocks() == once
    remove_from_materials(file.context.scene.objects)
    assert (blocks(), slots()) == before


def test_saved_and_removed_in_another_session(file, tmp_path):
    own = ball("Own", principled("Metal", Metallic=1.0), animated("Animated"))
    own.material_slots[0].link = "OBJECT"
    own.material_slots[0].material = principled("Lacquer", Coat_Weight=1.0, Coat_Roughness=0.0)
    bpy.context.scene.frame_set(1)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    before = dump_saved(tmp_path / "a.blend")
    apply()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "b.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "b.blend"), load_ui=False)
    assert shown("Own").name == "Lacquer · Reflect"
    assert all(image.packed_file for image in bpy.data.images), "pixels that only memory holds would be gone"
    remove_from_materials(bpy.context.scene.objects)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    assert changed(before, dump_saved(tmp_path / "a.blend")) == []


def test_undone_and_redone(fresh_file, tmp_path):
    reflect_addon.register()
    try:
        ball("Ball", principled("Metal", Metallic=1.0))
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
        bpy.context.scene.reflect.method = "box_proxy"
        bpy.context.view_layer.objects.active = None  # else its particle settings name the object now and then
        save_assets(bpy.context.scene)
        bpy.ops.reflect.refresh()
        bpy.ops.ed.undo_push(message="before")
        bpy.ops.ed.undo_push(message="nothing")
        bpy.ops.ed.undo()  # counts of users inside materials are others after any undo: Blender's own
        before = dump()
        assert bpy.ops.reflect.use_in_materials("EXEC_DEFAULT", True) == {"FINISHED"}
        assert shown("Ball").name == "Metal · Reflect" and "1 material of 1 object" in bpy.context.scene.reflect.native_said
        assert "1 material of 1 object" in drawn()
        bpy.ops.ed.undo()
        assert changed(before, dump()) == []
        bpy.ops.ed.redo()
        assert shown("Ball").name == "Metal · Reflect"
        assert bpy.ops.reflect.remove_from_materials("EXEC_DEFAULT", True) == {"FINISHED"}
        assert changed(before, dump()) == []
    finally:
        reflect_addon.unregister()


def test_cycles_keeps_the_artists_shader(file):
    ball("Ball", mixed("Mixed"))
    apply()
    material = shown("Ball")
    tree = material.node_tree
    cycles, eevee = tree.get_output_node("CYCLES"), tree.get_output_node("EEVEE")
    assert OURS not in cycles and OURS in eevee and eevee.target == "EEVEE"
    mix = eevee.inputs["Surface"].links[0].from_node
    assert mix.bl_idname == "ShaderNodeMixShader" and OURS in mix
    assert mix.inputs[0].links[0].from_node.bl_idname == "ShaderNodeFresnel"
    assert OURS not in mix.inputs[1].links[0].from_node, "a part that does not mirror serves both"
    assert mix.inputs[2].links[0].from_node.bl_idname == "ShaderNodeEmission"


def test_an_output_of_the_artists_for_eevee_is_led_there(file):
    material = principled("Metal", Metallic=1.0)
    tree = material.node_tree
    own = tree.nodes.new("ShaderNodeOutputMaterial")
    own.target = "EEVEE"
    tree.links.new(tree.nodes["Principled BSDF"].outputs[0], own.inputs[0])
    ball("Ball", material)
    before, seen = dump(), snapshot_of(file.context.scene).geometry_hash
    apply()
    assert OURS in shown("Ball").node_tree.get_output_node("EEVEE").inputs[0].links[0].from_node
    assert snapshot_of(file.context.scene).geometry_hash == seen
    remove_from_materials(file.context.scene.objects)
    assert changed(before, dump()) == []


def test_animation_moves_both(file):
    scene = file.context.scene
    ball("Ball", animated("Animated"))
    apply()
    material = shown("Ball")
    share = next(n for n in material.node_tree.nodes if OURS in n and n.bl_idname == "ShaderNodeGroup" and "Base_color" in n.inputs)
    answer = next(n for n in material.node_tree.nodes if OURS in n and n.bl_idname == "ShaderNodeGroup" and "Roughness" in n.inputs)
    artists = node_of(material, "ShaderNodeBsdfPrincipled", ours=False)
    for frame in (1, 4, 11):
        scene.frame_set(frame)
        assert tuple(share.inputs["Base_color"].default_value) == tuple(artists.inputs["Base Color"].default_value)[:3]
        assert answer.inputs["Roughness"].default_value == artists.inputs["Roughness"].default_value
        weights = [n.inputs["Weight"].default_value for n in material.node_tree.nodes if OURS in n and "Weight" in n.inputs]
        assert artists.inputs["Coat Weight"].default_value in weights
    own, artists = (_curves(name) for name in (material.name, "Animated"))
    assert len(bpy.data.actions) == 2 and len(artists) == 4 + 1 + 1
    assert len(own) == len(artists) + 3 + 1, "of a colour with its alpha a vector takes three"


def _curves(material: str):
    action = bpy.data.materials[material].node_tree.animation_data.action
    return [curve for bag in action.layers[0].strips[0].channelbags for curve in bag.fcurves]


def test_what_cannot_be_done_is_said_and_changes_nothing(file, tmp_path):
    metal = principled("Metal", Metallic=1.0)
    ball("Bare")
    bpy.data.objects["Bare"].reflect_mark = "YES"
    ball("Old", metal)
    ball("New", metal)
    collection = bpy.data.collections.new("Set")
    collection.objects.link(ball("Copied", metal))
    for at in (3, 5):
        instance = bpy.data.objects.new(f"At {at}", None)
        instance.instance_type, instance.instance_collection, instance.location.x = "COLLECTION", collection, at
        file.context.scene.collection.objects.link(instance)
    library = tmp_path / "library.blend"
    bpy.data.libraries.write(str(library), {ball("Linked", metal)})
    bpy.data.objects.remove(bpy.data.objects["Linked"])
    with bpy.data.libraries.load(str(library), link=True) as (_, linked):
        linked.objects = ["Linked"]
    file.context.scene.collection.objects.link(linked.objects[0])
    before, scene, one = dump(), file.context.scene, room_asset()
    names = [r.name for r in snapshot_of(scene).reflectors()]
    assets = {name: one for name in names if name not in ("New", "Copied", "Bare")}
    assets |= {"Bare": one, names[[n.startswith("Copied/") for n in names].index(True)]: replace(one)}
    assets["Copied"] = one
    with pytest.raises(ReflectError) as caught:
        apply(assets=assets, stale={"Old"})
    said = str(caught.value)
    for sentence in (
        "Bare has no material slot", "Old was baked from another state of the scene", "New has no asset of box_proxy: bake first",
        "Copied stands in the scene several times", "Linked is linked from library.blend",
    ):  # fmt: skip
        assert sentence in said, said
    with pytest.raises(ReflectError, match="draws the scene again"):
        apply(method="recursive")
    assert changed(before, dump()) == []


def test_a_library_override_keeps_its_materials(file, tmp_path):
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {ball("Ball", principled("Metal", Metallic=1.0))})
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, linked):
        linked.objects = ["Ball"]
    bpy.context.scene.collection.objects.link(linked.objects[0].override_create())
    apply()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"), load_ui=False)
    (slot,) = bpy.context.scene.objects["Ball"].material_slots
    assert slot.material.name == "Metal · Reflect" and slot.material.library is None
    remove_from_materials(bpy.context.scene.objects)
    (slot,) = bpy.context.scene.objects["Ball"].material_slots
    assert (slot.link, slot.material.library.name) == ("DATA", "library.blend") and len(bpy.data.materials) == 1


def test_a_failure_in_the_middle_leaves_the_file_as_it_was(file, monkeypatch):
    everything()
    before, calls = (blocks(), slots()), []

    def put(*arguments):
        calls.append(arguments)
        if len(calls) == 4:
            raise RuntimeError("no more")
        return real(*arguments)

    real = native_materials.put
    monkeypatch.setattr(native_materials, "put", put)
    with pytest.raises(RuntimeError, match="no more"):
        apply()
    assert (blocks(), slots()) == before
    monkeypatch.setattr(native_materials, "put", real)
    apply()
    applied, calls = (blocks(), slots()), []
    monkeypatch.setattr(native_materials, "put", put)
    with pytest.raises(RuntimeError, match="no more"):
        apply()
    assert (blocks(), slots()) == applied, "those of an earlier bake stay, by their names"


def test_a_material_given_since_stays(file):
    ball("Ball", principled("Metal", Metallic=1.0))
    apply()
    bpy.data.objects["Ball"].material_slots[0].material = principled("Other")
    done = remove_from_materials(file.context.scene.objects)
    assert shown("Ball").name == "Other" and "was given another material" in done.sentences[0]
    assert not [m for m in bpy.data.materials if "Reflect" in m.name]
