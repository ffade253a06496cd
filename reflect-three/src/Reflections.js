/**
 * An opened export: its scene, the methods that it can show, and the one that it shows.
 */
import { Group, Mesh } from "three";
import { ReflectError } from "./ReflectError.js";
import { backdrop, hiding, readBehind } from "./backplate.js";
import { cameraOf, mirrorsOf } from "./gltf.js";
import { PICTURE_BYTES } from "./limits.js";
import { LookPass } from "./look.js";
import { Shared, reflectiveMaterial } from "./material.js";
import { Store } from "./store.js";

/** Meshes that are drawn nowhere, for a renderer to compile. */
function likeness(materials) {
  const group = new Group();
  for (const [mesh, material] of materials) group.add(new Mesh(mesh.geometry, material));
  return group;
}

/** What a reflector has for a method: never what all objects have, such as "constructor". */
const answerOf = ({ methods }, method) => (Object.hasOwn(methods, method) ? methods[method] : null);

/** What is shown while another method's images are on their way: a few kilobytes. */
const FIRST = "environment";

export class Reflections {
  /** Use ReflectLoader.load. */
  static async of(gltf, manifest, source, options) {
    const reflectors = [];
    for (const [i, entry] of manifest.reflectors.entries()) reflectors.push({ entry, mirrors: await mirrorsOf(gltf, i, manifest), shown: null });
    return new Reflections(gltf, manifest, source, reflectors, options);
  }

  constructor(gltf, manifest, source, reflectors, { renderer, warn, rays, onProgress }) {
    this.gltf = gltf;
    this.manifest = manifest;
    this.source = source;
    this.rays = rays;
    this.onProgress = onProgress;
    /** @type {import("three").Group} an ordinary scene of three: move, turn and scale it as a whole */
    this.scene = gltf.scene;
    /** @type {string | null} the method that all reflectors show */
    this.shown = null;
    /** @type {Map<import("three").Mesh, import("three").Material>} as glTF has them */
    this.ordinary = new Map();
    this.scene.traverse((object) => object.isMesh && this.ordinary.set(object, object.material));
    this._reflectors = reflectors;
    this._store = new Store(source, manifest, renderer, warn);
    this._shared = new Shared(this.scene);
    this._asked = 0;
    this._backplate = null;
  }

  /** @returns {string[]} the names of all methods that any reflector has */
  get methods() {
    return [...new Set(this.manifest.reflectors.flatMap(({ methods }) => Object.keys(methods)))];
  }

  /** @returns {import("three").Mesh[]} what mirrors */
  get mirrors() {
    return this._reflectors.flatMap(({ mirrors }) => mirrors.map(({ mesh }) => mesh));
  }

  /** Bytes that showing a method takes: to download, what is here already included, and on the graphics card. */
  sizeOf(method) {
    const files = this._files(method);
    const { images } = this.manifest;
    const memory = new Map();
    for (const reflector of this.manifest.reflectors) {
      for (const id of Object.values(answerOf(reflector, method)?.samplers ?? {})) {
        const { kind, width, height, sha256 } = images[id];
        memory.set(sha256, width * height * { tx: 8, look: 8, buf: 16, bc1: this._store.compressed ? 0.5 : 4 }[kind]);
      }
    }
    const sum = (values) => [...values].reduce((a, b) => a + b, 0);
    return { download: sum([...files.values()].map(({ bytes }) => bytes)), memory: sum(memory.values()) };
  }

  /**
   * Shows a method. What is seen stays until a reflector's own images are there; the environment comes first where nothing is shown yet.
   * @param {string | null} method null: three's own mirrors
   * @param {{onProgress?: (progress: import("./ReflectLoader.js").Progress) => void, prepare?: (object: import("three").Object3D) => Promise<void>}} [options]
   *   prepare: of what is shown next, before it is: ReflectOutput.prepare compiles its kernels while the page goes on
   * @returns {Promise<boolean>} false: another one was asked for meanwhile
   */
  async use(method, { onProgress = this.onProgress, prepare = null } = {}) {
    const asked = ++this._asked;
    if (method === null) {
      for (const reflector of this._reflectors) this._wear(reflector, null);
      this.shown = null;
      return true;
    }
    if (!this.methods.includes(method)) throw new ReflectError("reflect.json", "reflectors", `have no method ${method}, only ${this.methods.join(", ")}`);
    if (this.shown === null && method !== FIRST && this.methods.includes(FIRST)) {
      if (!(await this._show(FIRST, asked, onProgress, prepare))) return false;
    }
    return this._show(method, asked, onProgress, prepare);
  }

  /** Frees the images of methods that are not shown. They are fetched again when they are asked for. */
  async release() {
    const shown = new Set([FIRST, this.shown]);
    const { look, reflectors } = this.manifest;
    const used = reflectors.flatMap((reflector) => [...shown].flatMap((name) => Object.values(answerOf(reflector, name)?.samplers ?? {})));
    await this._store.keep(look.table ? [...used, look.table] : used);
  }

  /** @returns {Promise<LookPass>} the Blender scene's view transform, as the last pass of an EffectComposer or for ReflectOutput */
  async lookPass() {
    const { exposure, table } = this.manifest.look;
    return new LookPass(exposure, table === null ? null : await this._store.image(table));
  }

  /** @returns {Promise<import("three").Camera | null>} the camera of a picture */
  cameraOf(picture) {
    return cameraOf(this.gltf, picture);
  }

  /** A file of `pictures`, for an <img>. @returns {Promise<Blob>} */
  async pictureFile(name) {
    return new Blob([await this.source.read(name, PICTURE_BYTES, false)], { type: "image/png" });
  }

  /**
   * For holding against Blender from a picture's camera: Cycles' frame without its mirror part stands behind, in place of three's own shading.
   * @param {import("./checkManifest.js").PictureEntry | null} picture of manifest.pictures; null: three's own shading again
   */
  async showBehind(picture) {
    const texture = picture && (await readBehind(this.source, picture));
    this._clearBehind();
    if (texture) {
      this._backplate = { texture, mesh: backdrop(texture, this._shared), hiding: hiding() };
      this._shared.uniforms.reflect_behind.value = texture;
      this._shared.uniforms.reflect_backplate.value = true;
      this.scene.add(this._backplate.mesh);
    }
    for (const mesh of this.ordinary.keys()) mesh.material = this._materialOf(mesh);
  }

  async dispose() {
    this._asked++;
    this._clearBehind();
    for (const reflector of this._reflectors) this._wear(reflector, null);
    await this._store.dispose();
    for (const [mesh, material] of this.ordinary) {
      mesh.geometry.dispose();
      for (const value of Object.values(material)) if (value?.isTexture) value.dispose();
      material.dispose();
    }
    this.scene.removeFromParent();
  }

  async _show(method, asked, onProgress, prepare) {
    const files = this._files(method);
    const total = [...files.values()].reduce((sum, { bytes }) => sum + bytes, 0);
    let loaded = 0;
    for (const file of files.values()) if (this._store.has(file)) loaded += file.bytes;
    const tell = (bytes) => {
      loaded += bytes;
      if (asked === this._asked) onProgress({ method, loaded: Math.min(loaded, total), total, shown: this.shown });
    };
    tell(0);
    const { images, shaders, surface } = this.manifest;
    const surfaceCode = await this._store.shader(surface, tell);
    await Promise.all(
      this._reflectors.map(async (reflector) => {
        const answer = answerOf(reflector.entry, method);
        if (!answer) return asked === this._asked && this._wear(reflector, null);
        const names = Object.keys(answer.samplers);
        const [code, ...textures] = await Promise.all([
          this._store.shader(answer.shader, tell),
          ...names.map((name) => this._store.image(answer.samplers[name], tell)),
        ]);
        if (asked !== this._asked) return;
        const kernel = {
          key: `${shaders[answer.shader].sha256} ${shaders[surface].sha256}`,
          answer: code,
          surface: surfaceCode,
          textures: Object.fromEntries(names.map((name, i) => [name, textures[i]])),
          slots: answer.slots,
        };
        const materials = this._tailored(reflector, kernel);
        await prepare?.(likeness(materials));
        if (asked === this._asked) this._wear(reflector, materials);
        else for (const material of materials.values()) material.dispose();
      }),
    );
    if (asked !== this._asked) return false;
    this.shown = method;
    tell(0);
    return true;
  }

  /** A kernel's material for each mesh of a reflector. */
  _tailored({ mirrors }, kernel) {
    return new Map(mirrors.map(({ mesh, entry }) => [mesh, reflectiveMaterial(this.ordinary.get(mesh), entry, kernel, this._shared, this.rays)]));
  }

  /** A reflector's meshes get these materials, or with null their own. */
  _wear(reflector, materials) {
    const before = reflector.shown;
    reflector.shown = materials;
    for (const { mesh } of reflector.mirrors) mesh.material = this._materialOf(mesh);
    for (const material of before?.values() ?? []) material.dispose();
  }

  _materialOf(mesh) {
    for (const { shown } of this._reflectors) if (shown?.has(mesh)) return shown.get(mesh);
    return this._backplate ? this._backplate.hiding : this.ordinary.get(mesh);
  }

  _clearBehind() {
    if (!this._backplate) return;
    const { texture, mesh, hiding } = this._backplate;
    mesh.removeFromParent();
    for (const part of [texture, mesh.geometry, mesh.material, hiding]) part.dispose();
    this._backplate = null;
    this._shared.uniforms.reflect_behind.value = null;
    this._shared.uniforms.reflect_backplate.value = false;
  }

  /** What a method's reflectors read, each file once. */
  _files(method) {
    const { images, shaders, surface, reflectors } = this.manifest;
    const files = new Map();
    const add = (file) => files.set(file.sha256, file);
    for (const reflector of reflectors) {
      const answer = answerOf(reflector, method);
      if (!answer) continue;
      add(shaders[answer.shader]);
      for (const id of Object.values(answer.samplers)) add(images[id]);
    }
    if (files.size) add(shaders[surface]);
    return files;
  }
}
