// The ray map: the mirror ray of the surface that is seen in this pixel, and the pixel's footprint.
// surface: x = reflector index, y = material index, z = spread added by roughness.

vec3 unit_or(vec3 v, vec3 other)
{
  float length_squared = dot(v, v);
  return (length_squared > 1e-12) ? v * inversesqrt(length_squared) : other;
}

void main()
{
  bool orthographic = view.frame.x > 0.5;
  vec3 ws_view = orthographic ? view.forward.xyz : unit_or(v_rel_P, view.forward.xyz);  // the way the eye looks
  vec3 ws_face = unit_or(v_face_normal, -ws_view);
  vec3 ws_N = unit_or(v_normal, ws_face);

  // Both normals face the viewer by the side of the triangle that is seen: from inside a shape, its other side shines.
  if (dot(ws_face, ws_view) > 0.0) {
    ws_face = -ws_face;
    ws_N = -ws_N;
  }
  // A shading normal that turns away from the viewer (the silhouette of a smooth mesh) is at grazing there.
  vec3 ws_R = ws_view - 2.0 * min(dot(ws_view, ws_N), 0.0) * ws_N;

  // Growth of the footprint per metre, from the differentials of the direction; taken before any further branch.
  vec3 dx = dFdx(ws_R), dy = dFdy(ws_R);
  float spread = sqrt(0.5 * (dot(dx, dx) + dot(dy, dy)));
  if (!(spread < 2.0)) {
    spread = 2.0;  // silhouettes and slivers: extrapolated normals; also catches what is not a number
  }

  // No ray into the surface: lift a direction that lies below the triangle onto it, and tilt the normal to match.
  float lowest = min(0.5 * max(-dot(ws_face, ws_view), 0.0), 0.01);
  float height = dot(ws_R, ws_face);
  if (height < lowest) {
    ws_R = normalize(ws_R + (lowest - height) * ws_face);
    ws_N = unit_or(ws_R - ws_view, ws_face);
  }
  ws_R = normalize(ws_R);

  float width = view.frame.y * (orthographic ? 1.0 : max(dot(v_rel_P, view.forward.xyz), 0.0));
  origin_out = vec4(view.eye.xyz + v_rel_P, surface.x);
  direction_out = vec4(ws_R, view.frame.w * sqrt(spread * spread + surface.z * surface.z));
  normal_out = vec4(ws_N, view.frame.w * width);
  // In the mirror direction the angle to the normal is the viewer's: all that resolve needs of both.
  material_out = vec2(surface.y, dot(ws_N, ws_R));
}
