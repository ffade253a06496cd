import assert from "node:assert/strict";
import test from "node:test";
import { checkManifest, parseManifest } from "../src/checkManifest.js";
import { exportFolder } from "./exportFolder.js";
import { random } from "./random.js";
import { isSentence } from "./sentence.js";

const { manifest } = exportFolder();
const copy = () => structuredClone(manifest);

const refused = (change, about) => {
  const damaged = copy();
  change(damaged);
  assert.throws(() => checkManifest(damaged), (error) => isSentence(error) && (assert.match(error.message, about), true));
};

test("a manifest as it should be passes, unchanged", () => {
  const own = copy();
  assert.equal(checkManifest(own), own);
  assert.deepEqual(parseManifest(JSON.stringify(manifest)), manifest);
});

test("each refusal says where", () => {
  const id = Object.keys(manifest.images)[0];
  refused((m) => (m.what = "reflect"), /what/);
  refused((m) => (m.format = 2), /format is 2/);
  refused((m) => (m.more = 1), /field "more"/);
  refused((m) => delete m.bakes, /no field bakes/);
  refused((m) => (m.images[id].bytes = 1), /fewer than any compression/);
  refused((m) => (m.images.x = m.images[id]), /images.x.file is not named as its file/);
  refused((m) => (m.images[id].width = 16385), /width is 16385/);
  refused((m) => (m.images[id].width = 24.5), /not a whole number/);
  refused((m) => (m.images[id].file = "images/../../secret.exr"), /no plain name/);
  refused((m) => (m.images[id].file = "/images/a.exr"), /no plain name/);
  refused((m) => (m.images[id].file = "https://example.com/a.exr"), /no plain name/);
  refused((m) => (m.images[id].sha256 = m.images[id].sha256.replace(/^./, (c) => (c === "0" ? "1" : "0"))), /sha256/);
  refused((m) => (m.shaders[m.surface].godot.file = "shaders/../x.gdshaderinc"), /godot.file is "shaders/);
  refused((m) => delete m.shaders[m.surface].godot, /no field godot/);
  refused((m) => (m.look.table = id), /look.table/);
  refused((m) => (m.look.exposure = Infinity), /look.exposure is not a finite number/);
  refused((m) => (m.reflectors[0].materials = [1]), /materials\[0\] is 1/);
  refused((m) => (m.reflectors[0].methods.auto.slots[0][2] = NaN), /slots\[0\]\[2\]/);
  refused((m) => (m.reflectors[0].methods.auto.samplers = { "a; } void main() {": id }), /no sampler/);
  refused((m) => (m.reflectors[0].methods.auto.shader = "constructor"), /names "constructor"/);
  refused((m) => (m.surface = "__proto__"), /__proto__/);
  refused((m) => (m.bakes.file = "../bakes.json"), /bakes.file/);
  refused((m) => (m.reflectors[0].methods.auto.assets = [1]), /assets\[0\]/);
  refused((m) => (m.pictures[0].behind = "images/a.exr"), /no plain name in pictures/);
});

test("names may be empty: what has no material is shown with one that has no name", () => {
  const own = copy();
  own.materials[0].name = own.scene.name = "";
  checkManifest(own);
});

test("what reflect_addon/core/exchange/checked.py refuses is refused here", () => {
  const id = Object.keys(manifest.images)[0];
  refused((m) => (m.generator = 1), /generator/);
  refused((m) => (m.scene.file = "scene.glb"), /scene.file is not scene.gltf/);
  refused((m) => (m.scene.bytes = 2 ** 28 + 1), /scene.bytes/);
  refused((m) => (m.look.exposure = 65), /look.exposure/);
  refused((m) => (m.reflectors[0].node = 2 ** 24), /node/);
  refused((m) => (m.reflectors[0].methods.auto.assets = []), /assets are none/);
  refused((m) => (m.reflectors[0].methods.auto.slots[0][0] = 3.41e38), /slots/);
  refused((m) => (m.reflectors[0].methods.auto.samplers = { a__b: id }), /no sampler/);
  refused((m) => (m.reflectors[0].methods.auto.kind = "a b"), /kind is not a word/);
  refused((m) => (m.pictures[0].methods["a b"] = m.pictures[0].truth), /not a word/);
  refused((m) => Object.defineProperty(m.reflectors[0].methods, "__proto__", { value: m.reflectors[0].methods.auto, enumerable: true }), /not a word/);
});

test("images that are too large together are refused before any is read", () => {
  refused((m) => {
    const [id, image] = Object.entries(m.images)[0];
    for (let i = 10; i < 50; i++) m.images[`x${i}${id}`] = { ...image, file: image.file.replace(id, `x${i}${id}`), width: 16384, height: 16384, bytes: 2 ** 24 };
  }, /images are together larger than 4 GiB/);
});

test("texts that are no manifest are refused", () => {
  for (const json of ["", "{", "null", "[]", '"reflect export"', "1e999", "[".repeat(50000), '{"what": "reflect export"}', '{"__proto__": {"what": "reflect export"}}']) {
    assert.throws(() => parseManifest(json), isSentence);
  }
});

test("what is endlessly nested is refused", () => {
  let value = 1;
  for (let i = 0; i < 3000; i++) value = { a: value };
  assert.throws(() => parseManifest(JSON.stringify({ ...manifest, look: value })), isSentence);
});

/** Values in place of a leaf or branch; most are wrong wherever they stand. */
const BAD = [null, true, "", "x", "../x", -1, 0.5, 1e30, 1e308, Infinity, -Infinity, NaN, [], {}, [[]], [null], 2 ** 53, "images/a.exr", "constructor", "\u0000", "x".repeat(5000), undefined];

function places(value, path = []) {
  const here = path.length ? [path] : [];
  return typeof value === "object" && value !== null ? [...here, ...Object.keys(value).flatMap((key) => places(value[key], [...path, key]))] : here;
}

function damaged(next) {
  const out = copy();
  for (let i = 0; i <= next.below(3); i++) {
    const path = next.of(places(out));
    const parent = path.slice(0, -1).reduce((value, key) => value[key], out);
    const key = path.at(-1);
    const how = next.below(4);
    if (how === 0) delete parent[key];
    else if (how === 1 && typeof parent[key] === "number") parent[key] *= next.of([-1, 1e6, 0, 1.5, 1e300]);
    else if (how === 2 && typeof parent[key] === "string") parent[key] = parent[key].slice(0, next.below(parent[key].length)) + next.of(["", "/", "\\", "\n", "é", ":"]);
    else parent[key] = next.of(BAD);
  }
  return out;
}

test("of 1,000 damaged manifests each is refused with a sentence or harmless, and none takes memory", () => {
  const next = random(20261130);
  const before = process.memoryUsage().arrayBuffers;
  let refusals = 0;
  for (let i = 0; i < 1000; i++) {
    const value = damaged(next);
    try {
      checkManifest(value);
      for (const { width, height } of Object.values(value.images)) assert.ok(width * height <= 16384 ** 2);
    } catch (error) {
      isSentence(error);
      refusals++;
    }
  }
  assert.ok(refusals > 700, `${refusals} refusals`);
  assert.ok(process.memoryUsage().arrayBuffers - before < 2 ** 20);
});
