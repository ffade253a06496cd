/**
 * A picture behind the reflections, for holding them against Blender: Cycles' frame without its mirror part is shown as it is, other things only hide what is
 * behind them, and reflectors add what they mirror.
 */
import { BufferAttribute, BufferGeometry, DoubleSide, LinearFilter, Mesh, MeshBasicMaterial, ShaderMaterial } from "three";
import { ReflectError } from "./ReflectError.js";
import { checkExr, exrHeader } from "./exrHeader.js";
import { exrTexture } from "./images.js";
import { FILE_BYTES } from "./limits.js";

/** @returns {Promise<import("three").DataTexture>} scene-linear */
export async function readBehind(source, { behind, width, height }) {
  const bytes = await source.read(behind, Math.min(8 * width * height + 2 ** 20, FILE_BYTES), false);
  const { channels } = exrHeader(bytes, behind);
  const names = channels.map(({ name }) => name).join("");
  if (names !== "BGR" && names !== "ABGR") throw new ReflectError(behind, "the header's channels", "are not R, G and B");
  checkExr(bytes, behind, { width, height, type: "half", channels: names });
  const texture = exrTexture(bytes, behind, "half", { width, height });
  texture.minFilter = texture.magFilter = LinearFilter; // the window may have another size than the picture
  return texture;
}

/** The picture on the whole canvas, before anything else. */
export function backdrop(texture, shared) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
  const material = new ShaderMaterial({
    uniforms: { ...shared.uniforms, reflect_behind: { value: texture } },
    vertexShader: "void main() { gl_Position = vec4(position.xy, 1.0, 1.0); }",
    fragmentShader: `uniform sampler2D reflect_behind; uniform vec3 reflect_pixel;
      void main() { gl_FragColor = vec4(texture2D(reflect_behind, gl_FragCoord.xy * reflect_pixel.yz).rgb, 1.0); }`,
    depthTest: false,
    depthWrite: false,
    toneMapped: false,
  });
  material.onBeforeRender = (renderer, scene, camera) => shared.update(renderer, camera);
  const mesh = new Mesh(geometry, material);
  mesh.frustumCulled = false;
  mesh.renderOrder = -Infinity;
  return mesh;
}

/** What does not mirror: nothing of it is seen, but it is in the way. */
export const hiding = () => new MeshBasicMaterial({ colorWrite: false, side: DoubleSide });
