/**
 * The scene of an export through three's own GLTFLoader, held to the export's folder; and which of its meshes mirror.
 */
import { LoadingManager } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { ReflectError } from "./ReflectError.js";
import { BUFFER_BYTES, EMPTY_VALUES, PICTURE_BYTES, VALUES } from "./limits.js";

// The folder is where Blender's exporter puts pictures.
const PLAIN = /^(?:textures\/)?(?!\.)[^/\\:\u0000-\u001f]{1,255}$/;

/**
 * @param {ArrayBuffer} bytes scene.gltf, checked
 * @param {string} file its name
 * @param {import("./sources.js").Source} source
 * @param {(bytes: number) => void} onBytes
 */
export async function loadScene(bytes, file, source, onBytes) {
  const json = documentOf(bytes, file);
  const urls = new Map();
  try {
    // Buffers and pictures are read here and handed over as blobs, so that GLTFLoader itself fetches nothing.
    checkCounts(json, file);
    for (const { field, uri, most } of outside(json, file)) {
      const name = nameOf(uri, file, field);
      if (!urls.has(uri)) urls.set(uri, URL.createObjectURL(new Blob([await source.read(name, most, false, onBytes)])));
    }
    const manager = new LoadingManager();
    manager.setURLModifier((url) => {
      if (/^(data|blob):/.test(url)) return url;
      const blob = urls.get(url);
      if (!blob) throw new ReflectError(file, "a uri", `is "${url.slice(0, 60)}", which no buffer or image of it has`);
      return blob;
    });
    return await new GLTFLoader(manager).parseAsync(bytes, "");
  } catch (error) {
    if (error instanceof ReflectError) throw error;
    throw new ReflectError(file, "", `cannot be read as glTF (${String(error?.message ?? error).split("\n")[0].slice(0, 160)})`);
  } finally {
    for (const url of urls.values()) URL.revokeObjectURL(url);
  }
}

function documentOf(bytes, file) {
  try {
    const view = new DataView(bytes);
    const binary = bytes.byteLength > 20 && view.getUint32(0, true) === 0x46546c67;
    const text = binary ? new Uint8Array(bytes, 20, view.getUint32(12, true)) : new Uint8Array(bytes);
    return JSON.parse(new TextDecoder().decode(text));
  } catch {
    throw new ReflectError(file, "", "is not glTF");
  }
}

/** The files that a glTF names: buffers are as long as it says, pictures as long as pictures may be. */
function* outside(json, file) {
  for (const table of ["buffers", "images"]) {
    for (const [i, value] of (Array.isArray(json[table]) ? json[table] : []).entries()) {
      const field = `${table}[${i}]`;
      const most = table === "buffers" ? value?.byteLength : PICTURE_BYTES;
      if (!(Number.isSafeInteger(most) && most > 0 && most <= BUFFER_BYTES)) throw new ReflectError(file, `${field}.byteLength`, `is not between 1 and ${BUFFER_BYTES}`);
      const { uri } = value;
      if (uri !== undefined && !/^data:/i.test(String(uri))) yield { field: `${field}.uri`, uri: String(uri), most };
    }
  }
}

/** Three takes memory for as many values as an accessor counts, whether a buffer has them or not. */
function checkCounts(json, file) {
  for (const [i, accessor] of (Array.isArray(json.accessors) ? json.accessors : []).entries()) {
    const most = accessor?.bufferView === undefined ? EMPTY_VALUES : VALUES;
    if (!(Number.isSafeInteger(accessor?.count) && accessor.count > 0 && accessor.count <= most)) throw new ReflectError(file, `accessors[${i}].count`, `is not between 1 and ${most}`);
  }
}

function nameOf(uri, file, field) {
  let name = "";
  try {
    name = decodeURIComponent(uri);
  } catch {
    // Refused below: a name is never empty.
  }
  if (!PLAIN.test(name)) throw new ReflectError(file, field, `is "${uri.slice(0, 60)}", which is no plain name in the export`);
  return name;
}

/**
 * The meshes of a reflector that mirror, each with its material of the manifest.
 * @returns {Promise<{mesh: import("three").Mesh, entry: import("./checkManifest.js").MaterialEntry}[]>}
 */
export async function mirrorsOf(gltf, index, manifest) {
  const { parser } = gltf;
  const reflector = manifest.reflectors[index];
  const node = await nodeOf(gltf, reflector.node, `reflectors[${index}]`);
  if (parser.json.nodes[reflector.node].extensions?.REFLECT_reflections?.reflector !== index) {
    throw new ReflectError("reflect.json", `reflectors[${index}].node`, "is a node that does not name this reflector back");
  }
  const entries = new Map(reflector.materials.map((i) => [manifest.materials[i].name, manifest.materials[i]]));
  // A mesh of several materials is a group; other children are nodes of their own.
  const meshes = [node, ...node.children].filter((object) => object.isMesh && (object === node || parser.associations.get(object)?.nodes === undefined));
  const found = [];
  for (const mesh of meshes) {
    const material = parser.associations.get(mesh.material)?.materials;
    const entry = entries.get(material === undefined ? mesh.material.name : parser.json.materials[material].name);
    if (entry) found.push({ mesh, entry });
  }
  return found;
}

/** @returns {Promise<import("three").Object3D>} */
export async function nodeOf(gltf, index, field) {
  if (!(index < (gltf.parser.json.nodes?.length ?? 0))) throw new ReflectError("reflect.json", `${field} node`, `is ${index}, and the scene has no such node`);
  return gltf.parser.getDependency("node", index);
}

/**
 * The camera of a picture, which stands where glTF says and projects as the manifest says: glTF knows neither the picture's shape nor a shifted lens.
 * @returns {Promise<import("three").Camera | null>}
 */
export async function cameraOf(gltf, { node, width, height, projection }) {
  let found = null;
  (await nodeOf(gltf, node, "pictures'")).traverse((object) => (found ??= object.isCamera ? object : null));
  if (!found) return null;
  if (found.isPerspectiveCamera) [found.aspect, found.fov] = [width / height, (Math.atan(1 / projection[5]) * 360) / Math.PI];
  found.projectionMatrix.fromArray(projection);
  found.projectionMatrixInverse.copy(found.projectionMatrix).invert();
  return found;
}
