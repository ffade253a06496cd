// The picture of a view through a pane as the light that the pane lets through; see shown_in_mirror.frag.glsl for `offset`.
// Alpha 2: a pane, both faces of which mirror (resolve_lib.glsl).
#include "shading"
#include "of_mirror_lib.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 origin = texelFetch(origin_tx, pixel, 0);
  vec4 picture = texelFetch(picture_tx, pixel + ivec2(floor(offset + 0.5)), 0);
  if (!of_mirror(origin, texelFetch(normal_tx, pixel, 0).xyz) || picture.a < 0.5) {
    discard;
    return;
  }
  vec2 seen = texelFetch(material_tx, pixel, 0).rg;
  float cosine = seen.g;
  int row = int(seen.r + 0.5);
  vec4 base = texelFetch(materials_tx, ivec2(0, row), 0);
  vec4 tint = texelFetch(materials_tx, ivec2(1, row), 0);
  float weight = texelFetch(materials_tx, ivec2(2, row), 0).x;
#include "reflectance_call"
#include "both_faces_call"
  through_out = vec4(picture.rgb * pane_through, 2.0);
}
