// Places a mesh that carries its own radiance, as capture.vert.glsl does.
void main()
{
  vec4 rel_P = rel_from_object * vec4(position, 1.0);
  v_rel_P = rel_P.xyz;
  v_radiance = radiance;
  gl_Position = view.clip_from_rel * vec4(rel_P.xyz, 1.0);
}
