// Places a mesh that carries its own radiance. Positions are relative to the eye, like surface.vert.glsl's.
void main()
{
  vec4 rel_P = rel_from_object * vec4(position, 1.0);
  mat3 linear_part = mat3(rel_from_object);
  vec3 size = max(abs(linear_part[0]), max(abs(linear_part[1]), abs(linear_part[2])));
  linear_part /= max(max(size.x, max(size.y, size.z)), 1e-30);
  // Cofactors carry normals: the inverse transpose without its division, whose sign turns with a mirrored mesh.
  mat3 cofactors = mat3(cross(linear_part[1], linear_part[2]),
                        cross(linear_part[2], linear_part[0]),
                        cross(linear_part[0], linear_part[1]));
  v_normal = cofactors * normal * (dot(linear_part[0], cofactors[0]) < 0.0 ? -1.0 : 1.0);
  v_radiance = radiance;
  v_depth = dot(rel_P.xyz, view.forward.xyz);
  gl_Position = view.clip_from_rel * vec4(rel_P.xyz, 1.0);
}
