// What reflectors add to a mirrored view, and in alpha how much of their own light that covers (second_order.mirror_terms): blended
// over the surfaces. A metal's own light is what it emits, and stays.
#include "resolve_lib.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  Resolved resolved = resolve(pixel);
  if (resolved.reflector < -0.5) {
    discard;
    return;
  }
  int row = int(texelFetch(material_tx, pixel, 0).r + 0.5);
  float metal = texelFetch(materials_tx, ivec2(0, row), 0).a * texelFetch(materials_tx, ivec2(2, row), 0).x;
  light_out = vec4(resolved.radiance, max(resolved.opacity - metal, 0.0));
}
