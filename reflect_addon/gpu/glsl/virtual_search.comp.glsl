// Virtual vertices of one part of a reflector: each invocation places one vertex and searches its reflection point
// (core/reflection_search.py). All in the part's map space.
// range: x first, y count of the vertices; block: the part's map in the atlas; seed: where to start, as the kernel's `start`.
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
  vec4 vertex = texelFetch(vertices_buf, texel, 0);
  vec3 place = placed(placing_buf, vertex);
  vec4 start = imageLoad(start_img, texel);
  start = (start.w < 0.5) ? seed : vec4(start.xyz, max(seed.w, 1.0));
#include "call"
  // A failed search says nothing of where the next one should begin.
  imageStore(start_img, texel, (found_status < FAILED) ? vec4(found_direction, 1.0) : vec4(0.0));
  imageStore(virtual_img, texel, vec4(found_virtual.xyz, found_status));
  imageStore(place_img, texel, vec4(place, 1.0));
}
