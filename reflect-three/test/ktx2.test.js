/**
 * KTX2 as ktx-parse, Khronos' own container in JavaScript, writes it, and frames of Zstandard made by hand [RFC 8878, 3.1.1].
 */
import assert from "node:assert/strict";
import test from "node:test";
import { createDefaultContainer, write } from "three/addons/libs/ktx-parse.module.js";
import { textureOf } from "../src/images.js";
import { exact, half } from "./exrFile.js";
import { isSentence } from "./sentence.js";

const [WIDTH, HEIGHT] = [6, 4];
const value = (x, y, channel) => x + 8 * y + 64 * channel + 0.5;

/** One frame that holds the bytes as they are, and says how many. */
function frame(body, says = body.length) {
  const head = Buffer.alloc(9 + 3);
  head.writeUInt32LE(0xfd2fb528, 0);
  head.writeUInt8(0b10100000, 4); // a single segment whose size has four bytes
  head.writeUInt32LE(says, 5);
  head.writeUIntLE((body.length << 3) | 1, 9, 3); // the last block, as it is
  return Buffer.concat([head, body]);
}

function ktx2File(type, { scheme = 2, says, ...other } = {}) {
  const texels = type === "half" ? new Uint16Array(4 * WIDTH * HEIGHT) : new Float32Array(4 * WIDTH * HEIGHT);
  for (let i = 0; i < texels.length; i++) {
    const number = value((i >> 2) % WIDTH, Math.floor(i / (4 * WIDTH)), i % 4);
    texels[i] = type === "half" ? half(number) : number / 3;
  }
  const body = Buffer.from(texels.buffer);
  const container = createDefaultContainer();
  Object.assign(container, { vkFormat: type === "half" ? 97 : 109, typeSize: type === "half" ? 2 : 4, pixelWidth: WIDTH, pixelHeight: HEIGHT, pixelDepth: 0, layerCount: 0, faceCount: 1, levelCount: 1, supercompressionScheme: scheme, ...other });
  container.levels = [{ levelData: new Uint8Array(scheme === 2 ? frame(body, says) : body), uncompressedByteLength: body.length }];
  return exact(Buffer.from(write(container)));
}

const image = (type) => ({ file: "images/a.ktx2", kind: type === "half" ? "tx" : "buf", width: WIDTH, height: HEIGHT });

for (const scheme of [0, 2]) {
  test(`row 0 of the texture is the picture's bottom row, scheme ${scheme}`, async () => {
    const halves = (await textureOf(ktx2File("half", { scheme }), image("half"), false)).image.data;
    const floats = (await textureOf(ktx2File("float", { scheme }), image("float"), false)).image.data;
    for (const [x, row, channel] of [[0, 0, 0], [5, 0, 1], [2, 1, 2], [5, 3, 3]]) {
      const at = 4 * (WIDTH * row + x) + channel;
      assert.equal(halves[at], half(value(x, HEIGHT - 1 - row, channel)));
      assert.equal(floats[at], Math.fround(value(x, HEIGHT - 1 - row, channel) / 3));
    }
  });
}

const WRONG = {
  "another format": [{ vkFormat: 37 }, /vkFormat/],
  "another size": [{ pixelWidth: 4096 }, /4096 x 4 where the manifest says 6 x 4/],
  "a cube": [{ faceCount: 6 }, /one picture/],
  "layers": [{ layerCount: 2 }, /one picture/],
  "a frame that says more than it may": [{ says: 2 ** 31 }, /does not hold its texels/],
  "a frame that says less": [{ says: 8 }, /does not hold its texels/],
};
for (const [name, [change, words]] of Object.entries(WRONG)) {
  test(`refused before memory is taken: ${name}`, async () => {
    await assert.rejects(textureOf(ktx2File("half", change), image("half"), false), (error) => isSentence(error) && words.test(error.message));
  });
}

test("cut at any byte it is refused with a sentence", async () => {
  const whole = ktx2File("half");
  for (let end = 0; end < whole.byteLength; end += 3) await assert.rejects(textureOf(whole.slice(0, end), image("half"), false), isSentence);
});
