// Virtual vertices of one part of a reflector: each invocation places one vertex and searches its reflection point
// (core/reflection_search.py). All in the part's map space.
// With AGAIN those that failed search again, from where a vertex beside them ended that the pass before found; pass counts from 1.
// range: x first, y count of the vertices; block: the part's map in the atlas; seed: where to start, as the kernel's `start`.
#include "table_lib.glsl"
#include "kernel"

#ifdef AGAIN
// What a vertex says that a pass found: no thread of a pass reads what another one writes, so that their order says nothing.
float found_in(float number)
{
  return 1.0 + 0.1 * number;
}

vec4 start_beside(int index)
{
  for (int away = 1; away <= REACH; away *= 2) {
    for (int way = -1; way <= 1; way += 2) {
      ivec2 beside = texel_of(clamp(index + way * away, int(range.x), int(range.x + range.y) - 1));
      if (abs(imageLoad(virtual_img, beside).w - found_in(pass - 1.0)) < 0.05) {
        return imageLoad(start_img, beside);
      }
    }
  }
  return vec4(0.0);
}
#endif

void main()
{
  int index = int(gl_GlobalInvocationID.y) * COLUMNS + int(gl_GlobalInvocationID.x);
  if (index >= int(range.y)) {
    return;
  }
  index += int(range.x);
  ivec2 texel = texel_of(index);
#ifdef AGAIN
  vec4 start = vec4(0.0);
  if (imageLoad(virtual_img, texel).w > FAILED - 0.5) {
    start = start_beside(index);
  }
  if (start.w < 0.5) {
    return;
  }
#else
  vec4 start = imageLoad(start_img, texel);
#endif
  vec4 vertex = texelFetch(vertices_buf, texel, 0);
  vec3 place = placed(placing_buf, vertex);
  start = (start.w < 0.5) ? seed : vec4(start.xyz, max(seed.w, 1.0));
#include "call"
#ifdef AGAIN
  found_status = (found_status < 1.5) ? found_in(pass) : found_status;
#endif
  // A failed search says nothing of where the next one should begin.
  imageStore(start_img, texel, (found_status < FAILED) ? vec4(found_direction, 1.0) : vec4(0.0));
  imageStore(virtual_img, texel, vec4(found_virtual.xyz, found_status));
  imageStore(place_img, texel, vec4(place, 1.0));
}
