// What a mirror shows that no view was drawn for: its ray goes on from mirror to mirror through the pictures of the branch's views
// (core/mirror_series.py). `answer`, the emitted kernel of the mirror's asset, answers what they do not show; of the first leg the fill does.
// plane_origin, plane_normal, sizes_per_metre: as in shown_in_mirror.frag.glsl; at_first: index of the mirror's own picture; reach: m.
#include "kernel"
#include "march"
#include "reflectance"
#include "of_mirror_lib.glsl"
#include "mirror_series_lib.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 origin = texelFetch(origin_tx, pixel, 0);
  vec4 normal = texelFetch(normal_tx, pixel, 0);
  if (!of_mirror(origin, normal.xyz)) {
    discard;
    return;
  }
  vec4 direction = texelFetch(direction_tx, pixel, 0);
  vec3 start = origin.xyz, along = direction.xyz, through = vec3(1.0), hit_radiance = vec3(0.0);
  float first_leg = 0.0, gone = 0.0, width = normal.w;
  int at = int(at_first + 0.5);
  bool left = true;
  for (int leg = 0; leg < LEGS && left; leg++) {
    Met met = march_in(at, start, along);
    left = false;
    if (!met.found) {
      if (leg == 0) {
        discard;
        return;
      }
      left = true;  // answered below
      break;
    }
    if (leg == 0) {
      first_leg = met.along;
    }
    else {
#include "fade"
      hit_radiance += through * lamps_before(start, along, met.along);
    }
    // A picture tells where a mirror is, its material, and what the mirror sends out by itself.
    int mirror = (met.material.y > 0.0) ? mirror_at(met.place, along) : -1;
    if (met.material.y > 0.0) {
      int material = int(met.material.x + 0.5);
      float cosine = (mirror < 0) ? met.material.y : -dot(along, series.of[ROWS * mirror + PLANE_NORMAL].xyz);
      vec4 base = texelFetch(materials_tx, ivec2(0, material), 0);
      vec4 tint = texelFetch(materials_tx, ivec2(1, material), 0);
      float weight = texelFetch(materials_tx, ivec2(2, material), 0).x;
#include "reflectance_call"
      if (weight > 0.0 && mirror < 0) {
        left = true;  // it shows something, and no picture says what
        break;
      }
      hit_radiance += through * met.radiance * (1.0 - max(clamp(opacity, 0.0, 1.0) - base.a * weight, 0.0));
      through *= reflectance;
      left = max(through.x, max(through.y, through.z)) > LEAST;
    }
    else {
      hit_radiance += through * met.radiance;
    }
    if (left) {
      vec3 facing = series.of[ROWS * mirror + PLANE_NORMAL].xyz;
      float far = dot(series.of[ROWS * mirror + PLANE_ORIGIN].xyz - start, facing) / dot(along, facing);
      start += along * far;
      along = normalize(reflect(along, facing));
      gone += far;
      width = normal.w + direction.w * gone;
      at = mirror;
    }
  }
  vec3 hit_position = origin.xyz + direction.xyz * first_leg;
  float far = first_leg * sizes_per_metre;
  gl_FragDepth = 0.5 * far / (1.0 + far);
  if (left) {
    vec3 rest = hit_radiance;
    float spread = direction.w;
    {
#include "call"
      rest += through * rest_radiance * rest_coverage;
    }
    hit_radiance = rest;
  }
  float hit_coverage = 1.0;
  float hit_status = STATUS_HIT;
#include "store_answer"
}
