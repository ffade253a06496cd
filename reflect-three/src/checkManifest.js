/**
 * The manifest of an export, `reflect.json`, before anything of it is believed: structure, names, sizes, indices, numbers and how much memory it would take.
 * Nothing is read, evaluated or allocated here, and nothing of three is needed. docs/export-format.md is the contract.
 */
import { MANIFEST, allFinite, entry, fileName, idOf, list, number, object, record, refuse, sha256, text, whole, word } from "./check.js";
import { ReflectError } from "./ReflectError.js";
import { BAKES, DEFLATE, FILE_BYTES, FORMAT, IMAGES_BYTES, KINDS, MANIFEST_BYTES, NODE, SCENE, SCENE_BYTES, SHADER_BYTES, SIDE, SLOTS } from "./limits.js";

/** Within format 1 there are these fields and no others. */
const FIELDS = {
  manifest: ["what", "format", "generator", "scene", "look", "images", "shaders", "bakes", "materials", "surface", "reflectors", "pictures"],
  bakes: ["file", "bytes", "sha256"],
  scene: ["file", "name", "bytes", "sha256"],
  image: ["file", "kind", "width", "height", "bytes", "sha256"],
  shader: ["file", "bytes", "sha256", "godot"],
  text: ["file", "bytes", "sha256"],
  material: ["name", "base_color", "metallic", "specular_tint", "ior", "weight", "roughness"],
  reflector: ["name", "node", "materials", "methods"],
  method: ["kind", "assets", "shader", "samplers", "slots", "bytes"],
  picture: ["camera", "node", "width", "height", "projection", "behind", "truth", "methods"],
};
const SAMPLER = /^(?!gl_)(?!.*__)[A-Za-z][A-Za-z0-9_]{0,79}$/;

/**
 * @typedef {{file: string, kind: "tx"|"buf"|"bc1"|"look", width: number, height: number, bytes: number, sha256: string}} ImageEntry
 * @typedef {{file: string, bytes: number, sha256: string}} FileEntry
 * @typedef {{name: string, base_color: number[], metallic: number, specular_tint: number[], ior: number, weight: number, roughness: number}} MaterialEntry
 * @typedef {{kind: string, assets: string[], shader: string, samplers: Record<string, string>, slots: number[][], bytes: number}} MethodEntry
 * @typedef {{name: string, node: number, materials: number[], methods: Record<string, MethodEntry>}} ReflectorEntry
 * @typedef {{camera: string, node: number, width: number, height: number, projection: number[], behind: string, truth: string, methods: Record<string, string>}} PictureEntry
 * @typedef {{what: string, format: number, generator: string, scene: FileEntry, look: {exposure: number, table: string|null},
 *   images: Record<string, ImageEntry>, shaders: Record<string, FileEntry & {godot: FileEntry}>, bakes: FileEntry, materials: MaterialEntry[],
 *   surface: string, reflectors: ReflectorEntry[], pictures: PictureEntry[]}} Manifest
 */

/**
 * @param {string} json the text of reflect.json
 * @returns {Manifest} what it says, checked
 */
export function parseManifest(json) {
  if (json.length > MANIFEST_BYTES) throw new ReflectError(MANIFEST, "", `is longer than ${MANIFEST_BYTES} bytes`);
  let value;
  try {
    value = JSON.parse(json);
  } catch {
    throw new ReflectError(MANIFEST, "", "is not JSON");
  }
  return checkManifest(value);
}

/**
 * @param {unknown} value what JSON.parse made of reflect.json
 * @returns {Manifest} the same object
 */
export function checkManifest(value) {
  const manifest = /** @type {Manifest} */ (object(value, "the whole"));
  if (manifest.what !== "reflect export") refuse("what", 'is not "reflect export"');
  whole(manifest.format, "format", 1, Number.MAX_SAFE_INTEGER);
  if (manifest.format > FORMAT) refuse("format", `is ${manifest.format}, and this loader knows ${FORMAT}`);
  record(manifest, "the whole", FIELDS.manifest);
  allFinite(manifest);
  text(manifest.generator, "generator");
  checkScene(record(manifest.scene, "scene", FIELDS.scene));
  checkImages(object(manifest.images, "images"));
  checkShaders(object(manifest.shaders, "shaders"));
  checkLook(record(manifest.look, "look", ["exposure", "table"]), manifest);
  checkBakes(record(manifest.bakes, "bakes", FIELDS.bakes));
  list(manifest.materials, "materials").forEach(checkMaterial);
  entry(manifest.shaders, manifest.surface, "surface");
  list(manifest.reflectors, "reflectors").forEach((reflector, i) => checkReflector(reflector, `reflectors[${i}]`, manifest));
  list(manifest.pictures, "pictures").forEach((picture, i) => checkPicture(picture, `pictures[${i}]`));
  return manifest;
}

function checkScene(scene) {
  if (scene.file !== SCENE) refuse("scene.file", `is not ${SCENE}`);
  text(scene.name, "scene.name");
  whole(scene.bytes, "scene.bytes", 1, SCENE_BYTES);
  sha256(scene.sha256, "scene.sha256");
}

function checkImages(images) {
  let total = 0;
  for (const [id, image] of Object.entries(images)) {
    const field = `images.${id}`;
    record(image, field, FIELDS.image);
    if (!Object.hasOwn(KINDS, text(image.kind, `${field}.kind`))) refuse(`${field}.kind`, `is none of ${Object.keys(KINDS).join(", ")}`);
    const kind = KINDS[image.kind];
    fileName(image.file, `${field}.file`, "images", kind.exr ? [".exr", ".ktx2"] : [".dds"]);
    idOf(id, image.file, `${field}.file`);
    whole(image.width, `${field}.width`, 1, SIDE);
    whole(image.height, `${field}.height`, 1, SIDE);
    if (!kind.exr && (image.width % 4 || image.height % 4)) refuse(`${field}.width or height`, "is no multiple of 4, as blocks are");
    whole(image.bytes, `${field}.bytes`, 1, FILE_BYTES);
    const texels = (image.width * image.height * kind.bits) / 8;
    if (texels > DEFLATE * image.bytes) refuse(`${field}.bytes`, "are fewer than any compression makes of its texels");
    // A compressed file is never much larger than its texels.
    if (image.bytes > 2 * texels + 2 ** 20) refuse(`${field}.bytes`, `is ${image.bytes}, more than its texels need`);
    sha256(image.sha256, `${field}.sha256`, image.file);
    total += texels;
    if (total > IMAGES_BYTES) refuse("images", `are together larger than ${IMAGES_BYTES / 2 ** 30} GiB`);
  }
}

function checkShaders(shaders) {
  for (const [id, shader] of Object.entries(shaders)) {
    checkText(record(shader, `shaders.${id}`, FIELDS.shader), `shaders.${id}`, ".glsl");
    idOf(id, shader.file, `shaders.${id}.file`);
    // Another program's, which is not fetched here.
    checkText(record(shader.godot, `shaders.${id}.godot`, FIELDS.text), `shaders.${id}.godot`, ".gdshaderinc");
  }
}

function checkText({ file, bytes, sha256: sum }, field, ending) {
  fileName(file, `${field}.file`, "shaders", [ending]);
  whole(bytes, `${field}.bytes`, 1, SHADER_BYTES);
  sha256(sum, `${field}.sha256`, file);
}

function checkLook(look, { images }) {
  number(look.exposure, "look.exposure", -64, 64);
  if (look.table === null) return;
  const table = entry(images, look.table, "look.table");
  if (table.kind !== "look" || table.width !== 4096 || table.height !== 64) refuse("look.table", "is no look of 4096 x 64 texels");
}

/** What only Reflect reads: that its name is right is all that is asked. */
function checkBakes(bakes) {
  if (bakes.file !== BAKES) refuse("bakes.file", `is not ${BAKES}`);
  whole(bakes.bytes, "bakes.bytes", 1, SCENE_BYTES);
  sha256(bakes.sha256, "bakes.sha256");
}

function checkMaterial(material, i) {
  const field = `materials[${i}]`;
  record(material, field, FIELDS.material);
  text(material.name, `${field}.name`);
  for (const colour of ["base_color", "specular_tint"]) {
    list(material[colour], `${field}.${colour}`, 3).forEach((x, c) => number(x, `${field}.${colour}[${c}]`, 0, 1e6));
  }
  number(material.metallic, `${field}.metallic`);
  number(material.ior, `${field}.ior`, 1e-6);
  number(material.weight, `${field}.weight`);
  number(material.roughness, `${field}.roughness`);
}

function checkReflector(reflector, field, manifest) {
  text(record(reflector, field, FIELDS.reflector).name, `${field}.name`);
  whole(reflector.node, `${field}.node`, 0, NODE);
  for (const [i, index] of list(reflector.materials, `${field}.materials`).entries()) {
    whole(index, `${field}.materials[${i}]`, 0, manifest.materials.length - 1);
  }
  for (const [name, method] of Object.entries(object(reflector.methods, `${field}.methods`))) {
    word(name, `${field}.methods.${name}`);
    checkMethod(method, `${field}.methods.${name}`, manifest);
  }
}

function checkMethod(method, field, { shaders, images }) {
  word(record(method, field, FIELDS.method).kind, `${field}.kind`);
  if (list(method.assets, `${field}.assets`).length === 0) refuse(`${field}.assets`, "are none");
  list(method.assets, `${field}.assets`).forEach((id, i) => text(id, `${field}.assets[${i}]`, 100));
  entry(shaders, method.shader, `${field}.shader`);
  for (const [name, image] of Object.entries(object(method.samplers, `${field}.samplers`))) {
    // It becomes a word of a shader, so it must be one.
    if (!SAMPLER.test(name)) refuse(`${field}.samplers`, `has the name "${name.slice(0, 40)}", which no sampler can have`);
    entry(images, image, `${field}.samplers.${name}`);
  }
  if (list(method.slots, `${field}.slots`).length > SLOTS) refuse(`${field}.slots`, `has more than ${SLOTS} entries`);
  for (const [i, slot] of method.slots.entries()) {
    list(slot, `${field}.slots[${i}]`, 4).forEach((x, c) => number(x, `${field}.slots[${i}][${c}]`));
  }
  whole(method.bytes, `${field}.bytes`, 0, IMAGES_BYTES);
}

function checkPicture(picture, field) {
  text(record(picture, field, FIELDS.picture).camera, `${field}.camera`);
  whole(picture.node, `${field}.node`, 0, NODE);
  whole(picture.width, `${field}.width`, 1, SIDE);
  whole(picture.height, `${field}.height`, 1, SIDE);
  list(picture.projection, `${field}.projection`, 16).forEach((x, i) => number(x, `${field}.projection[${i}]`));
  fileName(picture.behind, `${field}.behind`, "pictures", [".exr"]);
  fileName(picture.truth, `${field}.truth`, "pictures", [".png"]);
  for (const [name, file] of Object.entries(object(picture.methods, `${field}.methods`))) {
    word(name, `${field}.methods.${name}`);
    fileName(file, `${field}.methods.${name}`, "pictures", [".png"]);
  }
}
