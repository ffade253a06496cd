#include "normals_lib.glsl"

// Places a mesh that carries its own radiance. Positions are relative to the eye, like surface.vert.glsl's.
void main()
{
  vec4 rel_P = rel_from_object * vec4(position, 1.0);
  mat3 cofactors = cofactors_of(rel_from_object);
  v_normal = cofactors * normal * (dot(rel_from_object[0].xyz, cofactors[0]) < 0.0 ? -1.0 : 1.0);
  v_radiance = radiance;
  v_share = share;
  v_depth = dot(rel_P.xyz, view.forward.xyz);
  gl_Position = view.clip_from_rel * vec4(rel_P.xyz, 1.0);
}
