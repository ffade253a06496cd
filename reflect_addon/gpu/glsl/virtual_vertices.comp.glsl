// Vertices, interpolated in the cells of a grid, for one part of a reflector. Those that their cell cannot speak for are put on a list
// to be searched (virtual_listed.comp.glsl): with LEVELS where the cell is still taken apart, else where it is broken and not given up.
// list_img: how many, then which. where_buf: a vertex's cell, and where in it. range: x first, y count of the vertices.
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
#ifdef LEVELS
  if (texelFetch(apart_tx, texel_of(cell), 0).x > 0.0) {
    imageStore(list_img, texel_of(int(imageAtomicAdd(list_img, ivec2(0), 1u)) + 1), uvec4(index));
    return;
  }
  Interpolated here = interpolated(cell_at(cell), where.yzw);
#else
  Interpolated here = interpolated(cell_at(cell), where.yzw);
  if (here.broken && here.virtual_P.w < FAILED - 0.5) {
    imageStore(list_img, texel_of(int(imageAtomicAdd(list_img, ivec2(0), 1u)) + 1), uvec4(index));
    return;
  }
#endif
  vec3 place = placed(placing_buf, texelFetch(points_buf, texel, 0));
  imageStore(virtual_img, texel, here.virtual_P);
  imageStore(place_img, texel, vec4(place, 0.0));
}
