// The viewport: a reflector's own surface again, against the viewport's depth. Display-linear, premultiplied.
// The viewport adds this after its view transform, where the scene behind can only be dimmed: exact for metals, and
// for dielectrics as near as adding after the transform is to adding before it (the same under Standard).
#include "resolve_lib.glsl"
#include "look"

void main()
{
  Resolved resolved = resolve(ivec2(gl_FragCoord.xy));
  if (abs(resolved.reflector - surface.x) > 0.5) {
    discard;
    return;
  }
  overlay_out = vec4(display_linear(resolved.radiance), resolved.opacity);
}
