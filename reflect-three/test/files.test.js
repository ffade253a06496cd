import assert from "node:assert/strict";
import test from "node:test";
import { DataTexture } from "three";
import { checkBytes } from "../src/checksum.js";
import { ddsBlocks, decodeBc1, turnedOver } from "../src/bc1.js";
import { checkExr, exrHeader } from "../src/exrHeader.js";
import { textureOf } from "../src/images.js";
import { ddsFile, exportFolder, sum } from "./exportFolder.js";
import { exact, exrFile, half } from "./exrFile.js";
import { random } from "./random.js";
import { isSentence } from "./sentence.js";

const { manifest, files } = exportFolder();
const images = Object.values(manifest.images);

test("the header of an EXR", () => {
  const header = exrHeader(exrFile(24, 20, "half", () => 0), "a.exr");
  assert.deepEqual([header.width, header.height, header.compression], [24, 20, 3]);
  assert.deepEqual(header.channels, ["A", "B", "G", "R"].map((name) => ({ name, type: "half" })));
});

test("a header that says a thing twice is refused: a decoder may believe the other one", () => {
  const bytes = Buffer.from(exrFile(24, 20, "half", () => 0));
  const [start, end] = [bytes.indexOf("dataWindow\0"), bytes.indexOf("displayWindow\0")];
  const twice = Buffer.concat([bytes.subarray(0, end), bytes.subarray(start)]);
  assert.throws(() => exrHeader(exact(twice), "a.exr"), (error) => isSentence(error) && /dataWindow is there twice/.test(error.message));
});

test("row 0 of a texture is the bottom row of the file, and no number is rounded", async () => {
  const value = (x, y, channel) => x + 32 * y + channel + 0.5; // exact in a half
  const file = (type) => ({ file: "a.exr", kind: type === "half" ? "tx" : "buf", width: 24, height: 20 });
  const halves = (await textureOf(exrFile(24, 20, "half", value), file("half"), false)).image.data;
  const third = (x, y, channel) => Math.fround(value(x, y, channel) / 3);
  const floats = (await textureOf(exrFile(24, 20, "float", third), file("float"), false)).image.data;
  assert.ok(halves instanceof Uint16Array && floats instanceof Float32Array);
  for (const [x, row, channel] of [[0, 0, 0], [23, 0, 1], [5, 7, 2], [23, 19, 3]]) {
    const at = 4 * (24 * row + x) + channel;
    assert.equal(halves[at], half(value(x, 19 - row, channel)));
    assert.equal(floats[at], third(x, 19 - row, channel));
  }
});

test("BC1: four colours, three colours and black, rows from the bottom", () => {
  const red = [0x00, 0xf8], blue = [0x1f, 0x00];
  const block = (a, b, ...rows) => [...a, ...b, ...rows];
  // Top block: red first is the greater number, so thirds; its top row has codes 0 1 2 3. Bottom block: a mean and black.
  const data = ddsFile(4, 8, [...block(red, blue, 0b11100100, 0, 0, 0), ...block(blue, red, 0b11100100, 0, 0, 0b01010101)]);
  const pixels = decodeBc1(turnedOver(ddsBlocks(data, "a.dds", { width: 4, height: 8 }), 4, 8), 4, 8);
  const at = (x, row) => [...pixels.slice(4 * (4 * row + x), 4 * (4 * row + x) + 4)];
  assert.deepEqual([0, 1, 2, 3].map((x) => at(x, 7)), [[255, 0, 0, 255], [0, 0, 255, 255], [170, 0, 85, 255], [85, 0, 170, 255]]);
  assert.deepEqual([0, 1, 2, 3].map((x) => at(x, 3)), [[0, 0, 255, 255], [255, 0, 0, 255], [128, 0, 128, 255], [0, 0, 0, 255]]);
  assert.deepEqual(at(0, 0), [255, 0, 0, 255]); // the bottom row of the bottom block: code 1
});

test("a file with other bytes is refused; without crypto.subtle lengths still count", async () => {
  const bytes = new Uint8Array([1, 2, 3]).buffer;
  const promised = { bytes: 3, sha256: sum(bytes) };
  assert.equal(await checkBytes(bytes, "a", promised), true);
  assert.equal(await checkBytes(bytes, "a", { ...promised, sha256: "0".repeat(64) }, null), false);
  await assert.rejects(checkBytes(bytes, "a", { ...promised, sha256: "0".repeat(64) }), isSentence);
  await assert.rejects(checkBytes(bytes, "a", { ...promised, bytes: 4 }, null), isSentence);
});

/** A file that was cut, grew, or has other bytes, most of them in its header. */
function damaged(bytes, next) {
  const how = next.below(4);
  if (how === 0) return bytes.slice(0, next.below(bytes.byteLength));
  if (how === 1) return new Uint8Array([...new Uint8Array(bytes), ...Array.from({ length: 1 + next.below(40) }, () => next.below(256))]).buffer;
  const out = new Uint8Array(bytes.slice(0));
  for (let i = 0; i <= next.below(4); i++) out[next.below(next() < 0.8 ? Math.min(420, out.length) : out.length)] ^= 1 + next.below(255);
  return out.buffer;
}

test("of 1,000 damaged files each is refused with a sentence, by its checksum or, where the damage has one of its own, by its header", async () => {
  const next = random(7);
  const before = process.memoryUsage().arrayBuffers;
  const silent = console.error;
  console.error = () => {}; // EXRLoader tells what it thinks of a block
  let byHeader = 0;
  let largest = 0;
  try {
    for (let i = 0; i < 1000; i++) {
      const image = next.of(images);
      const bytes = damaged(files.get(image.file), next);
      await assert.rejects(checkBytes(bytes, image.file, image), isSentence);
      try {
        const texture = await textureOf(bytes, image, false);
        assert.ok(texture instanceof DataTexture && texture.image.width === image.width && texture.image.height === image.height);
      } catch (error) {
        isSentence(error);
        byHeader++;
      }
      largest = Math.max(largest, process.memoryUsage().arrayBuffers - before);
    }
  } finally {
    console.error = silent;
  }
  assert.ok(byHeader > 500, `${byHeader}`);
  assert.ok(largest < 64 * 2 ** 20, `${largest} bytes`);
});

test("a header that asks for more than the manifest promises is refused before it is decoded", () => {
  const bytes = exrFile(64, 32, "half", () => 1);
  assert.throws(() => checkExr(bytes, "a.exr", { width: 32, height: 32, type: "half" }), /64 x 32 where the manifest says 32 x 32/);
  assert.throws(() => checkExr(bytes, "a.exr", { width: 64, height: 32, type: "float" }), /not float/);
});
