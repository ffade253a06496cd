// The reflection buffer of a picture's pixels: the mean of the rays that a pixel sends, along the line that the surface stretches it (core/pixel_rays.py)
// or over a rough surface's lobe (core/lobe_rays.py). One ray is the most common.
// `answer` is the emitted kernel; lobe_turns is the lobe's spiral.
// reflectors: x = first, y = last index of the ray map that this pass answers; bounds: x, y of its first and beyond its last pixel, outside of which
// the ray map may hold another picture's rays; most_rays: most rays of a pixel, x = of a lobe, y = along a line.
#include "kernel"
#include "lobe"
#include "pixel"

// From a pixel to the next one on the same reflector, each way along an axis: the smaller change of direction, since the greater one may lead
// across an edge; what the origin changes by along with it. 0: there is none.
void to_next(ivec2 pixel, ivec2 axis, vec4 origin, vec3 mirrored, out vec3 turned, out vec3 moved)
{
  turned = moved = vec3(0.0);
  float least = 1e30;
  for (int side = -1; side <= 1; side += 2) {
    ivec2 at = pixel + side * axis;
    if (all(greaterThanEqual(vec2(at), bounds.xy)) && all(lessThan(vec2(at), bounds.zw))) {
      vec4 next = texelFetch(origin_tx, at, 0);
      vec3 change = texelFetch(direction_tx, at, 0).xyz - mirrored;
      float amount = dot(change, change);
      if (abs(next.w - origin.w) < 0.5 && amount < least) {
        least = amount;
        turned = float(side) * change;
        moved = float(side) * (next.xyz - origin.xyz);
      }
    }
  }
}

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
  float added = texelFetch(materials_tx, ivec2(2, int(texelFetch(material_tx, pixel, 0).r + 0.5)), 0).y;
  float own_spread = sqrt(max(mirrored.w * mirrored.w - added * added, 0.0));
  vec3 turned_x = vec3(0.0), turned_y = vec3(0.0), moved_x = vec3(0.0), moved_y = vec3(0.0);
  if (own_spread > PIXEL_FINE) {
    to_next(pixel, ivec2(1, 0), origin, mirrored.xyz, turned_x, moved_x);
    to_next(pixel, ivec2(0, 1), origin, mirrored.xyz, turned_y, moved_y);
  }
#include "pixel_call"
  vec3 turned = pixel_line.x * turned_x + pixel_line.y * turned_y;
  vec3 moved = pixel_line.x * moved_x + pixel_line.y * moved_y;
  float lobes;
  rays_of_lobe(added, most_rays.x, lobes);
  bool of_lobe = lobes > 1.5;
  float rays = max(lobes, pixel_rays);
  float width = pixel_width;
  float spread = sqrt(pixel_spread * pixel_spread + added * added / (of_lobe ? rays : 1.0));
  // Every pixel turns the spiral by its own angle, so that outlines are dithered and not drawn several times
  // [Jimenez 2014, interleaved gradient noise].
  float angle = 6.2831853 * fract(52.9829189 * fract(dot(vec2(pixel), vec2(0.06711056, 0.00583715))));
  vec2 own = vec2(cos(angle), sin(angle));
  vec4 radiance = vec4(0.0), beside = vec4(0.0);
  float total = 0.0, placed = 0.0;
  for (int i = 0; i < int(rays + 0.5); i++) {
    vec3 ray_origin = origin.xyz;
    vec3 ray_direction = mirrored.xyz;
    float weight = 1.0;
    if (pixel_rays > 1.5) {
      // Of a lobe's rays, neighbours on the spiral lie far apart on the line.
      float along = of_lobe ? fract(0.5 + 0.618034 * float(i)) - 0.5 : (float(i) + 0.5) / rays - 0.5;
      ray_origin += along * moved;
      ray_direction = normalize(ray_direction + along * turned);
    }
    if (of_lobe) {
      vec4 mirrored = vec4(ray_direction, 0.0);
      vec2 turn = lobe_turns[i];
      turn = vec2(turn.x * own.x - turn.y * own.y, turn.x * own.y + turn.y * own.x);
      float share = (float(i) + 0.5) / rays;
#include "lobe_call"
    }
    if (weight > 0.0) {
#include "call"
      radiance += weight * vec4(clamp(hit_radiance, -65504.0, 65504.0) * hit_coverage, hit_coverage);
      total += weight;
      // Along a line the middle ray, the pixel's own, says where: the mean of a near and a far thing is neither.
      if (of_lobe || i == int(rays) / 2) {
#include "add_beside"
        placed += weight;
      }
    }
  }
  total = max(total, 1e-6);
  radiance_out = vec4(radiance.rgb / max(radiance.a, 1e-6), radiance.a / total);
  total = max(placed, 1e-6);
#include "store_beside"
}
