// The vertices on a list (virtual_vertices.comp.glsl), searched: threads beside each other all have work. From where the last frame
// found one, or its cell's corners were found. range: y how many there may be. block, seed: as in virtual_search.comp.glsl.
#include "table_lib.glsl"
#include "virtual_cells_lib.glsl"
#include "kernel"

void main()
{
  int index = int(gl_GlobalInvocationID.y) * COLUMNS + int(gl_GlobalInvocationID.x);
  if (index >= int(range.y) || index >= int(imageLoad(list_img, ivec2(0)).x)) {
    return;
  }
  ivec2 texel = texel_of(int(imageLoad(list_img, texel_of(index + 1)).x));
  vec3 place = placed(placing_buf, texelFetch(points_buf, texel, 0));
  vec4 start = imageLoad(start_img, texel);
  if (start.w < 0.5) {
    vec4 where = texelFetch(where_buf, texel, 0);
    start = start_in(cell_at(int(where.x + 0.5)), where.yzw);
  }
  start = (start.w < 0.5) ? seed : vec4(start.xyz, max(seed.w, 1.0));
#include "call"
  float looked = float(found_evaluations > 0.5);
  imageStore(start_img, texel, (found_status < FAILED) ? vec4(found_direction, 1.0) : vec4(0.0));
  imageStore(virtual_img, texel, vec4(found_virtual.xyz, found_status));
  imageStore(place_img, texel, vec4(place, looked));
}
