"""Every file of shared/models/broken, as the mirror itself and beside a mirror ball, through every verb and method."""

import json

import bpy
import numpy as np
import pytest
from bad_input import BAKE, FRAME, TINY, TINY_ALL, VERBS, ball, empty_stage, mirror, reflect, save, stage  # noqa: F401

from reflect_addon.core import methods as registry
from reflect_addon.core.asset_files import load_asset
from reflect_addon.evaluation.rows import read_rows

# File -> words of the warning that names its object; None where all of it can be shown, though it looks odd.
BROKEN = {
    "bad-normals.glb": None,
    "edges-only.obj": "edges-only is left out: it has no faces",
    "empty.stl": "empty is left out: it has no faces",
    "extent-7e38.obj": "extent-7e38 is left out",
    "far-from-origin.obj": None,
    "infinities.glb": "nodes_1 is left out",
    "loose-geometry.blend": None,
    "nan.obj": None,  # the importer reads 0 for what is no number
    "negative-scale.blend": None,
    "no-faces.obj": "no-faces is left out: it has no faces",
    "non-manifold.obj": None,
    "self-intersecting.obj": None,
    "strongly-non-manifold.ply": None,
    "zero-size-utf16.obj": "Object is left out: its faces have no area",
}
IMPORTERS = {
    ".obj": bpy.ops.wm.obj_import,
    ".stl": bpy.ops.wm.stl_import,
    ".ply": bpy.ops.wm.ply_import,
    ".glb": bpy.ops.import_scene.gltf,
    ".blend": bpy.ops.wm.open_mainfile,
}


def open_model(shared, name):
    """The model alone on a stage, whatever state its file was saved in. Returns its objects with meshes."""
    path = shared / "models" / "broken" / name
    bpy.ops.wm.read_factory_settings(use_empty=True)
    IMPORTERS[path.suffix](filepath=str(path))
    stage()
    bpy.context.scene.camera.data.clip_end = 1e5
    return [o for o in bpy.data.objects if o.type == "MESH"]


def test_no_broken_model_is_forgotten(shared):
    assert {p.name for p in (shared / "models" / "broken").iterdir()} == set(BROKEN)


@pytest.mark.parametrize("name", BROKEN)
def test_beside_a_mirror_ball(reflect, shared, tmp_path, name):
    open_model(shared, name)
    ball("Mirror Ball", (0, -1.5, 1.2), 0.6)
    blend = save(tmp_path / "beside.blend")
    before = blend.read_bytes()
    check_verbs(reflect, blend, tmp_path, BROKEN[name], at_least=20)
    assert blend.read_bytes() == before


@pytest.mark.parametrize("name", BROKEN)
def test_as_the_mirror_itself(reflect, shared, tmp_path, name):
    objects = open_model(shared, name)
    for obj in objects[:1] if len(objects) > 1 else objects:  # one of many: the rest is seen in it
        obj.data.materials.clear()
        obj.data.materials.append(mirror())
    blend = save(tmp_path / "itself.blend")
    if BROKEN[name] is None:
        return check_verbs(reflect, blend, tmp_path, BROKEN[name], at_least=0)
    for verb in ("bake", "render", "evaluate", "evaluate numpy"):
        says = ("has no reflector", BROKEN[name], "mark it as a reflector")
        reflect.refuses(verb, blend, *VERBS[verb](tmp_path / "out"), says=says, keeps=[tmp_path])


def check_verbs(reflect, blend, tmp_path, warning, at_least):
    """All verbs work, say the warning, and give finite numbers."""
    found = json.loads(reflect.works("analyse", blend, "--json").out)
    assert len(found["reflectors"]) == 1 and np.isfinite(found["diagonal_m"])
    assert any(warning in w for w in found["warnings"]) if warning else not found["warnings"]
    baked = reflect.works("bake", blend, *BAKE)
    assert warning is None or warning in baked.err
    for path in baked.out.splitlines():
        for image in load_asset(path).images.values():
            assert np.isfinite(image).all(), path
    picture = tmp_path / "picture.exr"
    reflect.works("render", blend, "--out", picture, "--method", "billboards", "--assets", tmp_path / "reflect" / "Scene", *FRAME)
    assert np.isfinite(pixels(picture)).all()
    for backend in ("numpy", "gpu"):
        out = tmp_path / backend
        said = reflect.works("evaluate", blend, "--out", out, "--methods", "all", *FRAME, *TINY_ALL, "--backend", backend)
        assert warning is None or warning in said.err
        rows = read_rows(out)
        assert len(rows) == len(registry.names()) and all(r.nonfinite == 0 and r.pixels >= at_least for r in rows)
        assert all(r.rmse is not None and np.isfinite(r.rmse) for r in rows if r.pixels)


def pixels(path):
    image = bpy.data.images.load(str(path))
    out = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(out)
    bpy.data.images.remove(image)
    return out


@pytest.mark.parametrize("name", [n for n in BROKEN if BROKEN[n] and "left out" in BROKEN[n]])
def test_what_is_left_out_changes_no_picture(reflect, shared, tmp_path, name):
    """The picture beside it is the picture without it."""
    made = []
    for way in ("with", "without"):
        open_model(shared, name) if way == "with" else empty_stage()
        bpy.context.scene.camera.data.clip_end = 1e5
        ball("Mirror Ball", (0, 0, 1.2))
        ball("Neighbour", (1.5, -1.5, 0.5), 0.4).data.materials.clear()
        blend = save(tmp_path / f"{way}.blend")
        made.append(tmp_path / way / "picture.exr")
        reflect.works("render", blend, "--out", made[-1], "--method", "billboards", *FRAME, *TINY)
    a, b = map(pixels, made)
    assert np.isfinite(a).all() and a.max() > 0.1
    np.testing.assert_allclose(a, b, rtol=1e-5, atol=1e-5)
