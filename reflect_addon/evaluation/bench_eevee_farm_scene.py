"""The file that a render farm is given: a mirror that moves and turns through a small patterned room, and its frames.

Problem. What a file of ours shows where the add-on is not must be tried where it is not: in another process.
Idea. The box room with two pillars and a flattened ball on its way through it; everything glows, so that neither Cycles nor EEVEE has
noise. `render_alone` lets a Blender that knows nothing of us render a file's animation, as `blender -b FILE -a` does; pictures come back as
the floats that it wrote.
Limits. Nothing moves but the reflector: what its stand-ins show stays as it was baked.
"""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np

from ..core.errors import ReflectError
from ..core.processes import temporary_folder
from ..scene.exr import read_exr, stacked
from ..scene.worker_command import NAME_A_WORKER
from .bench_eevee_scene import box_room
from .bench_mirrors_scene import material

FRAMES = 30
FOLDER = "frames"  # below the file's own
BODY = "Body"
WAY = (((-0.15, 0.55, 0.85), (0.0, 0.2, 0.0)), ((0.65, 0.0, 1.2), (0.6, -0.2, 2.2)))  # place (m) and turn (rad) of the first and the last frame
PILLARS = (((1.5, 1.05, 1.0), (0.3, 0.3, 2.0), (0.9, 0.9, 0.2)), ((-1.6, -0.3, 0.7), (0.25, 0.5, 1.4), (0.1, 0.7, 0.9)))  # place, size, colour

# What a farm's Blender does, for a Python with bpy. It says so itself when something of ours is there.
ALONE = """
import sys, bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
bpy.ops.render.render(animation=True)
ours = [name for name in sys.modules if "reflect" in name] + [name for name in dir(bpy.types.Object) if "reflect" in name]
assert not ours, ours
"""


def moving_body(size: tuple[int, int] = (64, 48), samples: int = 8) -> bpy.types.Scene:
    """A new file, at its first frame; it renders FRAMES frames of floats into FOLDER beside itself."""
    scene = box_room()
    bpy.data.objects.remove(bpy.data.objects["Mirror ball"])
    for number, (place, sides, colour) in enumerate(PILLARS):
        bpy.ops.mesh.primitive_cube_add(size=1, location=place)
        bpy.context.object.name, bpy.context.object.scale = f"Pillar {number}", sides
        glowing = material(f"Pillar {number}", glow=colour)
        shader = glowing.node_tree.nodes["Principled BSDF"]
        shader.inputs["Base Color"].default_value, shader.inputs["Specular IOR Level"].default_value = (0, 0, 0, 1), 0.0
        bpy.context.object.data.materials.append(glowing)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=0.5)
    bpy.ops.object.shade_smooth()
    body = bpy.context.object
    body.name, body.scale = BODY, (1.0, 0.7, 0.85)
    body.data.materials.append(bpy.data.materials["Mirror"])
    for frame, (place, turn) in zip((1, FRAMES), WAY, strict=True):
        body.location, body.rotation_euler = place, turn
        body.keyframe_insert("location", frame=frame)
        body.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_start, scene.frame_end = 1, FRAMES
    scene.frame_set(1)
    _output(scene, size, samples)
    return scene


def _output(scene: bpy.types.Scene, size: tuple[int, int], samples: int) -> None:
    render = scene.render
    render.engine = "BLENDER_EEVEE"
    render.resolution_x, render.resolution_y, render.resolution_percentage = *size, 100
    render.filepath = f"//{FOLDER}/"
    scene.eevee.taa_render_samples, scene.eevee.use_raytracing = samples, False
    scene.eevee.use_shadows = False  # what glows casts none, and looking for them is half of so small a frame
    scene.cycles.samples, scene.cycles.use_denoising = 4 * samples, False
    settings = render.image_settings
    settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "ZIP"
    settings.use_exr_interleave = True


def render_alone(blend: Path) -> list[np.ndarray]:
    """The animation's frames, (H, W, 3) linear, rendered by a Blender without the add-on, its profile empty."""
    with temporary_folder("reflect-farm-") as profile:
        if bpy.app.module:
            command = [sys.executable, "-I", "-c", ALONE, str(blend)]
        else:
            command = [bpy.app.binary_path, "--factory-startup", "-b", str(blend), "-a"]
        environment = {k: v for k, v in os.environ.items() if not k.startswith(("BLENDER", "PYTHON"))} | {"BLENDER_USER_RESOURCES": str(profile)}
        done = subprocess.run(command, cwd=profile, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ReflectError(f"A Blender without the add-on could not render {blend}: {(done.stderr or done.stdout)[-2000:]}", NAME_A_WORKER)
    return [picture_in(path) for path in sorted((blend.parent / FOLDER).iterdir())]


def picture_in(path: Path) -> np.ndarray:
    return stacked(read_exr(path), "Combined", "RGB")


def still(frame: int, engine: str, path: Path) -> np.ndarray:
    """A frame of the open file, rendered here into the path."""
    scene = bpy.context.scene
    before = scene.render.engine, scene.render.filepath
    scene.frame_set(frame)
    scene.render.engine, scene.render.filepath = engine, str(path)
    bpy.ops.render.render(write_still=True)
    scene.render.engine, scene.render.filepath = before
    return picture_in(path)


def what_is_wrong(frames: Sequence[np.ndarray], count: int = FRAMES) -> list[str]:
    """Sentences on an animation that is not one of a moving reflector."""
    said = [] if len(frames) == count else [f"{len(frames)} of {count} frames were written"]
    said += [f"frame {k} is black" for k, one in enumerate(frames, 1) if not one.max() > 0.05]
    return said + [f"frame {k} is the one before" for k, (one, last) in enumerate(zip(frames[1:], frames), 2) if np.array_equal(one, last)]
