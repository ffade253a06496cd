/**
 * The files of an export as they are asked for, each once: images as textures, shaders as text. What two methods or reflectors share is fetched and held once,
 * by its checksum.
 */
import { ReflectError } from "./ReflectError.js";
import { NO_CHECKSUMS, checkBytes } from "./checksum.js";
import { textureOf } from "./images.js";

const AT_ONCE = 4; // files on the way

export class Store {
  /**
   * @param {import("./sources.js").Source} source
   * @param {import("./checkManifest.js").Manifest} manifest
   * @param {import("three").WebGLRenderer | null} renderer
   * @param {(sentence: string) => void} warn
   */
  constructor(source, manifest, renderer, warn) {
    this.source = source;
    this.manifest = manifest;
    this.renderer = renderer;
    this.warn = warn;
    this.compressed = Boolean(renderer?.extensions.has("WEBGL_compressed_texture_s3tc"));
    this.most = renderer?.capabilities.maxTextureSize ?? Infinity;
    /** @type {Map<string, Promise<import("three").Texture | string>>} by checksum */
    this.held = new Map();
    this.ended = new AbortController();
    this.waiting = [];
    this.running = 0;
    this.decoded = Promise.resolve();
  }

  /** @returns {Promise<import("three").Texture>} */
  image(id, onBytes) {
    const image = this.manifest.images[id];
    return this._once(image, async () => {
      if (Math.max(image.width, image.height) > this.most) {
        throw new ReflectError(image.file, "width or height", `is more than the ${this.most} texels that this graphics card can hold`);
      }
      const bytes = await this.file(image, onBytes);
      // Decoding holds the page up: one image at a time, and between them it may draw.
      return this._decoding(() => textureOf(bytes, image, this.compressed));
    });
  }

  /** @returns {Promise<string>} GLSL */
  shader(id, onBytes) {
    const shader = this.manifest.shaders[id];
    return this._once(shader, async () => {
      const text = new TextDecoder().decode(await this.file(shader, onBytes));
      // What three's own preprocessor would act on, and not the graphics card's compiler.
      if (/#\s*(include|version|extension|pragma)/.test(text)) throw new ReflectError(shader.file, "", "is no kernel");
      return text;
    });
  }

  /** Bytes that the manifest vouches for. */
  async file(promised, onBytes) {
    const bytes = await this._inTurn(() => this.source.read(promised.file, promised.bytes, true, onBytes, this.ended.signal));
    if (!(await checkBytes(bytes, promised.file, promised))) this.warn(NO_CHECKSUMS);
    return bytes;
  }

  /** Whether it is here or on its way. */
  has(promised) {
    return this.held.has(promised.sha256);
  }

  /** Frees every image that is not in `ids`. */
  async keep(ids) {
    const kept = new Set([...ids].map((id) => this.manifest.images[id].sha256));
    for (const image of Object.values(this.manifest.images)) {
      if (!kept.has(image.sha256)) await this._free(image.sha256);
    }
  }

  async dispose() {
    this.ended.abort();
    for (const sum of [...this.held.keys()]) await this._free(sum);
  }

  async _free(sum) {
    const held = this.held.get(sum);
    this.held.delete(sum);
    const value = await held?.catch(() => null);
    value?.dispose?.();
  }

  _once({ sha256 }, make) {
    let held = this.held.get(sha256);
    if (!held) {
      held = make();
      this.held.set(sha256, held);
      // What failed is tried again when it is asked for again.
      held.catch(() => this.held.get(sha256) === held && this.held.delete(sha256));
    }
    return held;
  }

  _decoding(work) {
    const next = this.decoded.then(() => new Promise((go) => setTimeout(go))).then(work);
    this.decoded = next.catch(() => {});
    return next;
  }

  async _inTurn(work) {
    if (this.running >= AT_ONCE) await new Promise((go) => this.waiting.push(go));
    this.running++;
    try {
      return await work();
    } finally {
      this.running--;
      this.waiting.shift()?.();
    }
  }
}
