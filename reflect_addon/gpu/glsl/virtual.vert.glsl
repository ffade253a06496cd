// A corner of a virtual triangle. corner: the three vertices of the triangle, and which of them this is.
#include "table_lib.glsl"

#ifdef FINISH
// Edges that should bend are straight here, so that a pixel whose ray meets the real triangle may lie beside the virtual one, and near a
// rim by more than a pixel. The triangle is drawn wider, by WIDER pixels and a share of its longest edge: fragments know better.
// Returns where the corner `here` goes, in pixels from the middle of the picture.
vec2 widened(vec2 before, vec2 here, vec2 after)
{
  vec3 squares = vec3(dot(here - before, here - before), dot(after - here, after - here), dot(before - after, before - after));
  bool ends_here = squares.x >= squares.y && squares.x >= squares.z, begins_here = !ends_here && squares.y >= squares.z;
  vec2 low = ends_here ? before : begins_here ? here : after, high = ends_here ? here : begins_here ? after : before;
  vec2 top = ends_here ? after : begins_here ? before : here;
  float longest = distance(low, high);
  vec2 along = (longest > 1e-6) ? (high - low) / longest : vec2(1.0, 0.0), upwards = vec2(-along.y, along.x);
  float height = dot(top - low, upwards);
  upwards = (height < 0.0) ? -upwards : upwards;
  height = abs(height);
  float far = min(WIDER + BENT * longest, WIDEST);
  if (height > SLIVER * longest) {
    vec2 from = normalize(here - before), to = normalize(after - here);
    float turn = (from.x * to.y - from.y * to.x < 0.0) ? -far : far;
    return here + turn * vec2(from.y + to.y, -from.x - to.x) / (1.0 + dot(from, to));
  }
  // Corners that are sharp would go far: a triangle around the rectangle around this one instead.
  vec2 middle = 0.5 * (low + high + upwards * height);
  float half_long = 0.5 * longest + far, half_high = 0.5 * height + far;
  return (ends_here || begins_here) ? middle - upwards * half_high + along * (ends_here ? 2.0 : -2.0) * half_long :
                                      middle + upwards * 3.0 * half_high;
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
    vec2 size = 0.5 * frame.picture.xy;
    vec2 a_px = clip_a.xy / clip_a.w * size, b_px = clip_b.xy / clip_b.w * size, c_px = clip_c.xy / clip_c.w * size;
    vec2 wider = (own == 0) ? widened(c_px, a_px, b_px) : (own == 1) ? widened(a_px, b_px, c_px) : widened(b_px, c_px, a_px);
    gl_Position.xy = wider / size * gl_Position.w;
  }
#endif
  // Nothing is too far to be reflected: depth only has to lie in front of the far plane, order is the fragments' business.
  gl_Position.z = gl_Position.w - 2.0 * frame.picture.z;
  vec3 status = vec3(virtual_a.w, virtual_b.w, virtual_c.w);
  bool hidden = all(equal(status, vec3(HIDDEN)));
  if (hidden || any(greaterThan(status, vec3(FAILED - 0.5))) || any(lessThan(status, vec3(0.5)))) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);  // the whole triangle lies here, and so nowhere
  }
}
