import assert from "node:assert/strict";
import test from "node:test";
import { loadScene, mirrorsOf } from "../src/gltf.js";
import { exportFolder } from "./exportFolder.js";
import { exact } from "./exrFile.js";
import { isSentence } from "./sentence.js";

const nothing = { read: () => assert.fail("nothing is to be read") };
const scene = (change) => {
  const json = { asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ name: "ball", extensions: { REFLECT_reflections: { reflector: 0 } } }], ...change };
  return exact(Buffer.from(JSON.stringify(json)));
};
const load = (change) => loadScene(scene(change), "scene.gltf", nothing, () => {});

globalThis.ProgressEvent ??= class ProgressEvent extends Event {}; // three's loader of files asks for it, and node has none

test("a scene, and a reflector's node without a mesh", async () => {
  const gltf = await load({});
  const { manifest } = exportFolder();
  assert.deepEqual(await mirrorsOf(gltf, 0, manifest), []);
  await assert.rejects(mirrorsOf(await load({ nodes: [{}] }), 0, manifest), /reflectors\[0\]\.node is a node that does not name this reflector back/);
  manifest.reflectors[0].node = 7;
  await assert.rejects(mirrorsOf(gltf, 0, manifest), /node is 7, and the scene has no such node/);
});

test("files outside of the export are refused before they are asked for", async () => {
  for (const uri of ["https://example.com/a.bin", "//example.com/a.bin", "../a.bin", "%2e%2e/a.bin", "a/b.bin", "/etc/passwd", "file:///etc/passwd", "", "textures/../a.bin", "%"]) {
    await assert.rejects(load({ buffers: [{ uri, byteLength: 4 }] }), isSentence, uri);
    await assert.rejects(load({ images: [{ uri }] }), isSentence, uri);
  }
});

test("names of files may have what an address has not", async () => {
  const asked = [];
  const source = { read: async (name) => asked.push(name) && new ArrayBuffer(4) };
  await loadScene(scene({ buffers: [{ uri: "rock%20%231%3F.bin", byteLength: 4 }] }), "scene.gltf", source, () => {});
  assert.deepEqual(asked, ["rock #1?.bin"]);
});

test("counts and lengths that would take memory are refused", async () => {
  for (const count of [2 ** 40, -1, 0.5, "4", null]) await assert.rejects(load({ accessors: [{ count, bufferView: 0, componentType: 5126, type: "VEC3" }] }), /accessors\[0\]\.count/);
  await assert.rejects(load({ accessors: [{ count: 2 ** 26, componentType: 5126, type: "VEC3" }] }), /accessors\[0\]\.count/);
  for (const byteLength of [2 ** 40, -1, undefined]) await assert.rejects(load({ buffers: [{ uri: "scene.bin", byteLength }] }), /buffers\[0\]\.byteLength/);
  await assert.rejects(load({ buffers: [null] }), isSentence);
});

test("what is no glTF is told with a sentence", async () => {
  for (const text of ["", "{", "null", "[]", '{"asset": 1}', '{"asset": {"version": "1.0"}}', '{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [5]}], "nodes": []}']) {
    await assert.rejects(loadScene(exact(Buffer.from(text)), "scene.gltf", nothing, () => {}), isSentence, text);
  }
});
