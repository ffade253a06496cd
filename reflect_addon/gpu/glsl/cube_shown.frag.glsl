// A cube face's picture as answers to its camera's own rays, with depth as in shown_in_mirror.frag.glsl, so that lamps can be added.
// What a planar mirror shows is where its image is, behind the mirror: there, answers were drawn (seen_depth_tx), beyond_tx m from it.
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec3 origin = view.eye.xyz;
  vec3 hit_position = texelFetch(place_tx, pixel, 0).xyz;
  if (texelFetch(seen_depth_tx, pixel, 0).r < 1.0) {
    hit_position += normalize(hit_position - origin) * texelFetch(beyond_tx, pixel, 0).r;
  }
  float far = distance(origin, hit_position) * sizes_per_metre;
  gl_FragDepth = 0.5 * far / (1.0 + far);
  vec3 hit_radiance = texelFetch(picture_tx, pixel, 0).rgb;
  float hit_coverage = 1.0;
#include "store_answer"
}
