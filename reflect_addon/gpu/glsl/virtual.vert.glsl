// A corner of a virtual triangle. corner: the three vertices of the triangle, and which of them this is.
#include "table_lib.glsl"

#ifdef FINISH
// Edges that should bend are straight here, so that a pixel whose ray meets the real triangle may lie beside the virtual one, and near a
// rim by more than a pixel. The triangle is drawn wider, by WIDER pixels and a share of its longest edge: fragments know better.
vec2 widened(vec4 before, vec4 here, vec4 after)
{
  vec2 size = 0.5 * frame.options.zw;
  vec2 middle = here.xy / here.w * size;
  vec2 from = middle - before.xy / before.w * size, to = after.xy / after.w * size - middle, third = from + to;
  float longest = sqrt(max(max(dot(from, from), dot(to, to)), dot(third, third)));
  float turn = (from.x * to.y - from.y * to.x < 0.0) ? -1.0 : 1.0;
  vec2 first = turn * vec2(from.y, -from.x) / max(length(from), 1e-6), second = turn * vec2(to.y, -to.x) / max(length(to), 1e-6);
  vec2 outwards = (first + second) / max(1.0 + dot(first, second), 0.1);
  float far = min(WIDER + BENT * longest, WIDEST);
  return outwards * far / size;
}
#endif

void main()
{
  ivec2 a = texel_of(int(corner.x + 0.5)), b = texel_of(int(corner.y + 0.5)), c = texel_of(int(corner.z + 0.5));
  vec4 virtual_a = texelFetch(virtual_tx, a, 0), virtual_b = texelFetch(virtual_tx, b, 0), virtual_c = texelFetch(virtual_tx, c, 0);
  int own = int(corner.w + 0.5);
  v_origin = texelFetch(place_tx, a, 0).xyz;
  v_edge_b = texelFetch(place_tx, b, 0).xyz - v_origin;
  v_edge_c = texelFetch(place_tx, c, 0).xyz - v_origin;
  v_vertices = corner.xyz;
  v_weights = (own == 0) ? vec3(1.0, 0.0, 0.0) : (own == 1) ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0);

  vec4 clip_a = frame.clip_from_map * vec4(virtual_a.xyz, 1.0), clip_b = frame.clip_from_map * vec4(virtual_b.xyz, 1.0),
       clip_c = frame.clip_from_map * vec4(virtual_c.xyz, 1.0);
  gl_Position = (own == 0) ? clip_a : (own == 1) ? clip_b : clip_c;
#ifdef FINISH
  if (min(clip_a.w, min(clip_b.w, clip_c.w)) > 0.0) {
    vec4 before = (own == 0) ? clip_c : (own == 1) ? clip_a : clip_b, after = (own == 0) ? clip_b : (own == 1) ? clip_c : clip_a;
    gl_Position.xy += widened(before, gl_Position, after) * gl_Position.w;
  }
#endif
  // Nothing is too far to be reflected: depth only has to lie in front of the far plane, order is the fragments' business.
  gl_Position.z = gl_Position.w - 2.0 * NEAREST / frame.options.y;
  vec3 status = vec3(virtual_a.w, virtual_b.w, virtual_c.w);
  bool hidden = all(equal(status, vec3(HIDDEN)));
  if (hidden || any(greaterThan(status, vec3(FAILED - 0.5))) || any(lessThan(status, vec3(0.5)))) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);  // the whole triangle lies here, and so nowhere
  }
}
