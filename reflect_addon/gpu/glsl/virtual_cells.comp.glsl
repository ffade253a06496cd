// Cells of one level: which are to be taken apart further (core/virtual_follow.py, _cells and cell_error), and their middles.
// A cell searches its middle where the cell above it was taken apart and what its corners say is doubtful; it is taken apart where
// trilinear interpolation there errs by more than the tolerance. apart_img: px that it errs by then, UNBOUNDED for any, else 0.
// range, block, seed: as in virtual_search.comp.glsl; rule: xy pixels of the picture, z tolerance, w 1 where nodes speak for cells.
#include "table_lib.glsl"
#include "virtual_cells_lib.glsl"
#include "kernel"

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

// Of a cell that was searched, with its middle's value.
float error_of(Cell cell, Interpolated here, vec4 middle)
{
  vec2 low = vec2(UNBOUNDED), high = vec2(-UNBOUNDED);
  int reflected = 0, hidden = 0, failed = 0;
  for (int nth = 0; nth < 9; nth++) {
    vec4 found = (nth < 8) ? NODE(corner_of(cell, nth)) : middle;
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
  float error = UNSEEN * distance(pixel_of(middle.xyz), pixel_of(here.virtual_P.xyz));
  return bounded(sure ? error : max(error, shown / WIDE));
}

void main()
{
  int index = int(gl_GlobalInvocationID.y) * COLUMNS + int(gl_GlobalInvocationID.x);
  if (index >= int(range.y)) {
    return;
  }
  index += int(range.x);
  vec4 more = texelFetch(cells_buf, texel_of(3 * index + 2), 0);
  ivec2 texel = texel_of(int(more.x + 0.5));
  float above = (more.y < -0.5) ? UNBOUNDED : imageLoad(apart_img, texel_of(int(more.y + 0.5))).x;
  Cell cell = cell_at(index);
  Interpolated here = interpolated(cell, vec3(0.5));
  vec4 virtual_P = here.virtual_P;
  vec3 place = placed(placing_buf, texelFetch(points_buf, texel, 0));
  bool sure = rule.w > 0.5;
  bool doubtful = !sure || here.broken || above > FALL * rule.z;
  bool searched = above > 0.0 && doubtful && !(sure && here.hidden);
  float error = 0.0;
  float looked = 0.0;
  if (searched) {
    vec4 start = imageLoad(start_img, texel);
    start = (start.w < 0.5) ? start_in(cell, vec3(0.5)) : start;
    start = (start.w < 0.5) ? seed : vec4(start.xyz, max(seed.w, 1.0));
#include "call"
    looked = float(found_evaluations > 0.5);  // 0 where the kernel saw at once that this part does not show the point
    virtual_P = vec4(found_virtual.xyz, found_status);
    imageStore(start_img, texel, (found_status < FAILED) ? vec4(found_direction, 1.0) : vec4(0.0));
    error = error_of(cell, here, virtual_P);
    error = (error > rule.z) ? error : 0.0;
  }
  imageStore(virtual_img, texel, virtual_P);
  imageStore(place_img, texel, vec4(place, looked));
  imageStore(apart_img, texel_of(index), vec4(error));
}
