// What is seen through a solid convex body: the ray of the eye bent in and out (core/glass_optics.py), and answered by `answer`, the emitted
// kernel of the body's asset.
// reflectors: x = first, y = last index of the ray map; center, shape: of the body's map.
#include "kernel"
#include "body"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 origin = texelFetch(origin_tx, pixel, 0);
  vec4 direction = texelFetch(direction_tx, pixel, 0);
  vec4 normal = texelFetch(normal_tx, pixel, 0);
  if (origin.w < reflectors.x - 0.5 || origin.w > reflectors.y + 0.5) {
    discard;
    return;
  }
  vec3 view = direction.xyz - 2.0 * dot(direction.xyz, normal.xyz) * normal.xyz;
  int row = int(texelFetch(material_tx, pixel, 0).r + 0.5);
  vec4 base = texelFetch(materials_tx, ivec2(0, row), 0);
  vec4 surface = texelFetch(materials_tx, ivec2(1, row), 0);
#include "body_call"
  // Neighbours whose rays leave by another face are no measure of this one's footprint: it grows no faster than the mirrored ray's.
  vec3 dx = dFdx(way_direction), dy = dFdy(way_direction);
  float spread = sqrt(0.5 * (dot(dx, dx) + dot(dy, dy)));
  spread = (spread < direction.w) ? spread : direction.w;
  if (way_found < 0.5) {
    discard;
    return;
  }
#include "call"
  through_out = vec4(clamp(way_through * hit_radiance * hit_coverage, 0.0, 65504.0), 1.0);
}
