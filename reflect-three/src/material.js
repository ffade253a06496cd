/**
 * A material of three that mirrors by the export's kernel: a copy, patched through onBeforeCompile, so that a scene stays one of three's own.
 */
import { Matrix4, MeshStandardMaterial, Vector3, Vector4 } from "three";
import { SHADED, kernelSource } from "./glsl.js";

/** Blender's world from glTF's: y up to z up. */
export const BLENDER_FROM_GLTF = new Matrix4().set(1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1);

const viewport = new Vector4();
const rootFromWorld = new Matrix4();
const worldFromView = new Matrix4();

/**
 * What all reflectors of a scene share: where the eye is, how large a pixel is, and the picture that may stand behind.
 */
export class Shared {
  /** @param {import("three").Object3D} root the loaded scene: it may be moved, turned and scaled as a whole */
  constructor(root) {
    this.root = root;
    this.uniforms = {
      reflect_from_view: { value: new Matrix4() },
      reflect_pixel: { value: new Vector3() },
      reflect_backplate: { value: false },
      reflect_behind: { value: null },
    };
  }

  /** Before a draw call; all calls of one frame and camera set the same. */
  update(renderer, camera) {
    const u = this.uniforms;
    rootFromWorld.copy(this.root.matrixWorld).invert();
    worldFromView.copy(camera.matrixWorldInverse).invert(); // not matrixWorld, whose scale three leaves out of its view
    u.reflect_from_view.value.multiplyMatrices(BLENDER_FROM_GLTF, rootFromWorld).multiply(worldFromView);
    renderer.getCurrentViewport(viewport);
    u.reflect_pixel.value.set(2 / (Math.abs(camera.projectionMatrix.elements[5]) * viewport.w), 1 / viewport.z, 1 / viewport.w);
  }
}

/**
 * @param {import("three").Material} base the material of glTF
 * @param {import("./checkManifest.js").MaterialEntry} entry
 * @param {{key: string, answer: string, surface: string, textures: Record<string, import("three").Texture>, slots: number[][]}} kernel
 * @param {Shared} shared
 * @param {number} rays most rays of a pixel, odd
 */
export function reflectiveMaterial(base, entry, kernel, shared, rays) {
  const material = base.isMeshStandardMaterial ? base.clone() : new MeshStandardMaterial({ name: base.name, color: base.color, side: base.side });
  const samplers = Object.keys(kernel.textures);
  const uniforms = {
    ...shared.uniforms,
    reflect_base_color: { value: new Vector3(...entry.base_color) },
    reflect_specular_tint: { value: new Vector3(...entry.specular_tint) },
    reflect_numbers: { value: new Vector4(entry.metallic, entry.ior, entry.weight, entry.roughness) },
  };
  for (const name of samplers) uniforms[name] = { value: kernel.textures[name] };
  if (kernel.slots.length) uniforms.answer_uniforms = { value: { slot: new Float32Array(kernel.slots.flat()) } };
  const source = kernelSource({ answer: kernel.answer, surface: kernel.surface, samplers, slots: kernel.slots.length });

  material.defines = { ...material.defines, REFLECT_RAYS: rays };
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.fragmentShader = `${source}\n${shader.fragmentShader.replace("#include <opaque_fragment>", `${SHADED}\n#include <opaque_fragment>`)}`;
  };
  // Reflectors of one kernel share a program: what differs are uniforms.
  material.customProgramCacheKey = () => `reflect ${kernel.key} ${kernel.slots.length}`;
  material.onBeforeRender = (renderer, scene, camera) => shared.update(renderer, camera);
  return material;
}
