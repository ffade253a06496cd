// Provides display_linear(scene_linear): exposure, then the scene's view transform from a table (core/look.py).
// look: x = gain of the exposure, y = 1 / LINEAR, z = 1 / log2(TOP / LINEAR + 1), w = entries a side.
#include "srgb_lib.glsl"

vec3 display_linear(vec3 scene_linear)
{
  vec3 exposed = max(scene_linear * look.x, vec3(0.0));
  vec3 along = clamp(log2(exposed * look.y + 1.0) * look.z, 0.0, 1.0);
  // Entries are texel centres: the first at half a texel, the last half a texel before the end.
  vec3 encoded = texture(look_tx, (along * (look.w - 1.0) + 0.5) / look.w).rgb;
  return srgb_decoded(clamp(encoded, 0.0, 1.0));
}
