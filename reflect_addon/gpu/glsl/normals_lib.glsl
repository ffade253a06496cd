// Carries normals by a matrix's cofactors: the inverse transpose without its division. Scaled first so that 1e-4 and 1e4
// both fit. A mirrored matrix turns them round.
mat3 cofactors_of(mat4 matrix)
{
  mat3 linear_part = mat3(matrix);
  vec3 size = max(abs(linear_part[0]), max(abs(linear_part[1]), abs(linear_part[2])));
  linear_part /= max(max(size.x, max(size.y, size.z)), 1e-30);
  return mat3(cross(linear_part[1], linear_part[2]),
              cross(linear_part[2], linear_part[0]),
              cross(linear_part[0], linear_part[1]));
}
