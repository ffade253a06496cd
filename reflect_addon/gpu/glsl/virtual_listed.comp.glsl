// The points on a list, searched for one part of a reflector in its map space: threads beside each other all have work. Each begins
// where the last frame found it, or in the middle of where its cell's corners were found. w of a place: it was searched.
// range: y how many threads there are, each of which takes every so manyth point; z which of the counts is the list's. ALL: there is no
// list, and a thread for each point: x first, y their count. block, seed: as in virtual_search.comp.glsl.
#include "table_lib.glsl"
#include "virtual_cells_lib.glsl"
#include "kernel"

void search_point(int index)
{
  ivec2 texel = texel_of(index);
  vec3 place = placed(placing_buf, texelFetch(points_buf, texel, 0));
  vec4 where = texelFetch(where_buf, texel, 0);
  vec4 start = imageLoad(start_img, texel);
  if (start.w < 0.5 && where.x > -0.5) {
    start = start_in(cell_at(int(where.x + 0.5)), where.yzw);
  }
  start = (start.w < 0.5) ? seed : vec4(start.xyz, max(seed.w, 1.0));
#include "call"
  // A failed search says nothing of where the next one should begin.
  imageStore(start_img, texel, (found_status < FAILED) ? vec4(found_direction, 1.0) : vec4(0.0));
  imageStore(virtual_img, texel, vec4(found_virtual.xyz, found_status));
  imageStore(place_img, texel, vec4(place, 1.0));
}

void main()
{
  int index = int(gl_GlobalInvocationID.y) * COLUMNS + int(gl_GlobalInvocationID.x);
  if (index >= int(range.y)) {
    return;
  }
#ifdef ALL
  search_point(index + int(range.x));
#else
  int count = int(imageLoad(count_img, texel_of(int(range.z))).x);
  for (; index < count; index += int(range.y)) {
    search_point(int(imageLoad(list_img, texel_of(index)).x));
  }
#endif
}
