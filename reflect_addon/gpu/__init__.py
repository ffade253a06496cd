"""The only package that imports Blender's gpu module: kernels to GLSL, ray map, reflection buffer, resolve, drawing."""
