/**
 * The view transform of the Blender scene: exposure, then a table of 64 x 64 x 64 display colours, or the sRGB curve. The last pass of a picture, in place of
 * three's tone mapping (reflect_addon/core/look.py is the reference).
 */
import { ShaderMaterial } from "three";
import { FullScreenQuad, Pass } from "three/addons/postprocessing/Pass.js";

const FRAGMENT = /* glsl */ `
uniform sampler2D tDiffuse;  // scene-linear
uniform highp sampler2D look_table;
uniform float gain;
uniform bool has_table;
varying vec2 at;

vec3 entry(vec3 rgb) { return texelFetch(look_table, ivec2(int(64.0 * rgb.b + rgb.r + 0.5), int(rgb.g + 0.5)), 0).rgb; }

vec3 from_table(vec3 exposed)
{
  const float LINEAR = 0.0078125, TOP = 128.0;
  vec3 along = clamp(log2(exposed / LINEAR + 1.0) / log2(TOP / LINEAR + 1.0), 0.0, 1.0) * 63.0;
  vec3 low = min(floor(along), 62.0), share = along - low;
  vec3 sum = vec3(0.0);
  for (int corner = 0; corner < 8; corner++) {
    vec3 high = vec3(corner & 1, (corner >> 1) & 1, corner >> 2);
    vec3 weights = mix(1.0 - share, share, high);
    sum += weights.r * weights.g * weights.b * entry(low + high);
  }
  return sum;
}

vec3 srgb(vec3 linear) { return mix(1.055 * pow(max(linear, 0.0031308), vec3(1.0 / 2.4)) - 0.055, linear * 12.92, vec3(lessThanEqual(linear, vec3(0.0031308)))); }

void main()
{
  vec4 linear = texture2D(tDiffuse, at);
  // A number that is none, or has no end, must not reach the display as one.
  vec3 exposed = clamp(max(linear.rgb, 0.0) * gain, 0.0, 65504.0);
  gl_FragColor = vec4(has_table ? from_table(exposed) : srgb(min(exposed, 1.0)), linear.a);
}`;

const VERTEX = /* glsl */ `
varying vec2 at;
void main() { at = uv; gl_Position = vec4(position.xy, 1.0, 1.0); }`;

/** For three's EffectComposer, as its last pass; ReflectOutput draws with it without one. */
export class LookPass extends Pass {
  /**
   * @param {number} exposure stops
   * @param {import("three").Texture | null} table
   */
  constructor(exposure = 0, table = null) {
    super();
    this.material = new ShaderMaterial({
      uniforms: { tDiffuse: { value: null }, look_table: { value: table }, has_table: { value: table !== null }, gain: { value: 2 ** exposure } },
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      depthTest: false,
      depthWrite: false,
      toneMapped: false,
    });
    this.quad = new FullScreenQuad(this.material);
  }

  render(renderer, writeBuffer, readBuffer) {
    this.material.uniforms.tDiffuse.value = readBuffer.texture;
    renderer.setRenderTarget(this.renderToScreen ? null : writeBuffer);
    this.quad.render(renderer);
  }

  dispose() {
    this.material.dispose();
    this.quad.dispose();
  }
}
