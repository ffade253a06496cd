// Corners of cells, for one part of a reflector and in its map space: all are searched, or with LEVELS where a cell around them is
// taken apart (core/virtual_follow.py, _corners), else interpolated in the first of those.
// around_buf: the cells around, -1 for none; node_where_buf: where in the first. range, block, seed: as in virtual_search.comp.glsl.
#include "table_lib.glsl"
#ifdef LEVELS
#include "virtual_cells_lib.glsl"
#endif
#include "kernel"

void main()
{
  int index = int(gl_GlobalInvocationID.y) * COLUMNS + int(gl_GlobalInvocationID.x);
  if (index >= int(range.y)) {
    return;
  }
  index += int(range.x);
  ivec2 texel = texel_of(index);
  vec3 place = placed(placing_buf, texelFetch(points_buf, texel, 0));
  bool searched = true;
  vec4 virtual_P = vec4(0.0), start = imageLoad(start_img, texel);
#ifdef LEVELS
  vec4 around = texelFetch(around_buf, texel, 0);
  if (around.x > -0.5) {
    searched = false;
    for (int nth = 0; nth < 4; nth++) {
      searched = searched || (around[nth] > -0.5 && imageLoad(apart_img, texel_of(int(around[nth] + 0.5))).x > 0.0);
    }
    Cell cell = cell_at(int(around.x + 0.5));
    vec3 where = texelFetch(node_where_buf, texel, 0).xyz;
    if (!searched) {
      virtual_P = interpolated(cell, where).virtual_P;
    }
    else if (start.w < 0.5) {
      start = start_in(cell, where);
    }
  }
#endif
  float looked = 0.0;
  if (searched) {
    start = (start.w < 0.5) ? seed : vec4(start.xyz, max(seed.w, 1.0));
#include "call"
    looked = float(found_evaluations > 0.5);  // 0 where the kernel saw at once that this part does not show the point
    virtual_P = vec4(found_virtual.xyz, found_status);
    // A failed search says nothing of where the next one should begin.
    imageStore(start_img, texel, (found_status < FAILED) ? vec4(found_direction, 1.0) : vec4(0.0));
  }
  imageStore(virtual_img, texel, virtual_P);
  imageStore(place_img, texel, vec4(place, looked));
}
