#include "normals_lib.glsl"

// Places a mesh. Positions are relative to the eye ("rel_"): the matrix was multiplied in float64 on the CPU, so a scene
// far from the world's origin loses no digits.
void main()
{
  vec4 rel_P = rel_from_object * vec4(position, 1.0);
  mat3 cofactors = cofactors_of(rel_from_object);
  v_rel_P = rel_P.xyz;
  v_normal = cofactors * normal;
  v_face_normal = cofactors * face_normal;
  gl_Position = view.clip_from_rel * vec4(rel_P.xyz, 1.0);
  // Towards the viewer by this much of the depth range: the viewport's own depth of the same surface must not win.
  gl_Position.z -= view.frame.z * gl_Position.w;
}
