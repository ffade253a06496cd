"""core/scene_items.py, staleness.py and refresh.py: which items an asset depends on, what is said of changes, what is made again first."""

import hashlib
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from mesh_scenes import MATTE, MIRROR, snapshot

from reflect_addon.core import methods, scene_items
from reflect_addon.core.asset import Asset
from reflect_addon.core.refresh import Refresh, balls_of, error, next_one, share
from reflect_addon.core.scene_items import (
    GEOMETRY,
    INSTANCE,
    LIT,
    RADIANCE,
    digest,
    geometry,
    items_of,
    kept,
    light_alone,
    radiance,
    without,
)
from reflect_addon.core.staleness import CHANGED, UNKNOWN, changes
from reflect_addon.scene.freshness import inputs_hash, inputs_of

NAMES = ("Mirror", "Crate", "Vase")


def at(shape, *place):
    return shape.apply_translation(place)


@pytest.fixture(scope="module")
def scene():
    """A mirror ball, a crate and a vase, with items as Blender's are."""
    red = replace(MATTE, name="Red")
    crate, vase = at(trimesh.creation.box((1, 1, 1)), 3, 0, 0), at(trimesh.creation.icosphere(2, 0.5), 0, 9, 0)
    crate.metadata["material"] = red
    found = snapshot(trimesh.creation.icosphere(2, 0.5), Crate=crate, Vase=vase)
    items = {aspect: {name: sha(aspect, name) for name in NAMES} for aspect in INSTANCE}
    items |= {"material": {n: sha("material", n) for n in ("mirror", "matte", "Red")}, "lamp": {"Key": sha("lamp", "Key")}}
    items |= {"lamp_shape": {"Key": sha("lamp_shape", "Key")}, "world": {"": sha("world")}, "light": {"": sha("light")}, "strands": {}}
    return replace(found, items=items, geometry_hash=digest(items), light_hash="lit")


def sha(*words) -> str:
    return hashlib.sha256(" ".join(words).encode()).hexdigest()


def edited(scene, *edits):
    """edits: (aspect, name, new hash or None: gone)."""
    items = {aspect: dict(named) for aspect, named in scene.items.items()}
    for aspect, name, value in edits:
        items[aspect].pop(name, None)
        if value is not None:
            items[aspect][name] = sha(value)
    return replace(scene, items=items)


def said(scene, after, choice=radiance) -> set[str]:
    return {c.sentence for c in changes(kept(choice(scene)), choice(after), after)}


def test_light_depends_on_all_and_ends_of_rays_on_places_alone(scene):
    for aspect, named in scene.items.items():
        for name in named:
            after = edited(scene, (aspect, name, "other"))
            told = aspect in RADIANCE and aspect != "material"  # by content in slots
            assert (digest(radiance(scene)) != digest(radiance(after))) == told, aspect
            assert (digest(geometry(scene)) != digest(geometry(after))) == (aspect in GEOMETRY), aspect
            assert (digest(light_alone(scene)) != digest(light_alone(after))) == (aspect in LIT and aspect != "material"), aspect
    assert set(RADIANCE) | set(GEOMETRY) == set(scene.items), "no item is nobody's"


def test_a_digest_has_no_order_and_no_names_of_materials(scene):
    turned = {aspect: dict(reversed(named.items())) for aspect, named in reversed(scene.items.items())}
    assert digest(turned) == digest(scene.items) != ""
    assert digest(edited(scene, ("material", "Red", None), ("material", "Rouge", "red")).items) == digest(scene.items)
    assert digest({}) == digest({"shape": {}}) == ""


@pytest.mark.parametrize("aspect", [a for a in CHANGED if a in RADIANCE + GEOMETRY])
def test_each_change_has_its_sentence(scene, aspect):
    name = {"lamp": "Key", "lamp_shape": "Key", "world": "", "light": "", "material": "Red", "strands": "Crate"}.get(aspect, "Crate")
    before = edited(scene, ("strands", "Crate", "hair"))
    after = edited(before, (aspect, name, "other"))
    assert said(before, after, geometry if aspect in ("cover", "lamp_shape") else radiance) == {CHANGED[aspect].format(name)}


def test_things_that_come_go_and_are_renamed(scene):
    gone = edited(scene, *((aspect, "Vase", None) for aspect in INSTANCE))
    assert said(scene, gone) == said(scene, gone, geometry) == {"Vase is gone"}
    assert said(gone, scene) == {"Vase is new"}
    pot = replace(scene, items={a: {"Pot" if n == "Vase" else n: h for n, h in named.items()} for a, named in scene.items.items()})
    assert said(scene, pot) == {"Vase is now called Pot"}
    assert said(scene, edited(scene, ("lamp", "Key", None))) == {"Key is gone"}
    assert said(scene, edited(scene, ("world", "", None))) == {"the world was changed"}
    assert said(scene, edited(scene, ("strands", "Vase", "hair"))) == {"hair, points or volume of Vase were changed"}


def test_a_material_that_changed_is_told_once_and_not_by_whoever_has_it(scene):
    after = edited(scene, ("material", "Red", "other"), ("materials", "Crate", "other"), ("cover", "Crate", "other"))
    assert said(scene, after) == {"material Red was changed"}
    assert said(scene, edited(after, ("materials", "Vase", "other"))) == {"material Red was changed", "Vase has other materials"}
    assert said(scene, edited(scene, ("materials", "Crate", "other"), ("material", "Blue", "new"))) == {"Crate has other materials"}


def test_what_is_not_known_is_said_so(scene):
    assert [c.sentence for c in changes({}, radiance(scene), scene)] == [UNKNOWN] and changes({}, {}, scene)[0].is_everywhere()
    assert {c.sentence for c in changes({"aura": {"Vase": "ab"}}, radiance(scene), scene)} > {"Vase is new"}, "of another version"
    assert said(scene, scene) == {UNKNOWN}, "asked of an asset whose hash differs"


def test_a_scene_of_arrays_alone_has_items_as_far_as_it_tells(scene):
    plain = replace(scene, items={})
    moved = replace(plain, instances=(*plain.instances[:2], replace(plain.instances[2], world_from_object=np.eye(4))))
    assert said(plain, moved) == {"Vase was moved"} and said(plain, replace(plain, light_hash="dark")) == {"the world was changed"}
    assert items_of(replace(plain, light_hash="", geometry_hash="")) == {}


def test_what_methods_depend_on(scene):
    """By method: which edits make its asset of the mirror old. A mark makes a mirror of a thing for those that follow mirrors."""
    marked = replace(scene, instances=(scene.instances[0], replace(scene.instances[1], is_reflector=True, materials=(0,)), scene.instances[2]))
    dull = replace(scene, materials=(replace(MIRROR, is_reflector=False), *scene.materials[1:]))
    cases = {
        "a lamp": edited(scene, ("lamp", "Key", "other")), "a place": edited(scene, ("place", "Vase", "other")), "a hole": edited(scene, ("cover", "Vase", "other")),
        "its place": edited(scene, ("place", "Mirror", "other")), "its shape": edited(scene, ("shape", "Mirror", "other")), "a mark": marked, "a dull one": dull,
    }  # fmt: skip
    seen = {"a lamp", "a place", "its place", "its shape"}
    wanted = dict.fromkeys(("environment", "layered_distance"), seen) | dict.fromkeys(("billboards", "depth_maps"), seen | {"a mark", "a dull one"})
    wanted |= dict.fromkeys(("sphere_proxy", "box_proxy", "distance_map"), {"a place", "a hole", "its place", "its shape"})
    wanted |= {"light_field": seen - {"its place"}, "virtual_objects": {"a dull one"}, "recursive": {"a lamp"}}
    for kind in methods.names():
        before = inputs_hash(inputs_of(scene, kind, scene.instances[:1]), kind, ["Mirror"], {})
        old = {name for name, after in cases.items() if inputs_hash(inputs_of(after, kind, after.instances[:1]), kind, ["Mirror"], {}) != before}
        assert old == wanted[kind], kind


def test_a_method_that_is_drawn_depends_on_its_reflectors_shape_and_on_who_is_there(scene):
    bent = replace(scene, meshes=(replace(scene.meshes[0], positions=2 * scene.meshes[0].positions), *scene.meshes[1:]))
    for kind in ("virtual_objects", "recursive"):
        of = lambda s, kind=kind: digest(inputs_of(s, kind, s.instances[:1]))  # noqa: E731
        assert of(bent) != of(scene) != of(replace(scene, instances=scene.instances[:2]))


def test_settings_of_what_a_bake_reads_count_and_of_what_it_does_not_read_do_not(scene):
    def key(kind, required, **settings):
        beside = [Asset(required, "Mirror", {}, settings=settings), Asset("billboards", "Mirror", {}, settings=settings)]
        return digest(inputs_of(scene, kind, scene.instances[:1], beside))

    assert key("box_proxy", "environment", resolution=8) != key("box_proxy", "environment", resolution=16)
    assert key("virtual_objects", "layered_distance", resolution=8) == key("virtual_objects", "layered_distance", resolution=16)


def test_a_share_is_that_of_a_sphere(rng):
    way = rng.normal(size=(200_000, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    for distance, radius in ((3.0, 1.0), (1.1, 1.0), (50.0, 2.0)):
        met = way[:, 0] > np.sqrt(1 - (radius / distance) ** 2)
        assert share(np.zeros(3), (distance, 0, 0, radius)) == pytest.approx(met.mean(), abs=2e-3)
    assert share(np.zeros(3), (0.5, 0, 0, 1.0)) == 1.0 and share(np.zeros(3), (1.0, 0, 0, 0.0)) == 0.0


def test_what_is_near_or_large_is_worth_more(scene):
    now, eye = balls_of(scene), scene.instances[0]

    def worth(*edits, before=now):
        after = edited(scene, *edits)
        return error(changes(kept(radiance(scene)), radiance(after), after), before, now, eye, after)

    crate, vase = worth(("place", "Crate", "other")), worth(("place", "Vase", "other"))
    assert 0 < vase < crate < 0.2 and worth(("place", "Crate", "other"), ("place", "Vase", "other")) == pytest.approx(crate + vase)
    assert worth(("material", "Red", "other"), ("materials", "Crate", "other")) == pytest.approx(crate), "whoever has it"
    assert worth(("place", "Vase", "other"), before={**now, "Vase": (0, 1.0, 0, 0.5)}) > vase, "it was near before"
    for all_of_it in (("world", "", "other"), ("lamp", "Key", "other"), ("light", "", "other"), ("place", "Mirror", "other")):
        assert worth(all_of_it) == 1.0
    assert error(changes({}, {}, scene), {}, now, eye, scene) == 1.0


def test_the_worst_that_fits_is_next():
    a, b, c = (Refresh(n, ("it was moved",), s, e) for n, s, e in (("A", 9.0, 0.9), ("B", 2.0, 0.5), ("C", 1.0, 0.5)))
    assert next_one((a, b, c), "NEVER", 99, 0) is None and next_one((), "IDLE", 99, 0) is None
    assert next_one((b, c, a), "IDLE", 0, 99) is a and next_one((b, c), "IDLE", 0, 0) is c, "of equals the cheaper"
    assert next_one((a, b, c), "LIVE", 10, 0) is a and next_one((a, b, c), "LIVE", 10, 8) is c and next_one((a, b, c), "LIVE", 10, 9.5) is None


def test_sentences_are_short():
    one = Refresh("Ball", tuple(f"Thing {k} was moved" for k in range(5)), 130.0, 0.2)
    assert one.sentence() == "Ball: Thing 0 was moved; Thing 1 was moved; Thing 2 was moved and 2 more; about 2 min to bake."
    assert "about 1 s" in replace(one, seconds=0.01).sentence() and "about 42 s" in replace(one, seconds=42).sentence()


def test_without_takes_out_no_more(scene):
    items = without(radiance(scene), (scene_items.PLACE,), {"Mirror"})
    assert "Mirror" not in items["place"] and "Mirror" in items["shape"] and set(items["place"]) == {"Crate", "Vase"}
