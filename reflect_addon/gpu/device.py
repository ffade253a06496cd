"""The device: started when there is no window, described, or refused with a remedy."""

import bpy

from ..core.errors import ReflectError

_REMEDY = (
    "Reflect draws through Blender's gpu module: install a graphics driver with OpenGL 4.3 or newer "
    "(on a machine without a card: Mesa's libegl1 and libgl1-mesa-dri), or use --backend numpy."
)


def ensure():
    """Blender's `gpu` module, ready to draw. In a window it already is; in the background this starts it.

    Raises ReflectError when Blender is older than 5.2 (no gpu.init) or the driver gives no context.
    """
    import gpu

    if bpy.app.background:
        if not hasattr(gpu, "init"):
            raise ReflectError(
                f"Blender {bpy.app.version_string} cannot draw in the background.", "Use Blender 5.2 or newer."
            )
        try:
            gpu.init()
        except SystemError as error:
            raise ReflectError(f"No usable graphics device was found ({error}).", _REMEDY) from error
    return gpu


def describe() -> dict[str, str]:
    """What draws: backend, vendor, renderer and version as gpu.platform names them, and 'summary' in one line."""
    gpu = ensure()
    found = {
        "backend": gpu.platform.backend_type_get(),
        "device": gpu.platform.device_type_get(),
        "vendor": gpu.platform.vendor_get(),
        "renderer": gpu.platform.renderer_get(),
        "version": gpu.platform.version_get(),
    }
    found["summary"] = f"{found['renderer']} ({found['backend']}, {found['version']})"
    return found


def max_texture_side() -> int:
    """The longest side of a texture this device takes, texels."""
    return int(ensure().capabilities.max_texture_size_get())
