"""NumPy only: conventions, data between steps, kernels, methods, metrics. Imports neither bpy nor gpu."""
