// A depth map's texels from its capture: colour and normal continued a little beyond the outline, since a hit at the very
// edge may look beside it (core/pull_push.py, its finest CONTINUED levels), and the depth as q of core/depth_camera.py.
// range: x = hither, y = yon, m. Where nothing is seen q is BACKGROUND.

void main()
{
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 color = texelFetch(captured_tx, at, 0);
  vec4 seen = texelFetch(relief_tx, at, 0);
  vec3 normal = seen.xyz;
  float q = (range.y - seen.w) * range.x / ((range.y - range.x) * max(seen.w, 1e-30));
  float depth = (color.a > 0.0) ? clamp(q, 0.0, 1.0) : BACKGROUND;
  for (int level = 1; level <= CONTINUED && color.a < 1.0; level++) {
    int side = 1 << level;
    ivec2 corner = (at >> level) << level;
    vec4 mean = vec4(0.0);
    vec3 turned = vec3(0.0);
    for (int y = 0; y < side; y++) {
      for (int x = 0; x < side; x++) {
        mean += texelFetch(captured_tx, corner + ivec2(x, y), 0);
        turned += texelFetch(relief_tx, corner + ivec2(x, y), 0).xyz;
      }
    }
    float share = (1.0 - color.a) / float(side * side);
    color += share * mean;
    normal += share * turned;
  }
  color_out = color;
  normal_out = vec4(normal, 0.0);
  depth_out = depth;
}
