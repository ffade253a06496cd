/**
 * The fragment shader's part of a reflector, around the export's kernel: the mirror ray of a pixel and what the surface makes of its answer
 * (docs/export-format.md, "The mirror ray of a pixel"). All of it is in Blender's world space.
 */

/**
 * Declarations, kernel and helpers, to stand before three's own.
 * @param {{answer: string, surface: string, samplers: string[], slots: number}} kernel
 */
export function kernelSource({ answer, surface, samplers, slots }) {
  return [
    "// Reflect: a kernel of the export, and what it reads.",
    ...samplers.map((name) => `uniform highp sampler2D ${name};`),
    slots ? `struct AnswerUniforms { vec4 slot[${slots}]; };\nuniform AnswerUniforms answer_uniforms;` : "",
    answer,
    surface,
    HELPERS,
  ].join("\n");
}

const HELPERS = /* glsl */ `
uniform mat4 reflect_from_view;   // Blender's world from three's view space
uniform vec3 reflect_pixel;       // x: size of a pixel at 1 m (orthographic: anywhere); yz: 1 / the picture's pixels
uniform vec3 reflect_base_color;
uniform vec3 reflect_specular_tint;
uniform vec4 reflect_numbers;     // metallic, ior, weight, roughness
uniform bool reflect_backplate;   // the surface's own light comes from a picture
uniform sampler2D reflect_behind;

vec3 reflect_unit_or(vec3 v, vec3 other)
{
  float length_squared = dot(v, v);
  return (length_squared > 1e-12) ? v * inversesqrt(length_squared) : other;
}

// The mean of the rays that a pixel sends along the line that a curved surface stretches it; one in a window.
// turned_x, turned_y: what R changes by from pixel to pixel; moved_x, moved_y: what P does.
void reflect_answer(vec3 P, vec3 R, vec3 turned_x, vec3 turned_y, vec3 moved_x, vec3 moved_y, float width, float spread, float lobe,
                    out vec3 radiance, out float coverage)
{
  float rays, each_width, each_spread;
  vec2 line;
  rays_of_pixel(turned_x, turned_y, width, spread, float(REFLECT_RAYS), rays, line, each_width, each_spread);
  each_spread = sqrt(each_spread * each_spread + lobe * lobe);
  vec3 turned = line.x * turned_x + line.y * turned_y;
  vec3 moved = line.x * moved_x + line.y * moved_y;
  vec3 sum = vec3(0.0);
  float known = 0.0;
  for (int i = 0; i < REFLECT_RAYS; i++) {
    if (float(i) > rays - 0.5) break;
    float along = (float(i) + 0.5) / rays - 0.5;
    answer(P + along * moved, normalize(R + along * turned), each_width, each_spread, radiance, coverage);
    sum += clamp(radiance, -65504.0, 65504.0) * coverage;
    known += coverage;
  }
  radiance = sum / max(known, 1e-6);
  coverage = known / rays;
}

// rel: the surface point in view space; normals in view space, the shading normal turned as the seen side of the triangle is.
void reflect_surface(vec3 rel, vec3 vs_face, vec3 vs_N, bool orthographic, out vec3 added, out float covered, out float opacity)
{
  mat3 turn = mat3(reflect_from_view);
  vec3 P = (reflect_from_view * vec4(rel, 1.0)).xyz;
  vec3 view = reflect_unit_or(turn * (orthographic ? vec3(0.0, 0.0, -1.0) : rel), vec3(0.0, 0.0, -1.0));
  vec3 face = reflect_unit_or(turn * vs_face, -view);
  vec3 N = reflect_unit_or(turn * vs_N, face);
  if (dot(face, view) > 0.0) face = -face;
  vec3 R = view - 2.0 * min(dot(view, N), 0.0) * N;

  vec3 turned_x = dFdx(R), turned_y = dFdy(R);
  vec3 moved_x = dFdx(P), moved_y = dFdy(P);
  float spread = sqrt(0.5 * (dot(turned_x, turned_x) + dot(turned_y, turned_y)));
  if (!(spread < 2.0)) spread = 2.0;

  float lowest = min(0.5 * max(-dot(face, view), 0.0), 0.01);
  float height = dot(R, face);
  if (height < lowest) {
    R = normalize(R + (lowest - height) * face);
    N = reflect_unit_or(R - view, face);
  }
  R = normalize(R);
  float depth = length(turn[2]) * -rel.z;  // in Blender's metres, however the scene is scaled
  float width = reflect_pixel.x * (orthographic ? length(turn[2]) : max(depth, 0.0));
  float lobe = 4.0 * reflect_numbers.w * reflect_numbers.w;

  vec3 radiance, reflectance;
  reflect_answer(P, R, turned_x, turned_y, moved_x, moved_y, width, spread, lobe, radiance, covered);
  surface_reflectance(dot(N, R), reflect_base_color, reflect_numbers.x, reflect_specular_tint, reflect_numbers.y, reflect_numbers.z, reflectance, opacity);
  added = radiance * reflectance * covered;
  opacity = clamp(opacity, 0.0, 1.0) * covered;
}
`;

/** In the main function, after three's shading and before what it makes of the result. */
export const SHADED = /* glsl */ `
#ifdef FLAT_SHADED
  vec3 reflect_normal = normalize(cross(dFdx(vViewPosition), dFdy(vViewPosition)));
#else
  vec3 reflect_normal = vNormal * (gl_FrontFacing ? 1.0 : -1.0);
#endif
  vec3 reflect_added;
  float reflect_covered, reflect_opacity;
  reflect_surface(-vViewPosition, cross(dFdx(vViewPosition), dFdy(vViewPosition)), reflect_normal, isOrthographic,
                  reflect_added, reflect_covered, reflect_opacity);
  if (reflect_backplate) {
    outgoingLight = texture(reflect_behind, gl_FragCoord.xy * reflect_pixel.yz).rgb + reflect_added;
  } else {
    // The export's reflection in place of three's mirror of environment and lamps.
    outgoingLight = totalDiffuse * (1.0 - reflect_opacity) + totalSpecular * (1.0 - reflect_covered) + totalEmissiveRadiance + reflect_added;
  }
`;
