/**
 * A small export in memory, for tests: every kind of image, a shader, two methods.
 */
import { createHash } from "node:crypto";
import { exact, exrFile } from "./exrFile.js";

export const sum = (bytes) => createHash("sha256").update(new Uint8Array(bytes)).digest("hex");

export function ddsFile(width, height, blocks) {
  const head = Buffer.alloc(128);
  head.write("DDS ", 0, "latin1");
  [124, 0x81007, height, width, (width * height) / 2].forEach((v, i) => head.writeUInt32LE(v, 4 + 4 * i));
  head.writeUInt32LE(32, 76);
  head.writeUInt32LE(4, 80);
  head.write("DXT1", 84, "latin1");
  head.writeUInt32LE(0x1000, 108);
  return exact(Buffer.concat([head, Buffer.from(blocks)]));
}

/** @returns {{manifest: object, files: Map<string, ArrayBuffer>}} */
export function exportFolder() {
  const files = new Map();
  const images = {};
  const shaders = {};
  const put = (bytes, folder, name, ending) => {
    const sha256 = sum(bytes);
    const id = `${name}${sha256.slice(0, 12)}`;
    const file = `${folder}/${id}.${ending}`;
    files.set(file, bytes);
    return [id, { file, bytes: bytes.byteLength, sha256 }];
  };
  const image = (kind, width, height, bytes) => {
    const [id, entry] = put(bytes, "images", `maps_${kind}-`, kind === "bc1" ? "dds" : "exr");
    images[id] = { ...entry, kind, width, height };
    return id;
  };
  const shader = (text) => {
    const bytes = exact(Buffer.from(text));
    const [id, entry] = put(bytes, "shaders", "", "glsl");
    const [, godot] = put(bytes, "shaders", "", "gdshaderinc");
    shaders[id] = { ...entry, godot };
    return id;
  };
  const tx = image("tx", 24, 20, exrFile(24, 20, "half", (x, y, c) => x + 32 * y + c));
  const buf = image("buf", 3, 33, exrFile(3, 33, "float", (x, y, c) => Math.fround(x + 0.1 * y + c)));
  const bc1 = image("bc1", 8, 8, ddsFile(8, 8, Array.from({ length: 32 }, (_, i) => (37 * i) & 255)));
  const answer = shader("void answer(vec3 o, vec3 d, float w, float s, out vec3 r, out float c) { r = d; c = 1.0; }\n");
  const surface = shader("void surface_reflectance(float c, vec3 b, float m, vec3 t, float i, float w, out vec3 r, out float o) { r = b; o = 1.0; }\n");
  const scene = exact(Buffer.from(JSON.stringify({ asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ name: "ball", extensions: { REFLECT_reflections: { reflector: 0 } } }] })));
  files.set("scene.gltf", scene);
  const method = (kind, samplers) => ({ kind, assets: ["ball-0123456789ab"], shader: answer, samplers, slots: [[1, 2, 3, 4], [0, -1, 0.5, 1e-3]], bytes: 4096 });
  const manifest = {
    what: "reflect export",
    format: 1,
    generator: "test",
    scene: { file: "scene.gltf", name: "Scene", bytes: scene.byteLength, sha256: sum(scene) },
    look: { exposure: 0.5, table: null },
    images,
    shaders,
    bakes: { file: "bakes.json", bytes: 100, sha256: "0".repeat(64) },
    materials: [{ name: "Mirror", base_color: [1, 0.9, 0.8], metallic: 1, specular_tint: [1, 1, 1], ior: 1.45, weight: 1, roughness: 0.1 }],
    surface,
    reflectors: [{ name: "ball", node: 0, materials: [0], methods: { environment: method("environment", { asset_maps_tx: tx }), auto: method("box", { asset_maps_bc1: bc1, asset_table_buf: buf }) } }],
    pictures: [{ camera: "Camera", node: 0, width: 64, height: 48, projection: [1.5, 0, 0, 0, 0, 2, 0, 0, 0, 0, -1, -1, 0, 0, -0.2, 0], behind: "pictures/behind-0123456789ab.exr", truth: "pictures/truth-0123456789ab.png", methods: { environment: "pictures/environment-0123456789ab.png" } }],
  };
  return { manifest, files };
}
