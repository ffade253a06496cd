// A level of a cube map's pyramid from the six faces of level 0: means of its texels; borders are looked up where they really point.
// place: xy px of the level in the image, z its texels along an edge, w those of level 0.
#include "across"

void main()
{
  ivec2 at = ivec2(gl_FragCoord.xy - place.xy);
  int side = int(place.z), whole = int(place.w);
  if (side == whole) {
    texel_out = texelFetch(row_tx, at, 0);
    return;
  }
  int step = whole / side;
  float face = float(at.x / (side + 2));
  ivec2 texel = ivec2(at.x % (side + 2), at.y) - 1;
  vec2 s = (vec2(texel) + 0.5) / place.z * 2.0 - 1.0;
  if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, ivec2(side)))) {
#include "across_call"
    face = seen_face;
    s = vec2(seen_s, seen_t);
  }
  ivec2 first = ivec2(floor((s + 1.0) * 0.5 * place.w - 0.5 * float(step) + 0.5));
  vec4 sum = vec4(0.0);
  for (int j = 0; j < step; j++) {
    for (int i = 0; i < step; i++) {
      ivec2 within = clamp(first + ivec2(i, j), ivec2(-1), ivec2(whole)) + 1;
      sum += texelFetch(row_tx, ivec2(int(face) * (whole + 2) + within.x, within.y), 0);
    }
  }
  texel_out = sum / float(step * step);
}
