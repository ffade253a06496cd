// What a rough planar mirror shows: the mean of several rays over its lobe, each followed across the picture of the mirror's view
// (core/mirror_march.py) and answered by `answer`, the emitted kernel of the mirror's asset, where that does not show what it meets.
// A pixel that needs one ray shows the picture's own, as shown_in_mirror.frag.glsl does.
// CURVED: a curved mirror, of which nothing but its index in plane_normal.w is asked. No pixel of its view is a pixel's own, so one ray is
// followed as well; a pixel of whose rays none is met there is left as it is.
// sizes_per_metre, offset: see there; window: px of the view's picture that were drawn; rays_for: x = most rays, y = the footprint's growth over
// that which one ray may have here, z = px of the view along one of the ray map's, the middle one of which is the pixel's own.
#include "kernel"
#include "march"
#include "lobe"
#include "of_mirror_lib.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 origin = texelFetch(origin_tx, pixel, 0);
  vec4 normal = texelFetch(normal_tx, pixel, 0);
  ivec2 texel = CURVED ? ivec2(0) : int(rays_for.z) * pixel + int(rays_for.z) / 2 + ivec2(floor(offset + 0.5));
  vec4 seen = texelFetch(picture_tx, texel, 0);
  if (CURVED ? abs(origin.w - plane_normal.w) > 0.5 : !of_mirror(origin, normal.xyz) || seen.a < 0.5) {
    discard;
    return;
  }
  vec4 mirrored = texelFetch(direction_tx, pixel, 0);
  vec3 place = texelFetch(place_tx, texel, 0).xyz;
  float width = normal.w;
  float added = texelFetch(materials_tx, ivec2(2, int(texelFetch(material_tx, pixel, 0).r + 0.5)), 0).y;
  float rays;
  rays_of_lobe(added * rays_for.y, rays_for.x, rays);
  float spread = sqrt(max(mirrored.w * mirrored.w - added * added, 0.0) + added * added / rays);
  float angle = 6.2831853 * fract(52.9829189 * fract(dot(vec2(pixel), vec2(0.06711056, 0.00583715))));
  vec2 own = vec2(cos(angle), sin(angle));
  vec3 start = origin.xyz - view.eye.xyz;
  mat4 rows = transpose(view.clip_from_rel);
  vec2 half_size = 0.5 * vec2(textureSize(picture_tx, 0));
  vec3 radiance = vec3(0.0);
  float total = 0.0, nearness = 0.0, any_met = 0.0;
  bool many = rays > 1.5, followed = CURVED || many;
  for (int i = 0; i < int(rays + 0.5); i++) {
    vec3 ray_direction = mirrored.xyz;
    float weight = 1.0, met = 1.0;
    vec3 met_radiance = seen.rgb;
    float met_distance = dot(place - origin.xyz, mirrored.xyz);
    if (many) {
      vec2 turn = lobe_turns[i];
      turn = vec2(turn.x * own.x - turn.y * own.y, turn.x * own.y + turn.y * own.x);
      float share = (float(i) + 0.5) / rays;
#include "lobe_call"
    }
    if (followed && weight > 0.0) {
#include "march_call"
      met = march_found;
      met_radiance = march_radiance;
      met_distance = march_distance;
    }
    if (weight > 0.0) {
      if (met < 0.5) {
#include "call"
        met_radiance = hit_radiance * hit_coverage;
        met_distance = distance(hit_position, origin.xyz);
      }
      radiance += weight * clamp(met_radiance, -65504.0, 65504.0);
      nearness += weight / max(met_distance, 1e-20);
      total += weight;
      any_met = max(any_met, met);
    }
  }
  if (any_met < 0.5 && CURVED) {
    discard;
    return;
  }
  // Of distances the harmonic mean: the sky is infinitely far. One ray's place is the picture's own.
  total = max(total, 1e-6);
  float mean = total / max(nearness, 1e-20);
  vec3 hit_position = followed ? origin.xyz + mirrored.xyz * mean : place;
  float far = (followed ? mean : max(dot(place - origin.xyz, mirrored.xyz), 0.0)) * sizes_per_metre;
  gl_FragDepth = 0.5 * far / (1.0 + far);
  vec3 hit_radiance = radiance / total;
  float hit_coverage = 1.0;
  float hit_status = STATUS_HIT;
#include "store_answer"
}
