// The picture: background plus reflections, scene-linear or developed for the display.
#include "resolve_lib.glsl"
#include "background"
#include "develop"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  Resolved resolved = resolve(pixel);
  picture_out = developed(background(pixel) * (1.0 - resolved.covered) + resolved.radiance, (resolved.reflector < -0.5) ? empty_alpha : 1.0);
}
