"""The extension as Blender sees it: the code is in reflect_addon/, beside its manifest."""

from .reflect_addon import register, unregister

__all__ = ["register", "unregister"]
