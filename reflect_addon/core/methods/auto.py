"""`auto`: each reflector gets the cheapest stand-in that is good enough (core/planning/).

Problem. Which method a reflector needs depends on what it reflects, and what is too much costs time and memory.
Idea. Candidates are tried on the rays that are seen, before anything is baked. It is no method by itself: its settings are a goal, and what it bakes are
other methods' assets, of whichever its plan has for a reflector.
Limits. Judged by where things are seen: what light adds (noise, highlights, second reflections) is not. Of the methods that draw, planar mirrors' views are among its candidates.
"""

from ..settings import Setting

NAME = "auto"
LABEL = "Auto"
REQUIRES = ()
SETTINGS = {
    "tolerance": Setting(
        "Tolerance", "Degrees that what is reflected may be off, for 95 % of each reflector's rays, seen from the reflector. 0: as good as it gets, "
        "at no more cost than the best single method", high=90.0, soft_high=10.0,
    ),
    "pixels": Setting(
        "Tolerance in Pixels", "The same in pixels of the scene's picture, in place of degrees. Needs a camera. 0: degrees", soft_high=20.0, advanced=True,
    ),
    "cost": Setting("Cost", "Most that a reflected ray may cost, in look-ups of an environment map, as a mean over what is seen. 0: any", soft_high=100.0),
    "megabytes": Setting("Memory", "Most megabytes on the GPU, all assets together. 0: any", soft_high=4000.0),
    "mirrored_views": Setting(
        "Mirrored Views", "Planar mirrors may be drawn by a view of their own in each frame, as exact as the picture. Materials and EEVEE's own frames have "
        "none and show a distance map there: switch it off for them", advanced=True,
    ),
    "bake_seconds": Setting("Bake Time", "Most seconds of baking, all reflectors together, as they are estimated. 0: any", soft_high=3600.0),
}  # fmt: skip
DEFAULTS = {"tolerance": 1.0, "pixels": 0.0, "cost": 0.0, "megabytes": 0.0, "bake_seconds": 0.0, "mirrored_views": True, "live": False}
# Word -> (tooltip, settings); the others are as in DEFAULTS.
PRESETS = {
    "DRAFT": ("For looking about: 95 % of each reflector's rays within 5 degrees", {"tolerance": 5.0}),
    "BALANCED": ("For working: 95 % of each reflector's rays within 1 degree", {"tolerance": 1.0}),
    "BEST": ("As good as it gets, at no more cost than the best single method", {"tolerance": 0.0}),
}
