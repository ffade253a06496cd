// Virtual points of one part of a reflector, in its map space: nodes of the grid, then vertices (core/virtual_grid.py). A point is
// searched (core/reflection_search.py) where its rule says so, else interpolated in its cell.
// range: x first, y count of the points; rule: x 0 searched, 1 where the cell errs, 2 the middle of a cell, where the cell above
// errs; y the error that is allowed, px; z 1 = the last frame says where to start; block: the part's map in the atlas.
#include "table_lib.glsl"
#include "kernel"

void main()
{
  int index = int(gl_GlobalInvocationID.y) * COLUMNS + int(gl_GlobalInvocationID.x);
  if (index >= int(range.y)) {
    return;
  }
  index += int(range.x);
  ivec2 texel = texel_of(index);
  vec4 point = texelFetch(points_buf, texel, 0);
  vec3 place = placed(placing_buf, point);
  vec4 cell = texelFetch(point_cells_buf, texel, 0);  // number, and where in it
  bool searched = rule.x < 0.5 || cell.x < -0.5;
  vec4 virtual_P = vec4(0.0), start = vec4(0.0);
  if (cell.x > -0.5) {
    float error = texelFetch(errors_tx, texel_of(int(cell.x + 0.5)), 0).x;
    if (rule.x > 1.5) {
      float above = texelFetch(cells_buf, texel_of(3 * int(cell.x + 0.5) + 2), 0).y;
      error = (above < -0.5) ? ALWAYS : texelFetch(errors_tx, texel_of(int(above + 0.5)), 0).x;
    }
    searched = searched || error > rule.y;
    int hidden = 0;
    for (int corner = 0; corner < 8; corner++) {
      vec4 corners = texelFetch(cells_buf, texel_of(3 * int(cell.x + 0.5) + corner / 4), 0);
      ivec2 at = texel_of(int(corners[corner % 4] + 0.5));
      vec3 far = vec3(corner & 1, (corner >> 1) & 1, corner >> 2);
      vec3 share = mix(1.0 - cell.yzw, cell.yzw, far);
      float weight = share.x * share.y * share.z;
      vec4 found = imageLoad(virtual_img, at);
      virtual_P += weight * found;
      hidden += int(abs(found.w - HIDDEN) < 0.5);
      start += weight * imageLoad(start_img, at);
    }
    virtual_P.w = (hidden == 8) ? HIDDEN : CONVERGED;
    start = vec4(start.xyz, float(start.w > 0.5));
  }
  if (searched) {
    vec4 before = imageLoad(start_img, texel);
    if (rule.z > 0.5 && before.w > 0.5) {
      start = before;
    }
    if (start.w < 0.5) {
      start = seed;
    }
#include "call"
    virtual_P = vec4(found_virtual.xyz, found_status);
    // A failed search says nothing of where the next one should begin.
    start = (found_status < FAILED) ? vec4(found_direction, 1.0) : vec4(0.0);
  }
  imageStore(start_img, texel, start);
  imageStore(virtual_img, texel, virtual_P);
  imageStore(place_img, texel, vec4(place, float(searched)));
}
