// Points, interpolated in the cells of a grid, for one part of a reflector: vertices, or with NODES corners of cells. Those that their
// cell cannot speak for are put on a list, to be searched (virtual_listed.comp.glsl): corners where a cell around them is taken apart;
// vertices where theirs still is, or without LEVELS where it is broken and some of its corners were found.
// where_buf: a point's cell, -1 for none, and where in it; around_buf: cells whose being taken apart asks for a corner.
// range: x first, y count of the points, z which of the counts is this list's.
#include "table_lib.glsl"
#include "virtual_cells_lib.glsl"

void main()
{
  int index = int(gl_GlobalInvocationID.y) * COLUMNS + int(gl_GlobalInvocationID.x);
  if (index >= int(range.y)) {
    return;
  }
  index += int(range.x);
  ivec2 texel = texel_of(index);
  vec4 where = texelFetch(where_buf, texel, 0);
  int cell = int(where.x + 0.5);
#if defined(NODES)
  bool asked = where.x < -0.5;
  vec4 around = texelFetch(around_buf, texel, 0);
  for (int nth = 0; nth < 4; nth++) {
    asked = asked || (around[nth] > -0.5 && texelFetch(apart_tx, texel_of(int(around[nth] + 0.5)), 0).x > 0.0);
  }
#elif defined(LEVELS)
  bool asked = texelFetch(apart_tx, texel_of(cell), 0).x > 0.0;
#else
  bool asked = false;
#endif
  if (asked) {
    put_on_list(index);
    return;
  }
  Interpolated here = interpolated(cell_at(cell), where.yzw);
#ifndef LEVELS
  if (here.broken && here.virtual_P.w < FAILED - 0.5) {
    put_on_list(index);
    return;
  }
#endif
  imageStore(virtual_img, texel, here.virtual_P);
  imageStore(place_img, texel, vec4(placed(placing_buf, texelFetch(points_buf, texel, 0)), 0.0));
}
