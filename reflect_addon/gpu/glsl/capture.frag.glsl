// What a surface sends out, seen from a capture's camera: premultiplied colour, and the world normal with the depth along
// the camera's axis, m. Alpha 1 where there is something: the contour is the rasteriser's, at texel centres.
void main()
{
  color_out = vec4(v_radiance, 1.0);
  float size = length(v_normal);
  normal_out = vec4((size > 0.0) ? v_normal / size : vec3(0.0), v_depth);
}
