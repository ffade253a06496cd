// The camera's own rays, for pixels that no reflector will cover [yu-2005 section 6, end].
// pixel: x = the index that stands for the background; yz = 2 over the picture's size, 1/px.
void main()
{
  bool orthographic = view.frame.x > 0.5;
  vec4 ws_near = rel_from_clip * vec4(gl_FragCoord.xy * pixel.yz - 1.0, -1.0, 1.0);
  vec3 ws_start = ws_near.xyz / ws_near.w;
  origin_out = vec4(view.eye.xyz + (orthographic ? ws_start : vec3(0.0)), pixel.x);
  direction_out = vec4(orthographic ? view.forward.xyz : normalize(ws_start), orthographic ? 0.0 : view.frame.y);
  normal_out = vec4(-view.forward.xyz, orthographic ? view.frame.y : 0.0);
  material_out = vec2(-1.0, 0.0);
}
