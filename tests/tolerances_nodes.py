"""Tolerances of shader nodes and native materials: tolerances.py's table went on here when it grew long. Fix causes; do not loosen these."""

# EEVEE stores AOVs as half floats and cuts rather than rounds: one part in 2^10, on top of the kernel's own tolerance.
EEVEE_HALF_RELATIVE = 2e-3
# What such a half float holds: larger numbers of random programs are infinite in it.
EEVEE_HALF_MOST = 6e4
# Random programs may magnify a rounding without bound (a floor on the brink, a difference of huge numbers); what the
# yardsticks of tests/random_kernels.py do not filter out. An emitter's mistake shows in percents.
KERNEL_BRINK_SHARE = 2e-3
# A node group's outputs in EEVEE are half floats (2^-11 of the value at worst); the kernel's own rounding and the pixel's point, which EEVEE
# interpolates and the ray map draws, are far below. Of a distance, and of a radiance near 1 in a map of 32 texels, whose slopes are steep.
NATIVE_HALF = 2e-3
NATIVE_RADIANCE = 0.02
# Of a radiance below 2 that changes by 0.9 a radian, at the 95th percentile: half floats cut by 2^-10. Measured 0.0009; with normals of ten bits
# 0.0020, with those of a GPU's subdivision 0.034.
NATIVE_NORMALS = 0.0015
# Mean radiance of a native material's middle in EEVEE against Cycles' under light of 1 from everywhere: at most 4e-4 was measured (Glossy, whose light
# is 0.9), from half-float pictures and 16 jittered samples against 32.
NATIVE_REFLECTANCE = 0.002
# One ray a sample against the mean over the lobe (core/surface_ray.py): what is lost where four draws in a row are refused.
LOBE_DRAWS = 5e-3
# A group's radiance on a ball whose reflections change by 0.9 a radian, in EEVEE's half floats and at its own float32 pixel centres.
GROUP_ON_A_BALL = 0.02
# Pixels on an edge between two triangles, whose face either renderer may take.
GROUP_EDGES = 0.02
# Mean of a rough ball's picture of 64 samples: its pixels' noise apart, EEVEE's samples lie all over a pixel and NumPy's at its centre.
ROUGH_GROUP_MEAN = 0.02
# Rows moved by a kernel against rows moved in float64 and stored: a few roundings of float32, on a ray's way of some metres, in
# the texels that are read (relative, as in same_answer).
MOVED_ROWS = 1e-3
# Share of rays that meet something else, at the edges of quads, contours and maps' rows.
MOVED_ROWS_EDGES = 0.01
# Share of a ball's pixels whose ray, a little another one in EEVEE than in NumPy, meets something else: pictures of 32 texels in a room of patterns are
# nothing but edges, where GROUP_EDGES is of a smooth one.
MOVED_GROUP_EDGES = 0.1
# One frame by two builds of Blender with a Mesa each, which need not round alike: mean difference of colours up to 1. Here they do (0 measured).
NATIVE_OTHER_BLENDER = 2e-3
# A native material's pixels against the artist's own in EEVEE, both in light of 1: 0.0056 of a pixel was measured with seven kinds of material (dull colours,
# whose few samples of light differ; mirrors alone 0.0005).
NATIVE_FURNACE = 0.01
