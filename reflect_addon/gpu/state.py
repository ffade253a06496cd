"""Leave the GPU's state as it was found."""

from contextlib import contextmanager

from .device import ensure


@contextmanager
def scissored(gpu, window: tuple[int, int, int, int] | None):
    """Draws only within window (x, y, width, height) px of the framebuffer that is bound; everywhere where that is None."""
    try:
        if window is not None:
            gpu.state.scissor_set(*window)
            gpu.state.scissor_test_set(True)
        yield
    finally:
        if window is not None:
            gpu.state.scissor_test_set(False)


@contextmanager
def drawing_state():
    """Restores what Blender lets us read (blend, depth test and mask, viewport, framebuffer) and puts what it does not
    (culling, colour mask) back to Blender's defaults; also when the body raises. Unbinds our shader."""
    gpu = ensure()
    state = gpu.state
    blend, depth_test, depth_mask = state.blend_get(), state.depth_test_get(), state.depth_mask_get()
    line_width = state.line_width_get()
    framebuffer = state.active_framebuffer_get()
    viewport = framebuffer.viewport_get() if framebuffer is not None else None
    try:
        yield gpu
    finally:
        gpu.shader.unbind()
        if framebuffer is not None:
            framebuffer.bind()
            framebuffer.viewport_set(*viewport)
        state.blend_set(blend)
        state.depth_test_set(depth_test)
        state.depth_mask_set(depth_mask)
        state.line_width_set(line_width)
        state.face_culling_set("NONE")
        state.color_mask_set(True, True, True, True)
