"""Deterministic work counters: what is gated on where milliseconds mean nothing."""

from dataclasses import asdict, dataclass


@dataclass
class Counts:
    """Work since the counter was made. Uniform values set per draw are not uploads."""

    draws: int = 0  # batches drawn
    triangles: int = 0  # of surfaces, in mirrored views and ray maps
    passes: int = 0  # full-screen passes
    uploads: int = 0  # textures and vertex buffers filled from the CPU
    upload_bytes: int = 0  # bytes of those on the GPU
    compiles: int = 0  # shaders built, not found in the session's cache
    allocations: int = 0  # render targets made
    readbacks: int = 0  # images read back to the CPU
    searches: int = 0  # of reflection points
    captures: int = 0  # stand-ins drawn again because something moved
    views: int = 0  # mirrored views of the schedule
    views_drawn: int = 0  # of these, those whose mirrors' box is seen in the picture that would show them, or that are not culled by it
    faces: int = 0  # of cube maps drawn
    views_culled: int = 0  # and not drawn (core/reflection_tree.py)
    energy_left_out: float = 0.0  # of those, share of the picture's light

    def as_dict(self) -> dict[str, int | float]:
        return asdict(self)
