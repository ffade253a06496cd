"""The extension as Blender sees it: the code is in reflect_addon/, beside its manifest."""

if __package__:  # empty when a test runner meets this file in a checkout; Blender always gives a package name
    from .reflect_addon import register, unregister

    __all__ = ["register", "unregister"]
