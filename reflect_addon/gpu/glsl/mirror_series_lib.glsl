// Provides what a leg of a series needs of the pictures (core/mirror_series.py): march_in(at, start, along), mirror_at(place, along),
// lamps_before(start, along, limit).
struct Met {
  bool found;
  vec3 radiance;  // without what mirrors add
  float along;    // m
  vec3 place;
  vec2 material;  // row and cosine of a reflector's ray; cosine 0: none is seen there
};

Met march_in(int at, vec3 start, vec3 along)
{
  Met met = Met(false, vec3(0.0), FAR, vec3(0.0), vec2(0.0));
  vec4 row_x = series.of[ROWS * at + ROW_X], row_y = series.of[ROWS * at + ROW_Y], row_w = series.of[ROWS * at + ROW_W];
  vec4 eye = series.of[ROWS * at + EYE], forward = series.of[ROWS * at + FORWARD], window = series.of[ROWS * at + WINDOW];
  vec3 from = start - eye.xyz;
  float w = dot(row_w.xyz, from) + row_w.w;
  vec2 px = vec2(dot(row_x.xyz, from) + row_x.w, dot(row_y.xyz, from) + row_y.w) / w;
  if (!(w > 0.0) || any(lessThan(px, window.xy)) || any(greaterThan(px, window.zw))) {
    return met;
  }
#include "march_call"
  if (march_found > 0.5) {
    ivec2 pixel = ivec2(march_pixel);
    vec4 place = texelFetch(place0_tx, pixel, 0), material = texelFetch(material0_tx, pixel, 0);
    if (at == 1) {
      place = texelFetch(place1_tx, pixel, 0);
      material = texelFetch(material1_tx, pixel, 0);
    }
    else if (at == 2) {
      place = texelFetch(place2_tx, pixel, 0);
      material = texelFetch(material2_tx, pixel, 0);
    }
    met = Met(true, march_radiance, march_distance, place.xyz, material.rg);
  }
  return met;
}

// The picture of the mirror that a place is on and whose front the ray meets; -1: none.
int mirror_at(vec3 place, vec3 along)
{
  for (int i = 0; i < PICTURES; i++) {
    vec4 plane = series.of[ROWS * i + PLANE_ORIGIN];
    vec3 facing = series.of[ROWS * i + PLANE_NORMAL].xyz;
    if (abs(dot(place - plane.xyz, facing)) <= plane.w && dot(along, facing) < 0.0) {
      return i;
    }
  }
  return -1;
}

#ifdef LAMPS
#include "lamp_lib.glsl"
#endif

// Light of the lamps that a ray meets before `limit` m.
vec3 lamps_before(vec3 start, vec3 along, float limit)
{
  vec3 light = vec3(0.0);
#ifdef LAMPS
  for (int lamp = 0; lamp < textureSize(lamps_buf, 0).y; lamp++) {
    float far = lamp_met(lamp, start, along);
    light += (far > 0.0 && far < limit) ? texelFetch(lamps_buf, ivec2(4, lamp), 0).rgb : vec3(0.0);
  }
#endif
  return light;
}
