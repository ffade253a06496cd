"""Registering loudly and fully, twice, and leaving nothing behind; a word on everything that the user sees."""

import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

import reflect_addon
from reflect_addon.ui import map_preview

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def registered(fresh_file):
    reflect_addon.register()
    yield fresh_file
    reflect_addon.unregister()


def footprint():
    """Everything that an add-on can leave behind."""
    types = {name for name in dir(bpy.types) if "reflect" in name.lower()}
    for base in (bpy.types.Operator, bpy.types.Panel, bpy.types.PropertyGroup, bpy.types.AddonPreferences):
        types |= {f"{cls.__module__}.{cls.__name__}" for cls in base.__subclasses__() if cls.is_registered}
    properties = {
        f"{owner.__name__}.{p.identifier}"
        for owner in (bpy.types.Scene, bpy.types.Object, bpy.types.Material, bpy.types.WindowManager)
        for p in owner.bl_rna.properties
    }
    handlers = {
        f"{name}:{f.__module__}.{f.__qualname__}"
        for name in dir(bpy.app.handlers)
        if isinstance(functions := getattr(bpy.app.handlers, name), list)
        for f in functions
    }
    operators = {name for name in dir(bpy.ops.reflect)}
    return {"types": types, "properties": properties, "handlers": handlers, "operators": operators}


def test_nothing_stays_behind(fresh_file):
    before = footprint()
    for _ in range(2):
        reflect_addon.register()
        during = footprint()
        assert during["handlers"] > before["handlers"] and during["operators"] > before["operators"]
        assert {"Scene.reflect", "Object.reflect_mark"} <= during["properties"]
        reflect_addon.unregister()
        assert footprint() == before


def test_registering_twice_is_registering_once(fresh_file):
    before = footprint()
    reflect_addon.register()
    once = footprint()
    reflect_addon.register()
    assert footprint() == once
    handlers = [f for f in bpy.app.handlers.load_post if "reflect_addon" in f.__module__]
    assert len(handlers) == 1
    reflect_addon.unregister()
    reflect_addon.unregister()
    assert footprint() == before


def test_a_failure_is_raised_and_undone(fresh_file, monkeypatch):
    from reflect_addon.scene import handlers

    before = footprint()

    def fail():
        raise ValueError("no room")

    monkeypatch.setattr(handlers, "register", fail)
    with pytest.raises(ValueError, match="no room"):
        reflect_addon.register()
    assert footprint() == before


def test_an_older_blender_is_told_to_update(fresh_file, monkeypatch):
    before = footprint()
    monkeypatch.setattr(reflect_addon, "MINIMUM_BLENDER", (99, 1, 0))
    with pytest.raises(RuntimeError, match="needs Blender 99.1 or newer; this is 5.2.*Update Blender"):
        reflect_addon.register()
    assert footprint() == before


def test_registering_imports_no_gpu():
    code = (
        f"import sys; sys.path.insert(0, {str(ROOT)!r}); import bpy; before = set(sys.modules); import reflect_addon;"
        "reflect_addon.register(); new = [m for m in set(sys.modules) - before if m.split('.')[-1] == 'gpu'"
        " or '.gpu.' in m]; assert not new, new"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def test_everything_has_a_tooltip(registered):
    """Every operator, every property of ours, every item of their enums."""
    groups = [bpy.types.Scene.bl_rna.properties["reflect"].fixed_type]
    groups += [p.fixed_type for p in groups[0].properties if p.type == "POINTER" and p.identifier != "rna_type"]
    preferences = [c for c in bpy.types.AddonPreferences.__subclasses__() if "reflect_addon" in c.__module__]
    groups += [c.bl_rna for c in preferences if c.is_registered]
    operators = [getattr(bpy.ops.reflect, name).get_rna_type() for name in dir(bpy.ops.reflect)]
    assert len(operators) >= 6 and len(groups) >= 7
    for operator in operators:
        assert len(operator.description) > 15 and operator.name, operator.identifier
    own = [p for rna in groups + operators for p in rna.properties if p.identifier not in ("rna_type", "name", "bl_idname")]
    own += [bpy.types.Scene.bl_rna.properties["reflect"], bpy.types.Object.bl_rna.properties["reflect_mark"]]
    assert len(own) >= 8
    for prop in own:
        assert prop.description and prop.name, f"{prop.identifier} has no tooltip"
        if prop.type == "ENUM":
            for item in prop.enum_items:
                assert item.name and item.description, f"{prop.identifier}.{item.identifier} has no tooltip"


def test_method_tooltips_come_from_the_modules(registered):
    from reflect_addon.core import methods
    from reflect_addon.ui.settings import method_items

    items = {item[0]: item for item in method_items(None, None)}
    assert list(items) == ["OFF", methods.AUTO, *(m.NAME for m in methods.all_methods())]
    assert len({item[3] for item in items.values()}) == len(items)
    for name, label, tooltip, number in items.values():
        assert len(tooltip) > 10 and tooltip[0].isupper() and "`" not in tooltip and number >= 0, (name, label)


def test_a_chosen_method_and_its_settings_are_saved_with_the_file(registered, tmp_path):
    settings = bpy.context.scene.reflect
    settings.method = "environment"
    settings.environment.resolution, settings.depth_maps.maps, settings.billboards.ground_size = "64", 7, 2.5
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    settings = bpy.context.scene.reflect
    assert settings.method == "OFF" and settings.environment.resolution == "256"
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    settings = bpy.context.scene.reflect
    assert (settings.method, settings.settings_of("environment")["resolution"]) == ("environment", 64)
    assert settings.depth_maps.maps == 7 and settings.settings_of("billboards")["ground_size"] == 2.5


def test_every_setting_has_a_field_with_the_command_lines_default(registered):
    """All of --set's names and values, so that what the panel bakes is what the command line bakes."""
    from reflect_addon.core import methods
    from reflect_addon.core.settings import COMMON

    for method in methods.all_methods():
        bpy.context.scene.reflect.method = method.NAME
        found = bpy.context.scene.reflect.settings_of(method.NAME)
        in_window = {name: COMMON[name].in_window for name in found if name in COMMON and COMMON[name].in_window is not None}
        assert found == {**method.DEFAULTS, **in_window} and in_window in ({}, {"live": True})
        assert all(type(value) is type(method.DEFAULTS[name]) for name, value in found.items())
        methods.check_settings([method.NAME], bpy.context.scene.reflect.bake_settings())


def test_every_setting_has_words(registered):
    """A setting without words works, but people have to guess: add it to core/settings.py or to its method's SETTINGS."""
    from reflect_addon.core import methods, settings

    for method in methods.all_methods():
        for name in method.DEFAULTS:
            assert name in settings.COMMON or name in getattr(method, "SETTINGS", {}), f"{method.NAME}: {name} has no words"


def test_fields_hold_what_the_command_line_takes(registered):
    """Ends of the ranges; a side of an image is a menu of powers of two, where a dragged number would stop at none."""
    from reflect_addon.core import methods

    settings = bpy.context.scene.reflect
    sides = {"resolution": [], "texels": [], "view_texels": [], "map_texels": [], "map_side": []}
    for method in methods.all_methods():
        settings.method = method.NAME
        for name in method.DEFAULTS:
            prop = getattr(settings, method.NAME).bl_rna.properties[name]
            if prop.type == "STRING":
                setattr(getattr(settings, method.NAME), name, " A;;B, C ")
                assert settings.settings_of(method.NAME)[name] == ("A", "B, C")
                methods.check_settings([method.NAME], settings.bake_settings())
                continue
            if prop.type == "ENUM":
                sides[name] += [int(item.identifier) for item in prop.enum_items]
                ends = [int(prop.enum_items[i].identifier) for i in (0, -1)]
            else:
                ends = [] if prop.type == "BOOLEAN" else [prop.hard_min, min(prop.hard_max, 1e6 if prop.type == "FLOAT" else 999999)]
            for end in ends:
                methods.check_settings([method.NAME], {name: end})
    assert all(values and all(n & (n - 1) == 0 for n in values) for values in sides.values())
    assert max(sides["resolution"]) == 4096


def test_a_method_that_says_nothing_about_its_settings_has_fields(registered):
    """What a later method gets for free: fields with its types and defaults."""
    from types import SimpleNamespace

    from reflect_addon.ui.method_settings import group_of, values_of

    toy = SimpleNamespace(NAME="toy", LABEL="Toy", DEFAULTS={"gain": 0.7, "deep_steps": 3, "fine": True, "texels": 4})
    group = group_of(toy)
    bpy.utils.register_class(group)
    bpy.types.Scene.reflect_toy = bpy.props.PointerProperty(type=group, name="Toy", description="For this test only")
    try:
        settings = bpy.context.scene.reflect_toy
        assert values_of(settings, toy) == toy.DEFAULTS
        assert group.bl_rna.properties["deep_steps"].name == "Deep Steps"
    finally:
        del bpy.types.Scene.reflect_toy
        bpy.utils.unregister_class(group)


def test_an_icon_is_of_the_maps_that_an_asset_has_now(registered):
    """Baked again, a reflector has other maps, be they in the place in memory that the old ones left."""
    from reflect_addon.core.asset import Asset

    def asset(value):
        images = {f"reflector_{name}_buf": np.full((4, 24, 4), value, np.float32) for name in ("normal", "position")}
        return Asset("virtual_objects", "Ball", images)

    map_preview.icon_of(Asset("environment", "Ball", {}))
    assert not map_preview._icons
    for value in (0.0, 1.0, 0.5):
        map_preview.icon_of(asset(value))  # a number only where there is a window
        picture = np.array(map_preview._icons["virtual_objects Ball"].image_pixels_float)
        assert picture[0] == pytest.approx((value / 2 + 0.5) * (0.25 + 0.75 * value), abs=0.01)
