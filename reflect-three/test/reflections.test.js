import assert from "node:assert/strict";
import test from "node:test";
import { Reflections } from "../src/Reflections.js";
import { loadScene } from "../src/gltf.js";
import { exact } from "./exrFile.js";
import { exportFolder } from "./exportFolder.js";

test("a method may be called as something that all objects have", async () => {
  const { manifest, files } = exportFolder();
  const [first] = manifest.reflectors;
  manifest.reflectors.push({ ...first, node: 1, methods: { constructor: first.methods.auto } });
  const nodes = [0, 1].map((reflector) => ({ extensions: { REFLECT_reflections: { reflector } } }));
  const scene = { asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [0, 1] }], nodes };
  const source = { read: async (name) => files.get(name) };
  const gltf = await loadScene(exact(Buffer.from(JSON.stringify(scene))), "scene.gltf", source, () => {});
  const reflections = await Reflections.of(gltf, manifest, source, { renderer: null, warn: assert.fail, rays: 1, onProgress: () => {} });
  assert.ok(await reflections.use("constructor"));
  assert.equal(reflections.shown, "constructor");
  assert.ok(reflections.sizeOf("constructor").memory > 0);
  await reflections.release();
  await assert.rejects(reflections.use("toString"), /have no method toString/);
});
