"""contact: Suzanne, matt, touches and cuts into a mirror Suzanne.

Claim: where surfaces meet there is no distance left to hide behind: a stand-in that assumes a far world, or one that
stands off the surface, shows its error at the seam, while rays that leave the seam have hit distances down to zero.
"""

import math

import bpy

from sample_blends import scene_parts as parts


def suzanne(name, surface, **place):
    """Blender's monkey under two levels of subdivision, smooth."""
    bpy.ops.mesh.primitive_monkey_add()
    made = bpy.context.object
    made.name = made.data.name = name
    made.data.polygons.foreach_set("use_smooth", [True] * len(made.data.polygons))
    made.data.materials.append(surface)
    modifier = made.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = 2
    made.location, made.rotation_euler, made.scale = place["location"], place["rotation"], place["scale"]
    return made


def build():
    scene = parts.start("contact")
    parts.set_world(scene, (0.35, 0.45, 0.6), 0.6)
    parts.box("Ground", (8, 8, 0.1), (0, 0, -0.05), parts.checker("Ground", (0.7, 0.66, 0.6), (0.35, 0.3, 0.28), 0.5))
    suzanne(
        "Suzanne mirror",
        parts.mirror(),
        location=(-0.55, 0.25, 0.93),
        rotation=(math.radians(-8), 0, math.radians(22)),
        scale=(1, 1, 1),
    )
    suzanne(
        "Suzanne matt",
        parts.material("Terracotta", (0.75, 0.26, 0.12)),
        location=(0.5, -0.36, 0.66),
        rotation=(math.radians(-20), 0, math.radians(-28)),
        scale=(0.62, 0.62, 0.62),
    )
    parts.sphere("Ball touching", 0.25, parts.material("Green", (0.15, 0.5, 0.2)), 48, location=(-1.45, -0.55, 0.25))
    parts.box("Wall", (8, 0.1, 3), (0, 3.0, 1.5), parts.checker("Wall", (0.3, 0.42, 0.5), (0.5, 0.6, 0.62), 0.75))
    parts.lamp("Key", (2.5, -3.0, 4.0), (0, 0, 0.6), 190, 1.5, (1.0, 0.93, 0.82))
    parts.lamp("Fill", (-3.5, -2.0, 2.5), (0, 0, 0.6), 90, 2.0, (0.8, 0.9, 1.0))
    parts.camera((0.2, -4.6, 1.9), (-0.05, 0.0, 0.75), lens=40)


if __name__ == "__main__":
    build()
    parts.save(parts.HERE / "contact.blend")
