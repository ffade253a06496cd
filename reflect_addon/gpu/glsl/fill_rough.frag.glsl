// The reflection buffer of reflectors of which some are rough: the mean of several rays over the surface's lobe.
// `answer` is the emitted kernel; `rays_of_lobe` and `ray_of_lobe` are core/lobe_rays.py; lobe_turns is its spiral.
// reflectors: x = first, y = last index of the ray map that this pass answers; most_rays: most rays of a pixel.
#include "kernel"
#include "lobe"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 origin = texelFetch(origin_tx, pixel, 0);
  if (origin.w < reflectors.x - 0.5 || origin.w > reflectors.y + 0.5) {
    discard;
    return;
  }
  vec4 mirrored = texelFetch(direction_tx, pixel, 0);
  vec4 normal = texelFetch(normal_tx, pixel, 0);
  float width = normal.w;
  float added = texelFetch(materials_tx, ivec2(2, int(texelFetch(material_tx, pixel, 0).r + 0.5)), 0).y;
  float rays;
  rays_of_lobe(added, most_rays, rays);
  float spread = sqrt(max(mirrored.w * mirrored.w - added * added, 0.0) + added * added / rays);
  // Every pixel turns the spiral by its own angle, so that outlines are dithered and not drawn several times
  // [Jimenez 2014, interleaved gradient noise].
  float angle = 6.2831853 * fract(52.9829189 * fract(dot(vec2(pixel), vec2(0.06711056, 0.00583715))));
  vec2 own = vec2(cos(angle), sin(angle));
  vec4 radiance = vec4(0.0), beside = vec4(0.0);
  float total = 0.0;
  for (int i = 0; i < int(rays + 0.5); i++) {
    vec3 ray_direction = mirrored.xyz;
    float weight = 1.0;
    if (rays > 1.5) {
      vec2 turn = lobe_turns[i];
      turn = vec2(turn.x * own.x - turn.y * own.y, turn.x * own.y + turn.y * own.x);
      float share = (float(i) + 0.5) / rays;
#include "lobe_call"
    }
    if (weight > 0.0) {
#include "call"
      radiance += weight * vec4(clamp(hit_radiance, -65504.0, 65504.0) * hit_coverage, hit_coverage);
#include "add_beside"
      total += weight;
    }
  }
  total = max(total, 1e-6);
  radiance_out = vec4(radiance.rgb / max(radiance.a, 1e-6), radiance.a / total);
#include "store_beside"
}
