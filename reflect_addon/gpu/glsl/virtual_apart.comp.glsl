// Cells of one level whose middles were searched: which are to be taken apart further (core/virtual_follow.py, cell_error).
// apart_img: px that a cell errs by which is taken apart, UNBOUNDED for any, else 0.
// range: x first, y count of the cells; rule: xy pixels of the picture, z tolerance, px, w 1 where nodes speak for cells.
#include "table_lib.glsl"
#include "virtual_cells_lib.glsl"

vec2 pixel_of(vec3 virtual_P)
{
  vec4 clip = frame.clip_from_map * vec4(virtual_P, 1.0);
  return clip.xy / clip.w * 0.5 * rule.xy;
}

// What is not a number is any number of pixels.
float bounded(float pixels)
{
  return (pixels < UNBOUNDED) ? pixels : UNBOUNDED;
}

float error_of(Cell cell, vec4 middle)
{
  vec2 low = vec2(UNBOUNDED), high = vec2(-UNBOUNDED);
  vec3 mean = vec3(0.0);
  int reflected = 0, hidden = 0, failed = 0;
  for (int nth = 0; nth < 9; nth++) {
    vec4 found = middle;
    if (nth < 8) {
      found = NODE(corner_of(cell, nth));
      mean += 0.125 * found.xyz;
    }
    if (abs(found.w - CONVERGED) < 0.5) {
      vec2 pixel = pixel_of(found.xyz);
      low = min(low, pixel);
      high = max(high, pixel);
      reflected++;
    }
    hidden += int(abs(found.w - HIDDEN) < 0.5);
    failed += int(found.w > FAILED - 0.5);
  }
  bool sure = rule.w > 0.5;
  if (hidden == 9 || (failed == 9 && sure)) {
    return 0.0;  // nothing of it is shown
  }
  float shown = (reflected > 0) ? distance(low, high) : 0.0;
  if (failed > 0 || (reflected > 0 && hidden > 0)) {
    return (reflected < 2 || !sure) ? UNBOUNDED : bounded(shown);
  }
  float error = UNSEEN * distance(pixel_of(middle.xyz), pixel_of(mean));
  return bounded(sure ? error : max(error, shown / WIDE));
}

void main()
{
  int index = int(gl_GlobalInvocationID.y) * COLUMNS + int(gl_GlobalInvocationID.x);
  if (index >= int(range.y)) {
    return;
  }
  index += int(range.x);
  ivec2 texel = texel_of(index);
  if (imageLoad(apart_img, texel).x == UNJUDGED) {
    vec4 more = texelFetch(cells_buf, texel_of(3 * index + 2), 0);
    float error = error_of(cell_at(index), NODE(texel_of(int(more.x + 0.5))));
    imageStore(apart_img, texel, vec4((error > rule.z) ? error : 0.0));
  }
}
