// The viewport's picture in place of what surfaces send out, in a mirrored view: found by the place that a pixel shows. Reflectors are left
// to their answers. eye: xyz of the camera that drew the picture, w whether the ray map is of this view.
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 clip = clip_from_rel * vec4(texelFetch(place_tx, pixel, 0).xyz - eye.xyz, 1.0);
  vec2 at = 0.5 + 0.5 * clip.xy / clip.w;
  bool reflects = eye.w > 0.5 && texelFetch(origin_tx, pixel, 0).w > -0.5;
  if (reflects || clip.w <= 0.0 || any(lessThan(at, vec2(0.0))) || any(greaterThan(at, vec2(1.0)))) {
    discard;
    return;
  }
  color_out = vec4(clamp(texture(viewport_tx, at).rgb, -65504.0, 65504.0), 1.0);
}
