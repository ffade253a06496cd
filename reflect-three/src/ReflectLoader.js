/**
 * Opens an export: its manifest, checked, and its scene. Reflections come with `use`.
 */
import { Reflections } from "./Reflections.js";
import { MANIFEST } from "./check.js";
import { parseManifest } from "./checkManifest.js";
import { NO_CHECKSUMS, checkBytes } from "./checksum.js";
import { loadScene } from "./gltf.js";
import { MANIFEST_BYTES } from "./limits.js";
import { sourceOf } from "./sources.js";

/**
 * @typedef {{method: string | null, loaded: number, total: number, shown: string | null}} Progress bytes; method: the one on its way, null: the scene itself;
 *   shown: the one that is seen meanwhile
 */

export class ReflectLoader {
  /** @param {import("three").WebGLRenderer | null} [renderer] says what the graphics card can do; without it images are decoded here */
  constructor(renderer = null) {
    this.renderer = renderer;
  }

  /**
   * @param {string | URL | Iterable<File>} from the address of an export's folder (or of its reflect.json), or its files as chosen or dropped
   * @param {{onProgress?: (progress: Progress) => void, onWarning?: (sentence: string) => void, rays?: number}} [options] rays: most rays of a pixel where a
   *   curved mirror stretches it, odd; 7 are those of `reflect render`, 1 suits a window
   * @returns {Promise<Reflections>}
   * @throws {import("./ReflectError.js").ReflectError}
   */
  async load(from, { onProgress = () => {}, onWarning = (sentence) => console.warn(`Reflect: ${sentence}`), rays = 1 } = {}) {
    const said = new Set();
    const warn = (sentence) => said.has(sentence) || (said.add(sentence), onWarning(sentence));
    const source = sourceOf(from);
    const manifest = parseManifest(new TextDecoder().decode(await source.read(MANIFEST, MANIFEST_BYTES, false)));
    let loaded = 0;
    const { scene } = manifest;
    const onBytes = (bytes) => {
      loaded += bytes;
      onProgress({ method: null, loaded, total: Math.max(scene.bytes, loaded), shown: null });
    };
    const bytes = await source.read(scene.file, scene.bytes, true, onBytes);
    if (!(await checkBytes(bytes, scene.file, scene))) warn(NO_CHECKSUMS);
    const gltf = await loadScene(bytes, scene.file, source, onBytes);
    return Reflections.of(gltf, manifest, source, { renderer: this.renderer, warn, rays, onProgress });
  }
}
