// Cells of one level, before their middles are searched: which are worth it (core/virtual_follow.py, _cells), and what the others say.
// A cell's middle is searched where the cell above was taken apart and what the corners say is doubtful; else it is their mean.
// apart_img: UNJUDGED where the middle is put on the list, else 0. range: as in virtual_points.comp.glsl; rule: z the tolerance, px, w
// 1 where nodes speak for cells.
#include "table_lib.glsl"
#include "virtual_cells_lib.glsl"

void main()
{
  int index = int(gl_GlobalInvocationID.y) * COLUMNS + int(gl_GlobalInvocationID.x);
  if (index >= int(range.y)) {
    return;
  }
  index += int(range.x);
  vec4 more = texelFetch(cells_buf, texel_of(3 * index + 2), 0);
  float above = (more.y < -0.5) ? UNBOUNDED : imageLoad(apart_img, texel_of(int(more.y + 0.5))).x;
  Interpolated here = interpolated(cell_at(index), vec3(0.5));
  bool sure = rule.w > 0.5;
  bool doubtful = !sure || here.broken || above > FALL * rule.z;
  bool searched = above > 0.0 && doubtful && !(sure && here.hidden);
  imageStore(apart_img, texel_of(index), vec4(searched ? UNJUDGED : 0.0));
  int middle = int(more.x + 0.5);
  if (searched) {
    put_on_list(middle);
    return;
  }
  ivec2 texel = texel_of(middle);
  imageStore(virtual_img, texel, here.virtual_P);
  imageStore(place_img, texel, vec4(placed(placing_buf, texelFetch(points_buf, texel, 0)), 0.0));
}
