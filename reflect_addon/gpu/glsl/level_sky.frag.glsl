// The sky behind the surfaces of a mirrored view. pixel: 2 over the picture's size, 1/px.
#include "kernel"

void main()
{
  vec4 near = rel_from_clip * vec4(gl_FragCoord.xy * pixel - 1.0, -1.0, 1.0);
  vec3 direction = (view.frame.x > 0.5) ? view.forward.xyz : normalize(near.xyz / near.w);
#include "call"
  color_out = vec4(clamp(sky_radiance, -65504.0, 65504.0), 1.0);
  place_out = vec4(view.eye.xyz + direction * FAR, 1.0);
}
