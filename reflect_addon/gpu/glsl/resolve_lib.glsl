// Provides resolve(pixel, ...): what the reflection adds to a pixel. Once for all methods.
#include "shading"

struct Resolved {
  vec3 radiance;   // scene-linear, to be added
  float opacity;   // share of the surface's own light that it replaces
  float reflector; // index, -1 = none here
  float covered;   // 1: seen through, so that nothing of what is behind is to be added again
};

Resolved resolve(ivec2 pixel)
{
  Resolved resolved = Resolved(vec3(0.0), 0.0, -1.0, 0.0);
  vec4 origin = texelFetch(origin_tx, pixel, 0);
  if (origin.w < -0.5) {
    return resolved;
  }
  vec4 answer = texelFetch(radiance_tx, pixel, 0);
  vec2 seen = texelFetch(material_tx, pixel, 0).rg;
  float cosine = seen.g;
  int row = int(seen.r + 0.5);
  vec4 base = texelFetch(materials_tx, ivec2(0, row), 0);
  vec4 tint = texelFetch(materials_tx, ivec2(1, row), 0);
  float weight = texelFetch(materials_tx, ivec2(2, row), 0).x;
#include "reflectance_call"
  resolved.radiance = answer.rgb * reflectance * answer.a;
  resolved.opacity = clamp(opacity, 0.0, 1.0) * answer.a;
  resolved.reflector = origin.w;
#include "attenuation_call"
  return resolved;
}
