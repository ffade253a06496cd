// A corner of a virtual triangle. corner: the three vertices of the triangle, and which of them this is.
#include "table_lib.glsl"

void main()
{
  ivec2 a = texel_of(int(corner.x + 0.5)), b = texel_of(int(corner.y + 0.5)), c = texel_of(int(corner.z + 0.5));
  vec4 virtual_a = texelFetch(virtual_tx, a, 0), virtual_b = texelFetch(virtual_tx, b, 0), virtual_c = texelFetch(virtual_tx, c, 0);
  int own = int(corner.w + 0.5);
  vec3 virtual_P = (own == 0) ? virtual_a.xyz : (own == 1) ? virtual_b.xyz : virtual_c.xyz;

  v_origin = texelFetch(place_tx, a, 0).xyz;
  v_edge_b = texelFetch(place_tx, b, 0).xyz - v_origin;
  v_edge_c = texelFetch(place_tx, c, 0).xyz - v_origin;
  v_vertices = corner.xyz;
  v_weights = (own == 0) ? vec3(1.0, 0.0, 0.0) : (own == 1) ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0);

  gl_Position = frame.clip_from_map * vec4(virtual_P, 1.0);
  // Nothing is too far to be reflected: depth only has to lie in front of the far plane, order is the fragments' business.
  gl_Position.z = gl_Position.w - 2.0 * frame.options.y;
  vec3 status = vec3(virtual_a.w, virtual_b.w, virtual_c.w);
  bool hidden = all(equal(status, vec3(HIDDEN)));
  if (hidden || any(greaterThan(status, vec3(FAILED - 0.5))) || any(lessThan(status, vec3(0.5)))) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);  // the whole triangle lies here, and so nowhere
  }
}
