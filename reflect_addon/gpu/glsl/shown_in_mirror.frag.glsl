// A mirrored view's picture as the answer to the rays of its mirror: pixel (x, y) of it is what pixel (x, y) of the mirror shows, `offset`
// aside, since both may be parts of a picture.
// Depth is as for virtual objects (virtual.frag.glsl), so lamps know what is before them.
#include "of_mirror_lib.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 origin = texelFetch(origin_tx, pixel, 0);
  ivec2 texel = pixel + ivec2(floor(offset + 0.5));
  vec4 seen = texelFetch(picture_tx, texel, 0);
  if (!of_mirror(origin, texelFetch(normal_tx, pixel, 0).xyz) || seen.a < 0.5) {
    discard;
    return;
  }
  vec3 direction = texelFetch(direction_tx, pixel, 0).xyz;
  vec3 hit_position = texelFetch(place_tx, texel, 0).xyz;
  float far = max(dot(hit_position - origin.xyz, direction), 0.0) * sizes_per_metre;
  gl_FragDepth = 0.5 * far / (1.0 + far);
  vec3 hit_radiance = seen.rgb;
  float hit_coverage = 1.0;
  float hit_status = STATUS_HIT;
#include "store_answer"
}
