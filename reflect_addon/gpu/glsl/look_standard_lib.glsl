// Provides display_linear(scene_linear): exposure and clipping, the Standard view on an sRGB display.
#include "srgb_lib.glsl"

vec3 display_linear(vec3 scene_linear)
{
  return clamp(scene_linear * look.x, 0.0, 1.0);
}
