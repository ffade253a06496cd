"""Normals fine enough to mirror by: EEVEE's own are too coarse.

Problem. EEVEE keeps the normals of vertices in ten bits a component: up to a tenth of a degree off. What a mirror shows moves by twice that, a quarter of
a texel of a map with 128 texels a face. On the ball of `columns` that alone made node groups and the overlay differ by FLIP 0.017 to 0.023; without it they differ by 0.001.
Idea. Blender's own High Quality Normals (a scene's render setting, which viewports follow) keeps sixteen bits. "Use in materials" turns it on and notes
that in the scene, so that "Remove" turns it off again where it was off.
Limits. It is the scene's: another scene that shows the same objects keeps its own. An artist who turns it off sees the coarse normals.
"""

from collections.abc import Iterable

import bpy

NOTED = "reflect_native_normals"  # of a scene: the setting was off before us


def keep_fine(scene: bpy.types.Scene) -> None:
    """The scene's normals are fine from now on."""
    if not scene.render.use_high_quality_normals:
        scene.render.use_high_quality_normals = True
        scene[NOTED] = True


def put_back(scenes: Iterable[bpy.types.Scene]) -> None:
    """Where they were made fine by us, and no object shows materials of ours, the setting is as it was."""
    for scene in scenes:
        if NOTED in scene and not any(len(obj.reflect_native) for obj in scene.objects):
            scene.render.use_high_quality_normals = False
            del scene[NOTED]
