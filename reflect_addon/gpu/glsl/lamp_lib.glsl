// Provides lamp_met(lamp, origin, direction): how far along a ray it meets a row of lamps_buf (core/virtual_lamps.py), m; negative where it does not.
float lamp_met(int lamp, vec3 origin, vec3 direction)
{
  vec4 center = texelFetch(lamps_buf, ivec2(0, lamp), 0);
  mat3 rows = mat3(
      texelFetch(lamps_buf, ivec2(1, lamp), 0).xyz, texelFetch(lamps_buf, ivec2(2, lamp), 0).xyz,
      texelFetch(lamps_buf, ivec2(3, lamp), 0).xyz);
  vec3 from = (origin - center.xyz) * rows, along = direction * rows;
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
  return distance_along;
}
