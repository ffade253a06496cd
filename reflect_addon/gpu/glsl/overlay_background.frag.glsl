// The viewport's background: what the asset answered where no reflector is seen. Display-linear, premultiplied.
#include "look"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  if (abs(texelFetch(origin_tx, pixel, 0).w - background_index) > 0.5) {
    discard;
    return;
  }
  vec4 answer = texelFetch(radiance_tx, pixel, 0);
  overlay_out = vec4(display_linear(answer.rgb) * answer.a, answer.a);
}
