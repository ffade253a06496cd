// Provides srgb_encoded and srgb_decoded (IEC 61966-2-1) for [0, 1].

vec3 srgb_encoded(vec3 linear_rgb)
{
  return mix(1.055 * pow(max(linear_rgb, 0.0031308), vec3(1.0 / 2.4)) - 0.055, linear_rgb * 12.92,
             vec3(lessThanEqual(linear_rgb, vec3(0.0031308))));
}

vec3 srgb_decoded(vec3 encoded)
{
  return mix(pow((max(encoded, 0.04045) + 0.055) / 1.055, vec3(2.4)), encoded / 12.92,
             vec3(lessThanEqual(encoded, vec3(0.04045))));
}
