// The reflection buffer of some reflectors: one ray in, one answer out. `answer` is the emitted kernel.
// reflectors: x = first, y = last index of the ray map that this pass answers.
#include "kernel"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 origin = texelFetch(origin_tx, pixel, 0);
  if (origin.w < reflectors.x - 0.5 || origin.w > reflectors.y + 0.5) {
    discard;
    return;
  }
  vec4 direction = texelFetch(direction_tx, pixel, 0);
  float width = texelFetch(normal_tx, pixel, 0).w;
#include "call"
}
