// A lamp's light where a pixel's reflected ray meets it (core/virtual_lamps.py): added to what was drawn behind it, by blending; with
// ALONE where nothing was drawn, behind all that may be.
#include "lamp_lib.glsl"

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
  float distance_along = lamp_met(lamp, origin.xyz, direction);
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
