"""The methods, one module each. A method is its name, a bake and a kernel; registering it is one line below.

A method module has
    NAME: str                    the word on the command line
    LABEL: str                   the words in the panel
    REQUIRES: tuple[str, ...]    kinds of assets it reads beside its own, baked first
    DEFAULTS: dict               its settings and their defaults
    bake(scene, reflector, trace, settings) -> Asset
                                 scene: SceneSnapshot; reflector: Instance; trace: the callable of scene/raytrace.py
    trace(k, asset, ray) -> Hit  the kernel (docs/decisions.md, "Kernel language")
"""
