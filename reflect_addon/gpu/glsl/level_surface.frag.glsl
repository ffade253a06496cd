// What a surface sends out, and where it is, seen from a mirrored view.
void main()
{
  color_out = vec4(v_radiance, 1.0);
  place_out = vec4(view.eye.xyz + v_rel_P, 1.0);
}
