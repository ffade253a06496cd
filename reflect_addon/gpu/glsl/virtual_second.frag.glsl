// What a mirror adds that a reflector shows, where virtual.frag.glsl has left its hit.
// reflectors: x = first, y = last index of the ray map that this pass answers.
#include "kernel"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 origin = texelFetch(origin_tx, pixel, 0);
  vec4 mirror = texelFetch(mirror_tx, pixel, 0);
  if (origin.w < reflectors.x - 0.5 || origin.w > reflectors.y + 0.5 || !(mirror.w > 0.0)) {
    discard;
    return;
  }
  vec4 direction = texelFetch(direction_tx, pixel, 0);
  int row = int(floor(mirror.w)) - 1;
  float share = 2.0 * fract(mirror.w);
  float distance_along = length(mirror.xyz);
  vec3 normal = mirror.xyz / distance_along;
  vec3 hit_position = origin.xyz + direction.xyz * distance_along;
  float width = texelFetch(normal_tx, pixel, 0).w + direction.w * distance_along;
#include "shown"
  radiance_out = vec4(clamp(shown_radiance, -65504.0, 65504.0), 0.0);
}
