// A map of errors over the picture: a reflector's own surface again, in the colour of the nearest ray of it that was measured.
// heat_tx: rgb as displayed, w = reflector index, -1 = not measured; step_px: pixels of the picture, along each side, that share a texel.
#include "srgb_lib.glsl"

void main()
{
  vec2 place = gl_FragCoord.xy / step_px - 0.5;
  ivec2 middle = ivec2(floor(place + 0.5)), last = textureSize(heat_tx, 0) - 1;
  float nearest = 1e9;
  vec3 color = vec3(0.0);
  for (int i = 0; i < 9; i++) {
    ivec2 texel = clamp(middle + ivec2(i % 3 - 1, i / 3 - 1), ivec2(0), last);
    vec4 heat = texelFetch(heat_tx, texel, 0);
    float away = distance(place, vec2(texel));
    if (abs(heat.w - surface.x) < 0.5 && away < nearest) {
      nearest = away;
      color = heat.rgb;
    }
  }
  if (nearest > 1e8) {
    discard;
    return;
  }
  overlay_out = vec4(srgb_decoded(color), 1.0);
}
