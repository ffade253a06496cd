"""The device: started when there is no window, described, or refused with a remedy."""

import ctypes
import functools
import os
import subprocess
import sys

import bpy

from ..core.errors import ReflectError
from ..core.processes import temporary_folder

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
        _check_that_it_starts()
        try:
            gpu.init()
        except SystemError as error:
            raise ReflectError(f"No usable graphics device was found ({error}).", _REMEDY) from error
    return gpu


@functools.cache
def _check_that_it_starts() -> None:
    """Without a usable driver gpu.init() of 5.2 ends the whole process (a segmentation fault): where that is to be feared,
    another process tries it first. ReflectError when it does not come back well."""
    if sys.platform != "linux" or _egl_starts():
        return
    code = "import bpy, gpu; gpu.init()"
    if bpy.app.module:
        command = [sys.executable, "-c", code]
    else:
        command = [bpy.app.binary_path, "-b", "--factory-startup", "--python-exit-code", "1", "--python-expr", code]
    try:
        # A process that crashes leaves Blender's own temporary folder behind: it gets a place that goes with it.
        with temporary_folder("reflect-device-") as place:
            environment = os.environ | {"TMPDIR": str(place)}
            done = subprocess.run(command, capture_output=True, timeout=60, check=False, env=environment)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise ReflectError(f"No usable graphics device was found ({error}).", _REMEDY) from error
    if done.returncode:
        lines = [line for line in done.stderr.decode(errors="replace").splitlines() if "EGL" in line or "GPU" in line]
        why = lines[-1].strip() if lines else f"the driver ends the process with status {done.returncode}"
        raise ReflectError(f"No usable graphics device was found ({why}).", _REMEDY)


def _egl_starts() -> bool:
    """Whether Mesa's EGL gives a display without a screen, as Blender asks for in the background: 30 ms, no process."""
    surfaceless = 0x31DD
    try:
        egl = ctypes.CDLL("libEGL.so.1")
        pointer = ctypes.c_void_p
        egl.eglGetPlatformDisplay.restype = pointer
        egl.eglGetPlatformDisplay.argtypes = [ctypes.c_uint, pointer, pointer]
        egl.eglInitialize.argtypes = [pointer] * 3
        display = egl.eglGetPlatformDisplay(surfaceless, None, None)
        return bool(display and egl.eglInitialize(display, None, None))
    except (OSError, AttributeError):  # no such library, or one from before EGL 1.5
        return False


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
