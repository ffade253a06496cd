"""gpu/viewport_views.py: what Blender draws from behind a mirror is what the mirror shows, without what is behind it; nothing of the user's is
left changed."""

from dataclasses import replace
from types import SimpleNamespace

import hand_scenes
import numpy as np
import pytest
import tolerances
from mesh_scenes import tracer
from mirror_rooms import baked, paint, two_mirrors

CAMERA = hand_scenes.camera((1.2, -1.0, 1.3), (-1.5, 0.2, 0.7), (128, 96), fov=0.9)
MOVED = hand_scenes.camera((1.23, -0.97, 1.32), (-1.5, 0.2, 0.7), (128, 96), fov=0.9)
COLORS = {"Torus": (0.9, 0.1, 0.2), "Rock": (0.1, 0.8, 0.3), "Floor": (0.3, 0.3, 0.9), "Behind": (0.0, 1.0, 1.0)}

LIFT = 1e-5  # m: rays start off their mirror


@pytest.fixture(scope="module")
def room(device):
    """The room with two mirrors at an angle, as a snapshot and as a Blender scene with one flat colour a thing, something behind a mirror
    besides; its 3D view."""
    import bpy
    from mathutils import Matrix

    found = baked(two_mirrors((0, 1.5, 1.0), (0, -1, 0)), depth=2)
    bpy.ops.wm.read_factory_settings()
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    for instance in found.scene.instances:
        mesh = bpy.data.meshes.new(instance.name)
        shape = found.scene.meshes[instance.mesh]
        mesh.from_pydata(shape.positions.tolist(), [], shape.triangles.tolist())
        thing = bpy.data.objects.new(instance.name, mesh)
        thing.matrix_world = Matrix(instance.world_from_object.tolist())
        bpy.context.scene.collection.objects.link(thing)
    bpy.ops.mesh.primitive_cube_add(size=0.6, location=(-2.0, 0, 0.9))
    bpy.context.object.name = "Behind"
    for name, color in COLORS.items():
        material = bpy.data.materials.new(name)
        material.diffuse_color = (*color, 1)
        bpy.data.objects[name].data.materials.append(material)
    bpy.context.view_layer.update()
    area = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")
    space, region = area.spaces.active, next(r for r in area.regions if r.type == "WINDOW")
    space.shading.light, space.shading.color_type, space.shading.show_object_outline = "FLAT", "MATERIAL", False
    return SimpleNamespace(found=found, space=space, view=(bpy.context.scene, bpy.context.view_layer, space, region))


@pytest.fixture
def shown(room):
    from reflect_addon.gpu.renderer import Renderer
    from reflect_addon.gpu.viewport_views import ViewportViews

    renderer = Renderer(room.found.scene, room.found.assets, surfaces=room.found.surfaces)
    renderer.mirrors.viewport = ViewportViews()
    yield SimpleNamespace(renderer=renderer, views=renderer.mirrors.viewport)
    renderer.mirrors.viewport.free()
    renderer.free()


def things_met(scene, ray_map):
    """(N,) names of what the mirrors' rays meet, "" for nothing, and of what those that meet a mirror meet then."""
    names, trace = np.array([*(instance.name for instance in scene.instances), ""]), tracer(scene, paint)
    rays, normal = ray_map.rays(), ray_map.normal[ray_map.covered()]
    first = trace(replace(rays, origin=(rays.origin + LIFT * normal).astype(np.float32)), bounces=0)
    met = np.where(first.hit, names[first.object], "")
    onward = rays.direction - 2 * (rays.direction * first.normal).sum(-1, keepdims=True) * first.normal
    second = trace(replace(rays, origin=(first.position + LIFT * first.normal).astype(np.float32), direction=onward), bounces=0)
    mirrors = np.isin(met, ("Mirror", "Other"))
    return met, np.where(mirrors & second.hit, names[second.object], "")


def right(renderer, camera, colors=COLORS):
    """Of the pixels that show a thing in a mirror, or in a mirror there, the share that has its colour."""
    answer, ray_map = renderer.answer(camera, positions=False), renderer.ray_map(camera)
    mask, same = ray_map.covered(), []
    for level, names in enumerate(things_met(renderer.scene.snapshot, ray_map)):
        for name in ("Torus", "Rock", "Floor"):
            seen = answer.radiance[mask][names == name]
            # A mirror in a mirror takes some of the light: the colour's hue is compared.
            hue, wanted = seen / np.maximum(seen.max(-1, keepdims=True), 1e-6), np.array(colors[name]) / max(colors[name])
            assert len(seen) > 50 or level, name
            same.append(np.abs(hue - wanted).max(-1) < tolerances.VIEWPORT_COLOR)
    cyan = np.abs(answer.radiance[mask] - COLORS["Behind"]).max(-1) < tolerances.VIEWPORT_COLOR
    assert not cyan.any(), "what is behind the mirror is shown"
    return np.concatenate(same).mean()


def frames(room, shown):
    """Frames until nothing is due, as a window draws them; each but the last leaves something to be shown."""
    for _ in range(20):
        shown.renderer.answer(CAMERA, positions=False)
        if not shown.views.due():
            assert shown.views.settled
            return
        shown.views.draw(*room.view)
        assert not shown.views.settled, "a frame has yet to show it"
    raise AssertionError("pictures are due again and again")


def test_mirrors_show_what_blender_draws(room, shown):
    import bpy

    views, renderer = shown.views, shown.renderer
    assert right(renderer, CAMERA) < 0.1, "before the first picture mirrors show surface radiance"
    paths = views.due()
    assert len(paths) > 2 and not views.settled
    frames(room, shown)
    assert right(renderer, CAMERA) > 1 - tolerances.VIEWPORT_EDGE
    assert views.settled and room.space.overlay.show_overlays

    # At rest nothing is drawn.
    count = views.drawn
    views.draw(*room.view)
    assert views.drawn == count == len(paths)

    # The eye moves: pictures of a moment ago are looked up by place, until there are new ones.
    assert right(renderer, MOVED) > 1 - tolerances.VIEWPORT_LATE and views.due() == paths

    # A material changes.
    material, state = bpy.data.materials["Rock"], views.state
    colors = {**COLORS, "Rock": (0.9, 0.9, 0.0)}
    material.diffuse_color = (*colors["Rock"], 1)
    bpy.context.view_layer.update()
    views.state = (*state, "changed")
    frames(room, shown)
    assert right(renderer, CAMERA, colors) > 1 - tolerances.VIEWPORT_EDGE
    material.diffuse_color = (*COLORS["Rock"], 1)


def test_a_slow_picture_waits_until_the_view_rests(room, shown):
    from reflect_addon.gpu.viewport_views import BUDGET

    views, renderer = shown.views, shown.renderer
    renderer.answer(CAMERA, positions=False)
    views.draw(*room.view)
    count, views.seconds = views.drawn, 2 * BUDGET
    renderer.answer(MOVED, positions=False)
    views.draw(*room.view)
    assert views.drawn == count and not views.settled
    renderer.answer(MOVED, positions=False)
    views.draw(*room.view)
    assert views.drawn > count


def test_nothing_of_ours_draws_inside_and_what_raises_leaves_nothing(room, shown):
    from reflect_addon.gpu import handler, viewport_views

    with pytest.raises(ZeroDivisionError), viewport_views.bare(room.space):
        assert viewport_views.is_drawing() and not room.space.overlay.show_overlays
        handler._on_draw()  # would ask for a region, which there is none of here
        raise ZeroDivisionError
    assert not viewport_views.is_drawing() and room.space.overlay.show_overlays


def test_where_there_is_no_viewport_a_sentence_says_so(room):
    from reflect_addon.scene.viewport_source import shading_of, why_not

    region_data = room.space.region_3d
    assert "window" in why_not(None, None, "CYCLES")
    room.space.shading.type = "RENDERED"
    assert "engine" in why_not(room.space, region_data, "CYCLES") and not why_not(room.space, region_data, "BLENDER_EEVEE")
    before = shading_of(room.space)
    room.space.shading.type = "SOLID"
    assert shading_of(room.space) != before and not why_not(room.space, region_data, "CYCLES")
    assert "orthographic" in why_not(room.space, SimpleNamespace(is_perspective=False), "CYCLES")
