"""Settings that decide only what is drawn: they make no asset old, and an asset is drawn with those that are asked for now."""

from dataclasses import fields, replace

import numpy as np

from reflect_addon.core.asset import Asset
from reflect_addon.core.drawn_settings import baked_settings, drawn_with, is_drawn
from reflect_addon.core.methods import recursive, virtual_objects
from reflect_addon.core.reflection_tree import BACK_FACES_ONLY, NOTHING_CULLED, Culling


def test_a_bake_depends_on_the_others():
    left = baked_settings(recursive.NAME, {**recursive.DEFAULTS, "live": True})
    assert left.keys() == {"resolution", "samples", "sky_error"}
    assert is_drawn("recursive", "depth") and not is_drawn("light_field", "depth") and not is_drawn("of another version", "depth")


def test_an_asset_is_drawn_as_is_asked_now():
    image = np.zeros((1, 1, 4), np.float16)
    asset = Asset(virtual_objects.NAME, "Ball", {"a_tx": image}, options={"finish": True, "sees_itself": False}, settings=dict(virtual_objects.DEFAULTS))
    other = drawn_with(asset, {"finish": False, "map_texels": 32, "samples": 3})
    assert other.settings == {**asset.settings, "finish": False} and other.options == {"finish": False, "sees_itself": False}
    assert other.images is asset.images, "nothing is uploaded again"
    assert drawn_with(asset, virtual_objects.DEFAULTS) is asset
    old = replace(asset, kind=recursive.NAME, settings={"depth": 2})
    assert drawn_with(old, recursive.DEFAULTS).settings["cull_size"], "an earlier version's knows of no culling"


def test_each_culling_is_a_setting():
    assert recursive.CULLING.keys() == {f.name for f in fields(Culling)}
    for culling in (Culling(), NOTHING_CULLED, BACK_FACES_ONLY):
        assert recursive.culling_of({**recursive.DEFAULTS, **recursive.culling_settings(culling)}) == culling
    assert recursive.culling_of(recursive.DEFAULTS) == Culling()
