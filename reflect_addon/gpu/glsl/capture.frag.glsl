// What a surface sends out, seen from a capture's camera: premultiplied colour, and the world normal times the share that
// mirrors, with relief.x * depth + relief.y, depth in m along the camera's axis. Alpha 1 where there is something: the contour is the rasteriser's, at texel centres.
void main()
{
  color_out = vec4(v_radiance, 1.0);
  float size = length(v_normal);
  normal_out = vec4((size > 0.0) ? v_normal * (v_share / size) : vec3(0.0), v_depth * relief.x + relief.y);
}
