// Tables in images of COLUMNS columns.
ivec2 texel_of(int index)
{
  return ivec2(index % COLUMNS, index / COLUMNS);
}

// A point of an instance (w) in the space that `placing_buf` leads to: three rows of a matrix for each instance.
vec3 placed(sampler2D placing, vec4 point)
{
  int row = int(point.w + 0.5);
  vec4 p = vec4(point.xyz, 1.0);
  return vec3(
      dot(texelFetch(placing, ivec2(0, row), 0), p),
      dot(texelFetch(placing, ivec2(1, row), 0), p),
      dot(texelFetch(placing, ivec2(2, row), 0), p));
}
