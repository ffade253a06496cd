"""Blender scene glue: depsgraph to arrays, Cycles as a ray tracer, bakes, kernels to shader nodes. Never imports gpu."""
