// A lamp's light where a pixel's reflected ray meets it (core/virtual_lamps.py): added to what was drawn behind it, by blending; with
// ALONE where nothing was drawn, behind all that may be.
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 origin = texelFetch(origin_tx, pixel, 0);
  if (abs(origin.w - reflector.x) > 0.5) {
    discard;
    return;
  }
  vec3 direction = texelFetch(direction_tx, pixel, 0).xyz;
  int lamp = int(v_lamp + 0.5);
  vec4 center = texelFetch(lamps_buf, ivec2(0, lamp), 0);
  mat3 rows = mat3(
      texelFetch(lamps_buf, ivec2(1, lamp), 0).xyz, texelFetch(lamps_buf, ivec2(2, lamp), 0).xyz,
      texelFetch(lamps_buf, ivec2(3, lamp), 0).xyz);
  vec3 from = (origin.xyz - center.xyz) * rows, along = direction * rows;
  float distance_along = -1.0;
  if (center.w < BALL - 0.5) {
    vec2 met = from.xy - along.xy * (from.z / along.z);
    bool inside = (center.w < ELLIPSE - 0.5) ? max(abs(met.x), abs(met.y)) <= 1.0 : dot(met, met) <= 1.0;
    if (along.z < 0.0 && from.z > 0.0 && inside) {
      distance_along = -from.z / along.z;
    }
  }
  else {
    // From inside a ball does not shine.
    float a = dot(along, along), b = dot(from, along), c = dot(from, from) - 1.0;
    float square = b * b - a * c;
    if (c > 0.0 && b < 0.0 && square >= 0.0) {
      distance_along = c / (sqrt(square) - b);
    }
  }
  if (!(distance_along > 0.0)) {
    discard;
    return;
  }
  float far = distance_along * reflector.y;
#ifdef ALONE
  gl_FragDepth = BEHIND_ALL + far / (1.0 + far) * (1.0 - BEHIND_ALL) * 0.5;
  float hit_coverage = 1.0;
#else
  gl_FragDepth = 0.5 * far / (1.0 + far) * CLEAR;
  float hit_coverage = 0.0;
#endif
  vec3 hit_radiance = texelFetch(lamps_buf, ivec2(4, lamp), 0).rgb;
  vec3 hit_position = origin.xyz + direction * distance_along;
  float hit_status = STATUS_HIT;
#include "store_answer"
#if !defined(ALONE) && defined(DISTANCE)
  distance_out = 0.0;  // what lies behind keeps its own
#endif
}
