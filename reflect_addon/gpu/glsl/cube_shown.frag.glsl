// A cube face's picture as answers to its camera's own rays, with depth as in shown_in_mirror.frag.glsl, so that lamps can be added.
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec3 origin = view.eye.xyz;
  vec3 hit_position = texelFetch(place_tx, pixel, 0).xyz;
  float far = distance(origin, hit_position) * sizes_per_metre;
  gl_FragDepth = 0.5 * far / (1.0 + far);
  vec3 hit_radiance = texelFetch(picture_tx, pixel, 0).rgb;
  float hit_coverage = 1.0;
#include "store_answer"
}
