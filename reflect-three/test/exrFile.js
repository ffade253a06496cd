/**
 * EXR files for tests, written apart from what reads them [OpenEXR, "OpenEXR File Layout"]: ZIP blocks of 16 rows, RGBA.
 */
import { deflateSync } from "node:zlib";

const TYPES = { half: [1, 2], float: [2, 4] };

/** A float's 16 bits, for numbers that a half holds exactly. */
export function half(value) {
  if (value === 0) return 0;
  const exponent = Math.floor(Math.log2(Math.abs(value)));
  return (value < 0 ? 0x8000 : 0) | ((exponent + 15) << 10) | Math.round((Math.abs(value) / 2 ** exponent - 1) * 1024);
}

/**
 * @param {(x: number, y: number, channel: number) => number} value y: 0 = the top row, as files have it; channel: of RGBA
 * @returns {ArrayBuffer}
 */
export function exrFile(width, height, type, value) {
  const [code, bytes] = TYPES[type];
  const blocks = [];
  for (let row = 0; row < height; row += 16) {
    const raw = rows(width, row, Math.min(row + 16, height), type, bytes, value);
    const packed = deflateSync(predicted(raw));
    blocks.push({ row, data: packed.length < raw.length ? packed : raw });
  }
  const head = header(width, height, code);
  const offsets = Buffer.alloc(8 * blocks.length);
  let at = head.length + offsets.length;
  const parts = [head, offsets];
  blocks.forEach(({ row, data }, i) => {
    offsets.writeBigUInt64LE(BigInt(at), 8 * i);
    const start = Buffer.alloc(8);
    start.writeInt32LE(row, 0);
    start.writeUInt32LE(data.length, 4);
    parts.push(start, data);
    at += 8 + data.length;
  });
  return exact(Buffer.concat(parts));
}

/** A copy in a buffer of its own. */
export const exact = (buffer) => buffer.buffer.slice(buffer.byteOffset, buffer.byteOffset + buffer.byteLength);

function rows(width, from, to, type, bytes, value) {
  const out = Buffer.alloc((to - from) * width * 4 * bytes);
  let at = 0;
  for (let y = from; y < to; y++) {
    for (const channel of [3, 2, 1, 0]) {
      for (let x = 0; x < width; x++, at += bytes) {
        if (type === "half") out.writeUInt16LE(half(value(x, y, channel)), at);
        else out.writeFloatLE(value(x, y, channel), at);
      }
    }
  }
  return out;
}

/** Even bytes before odd ones, then differences. */
function predicted(raw) {
  const out = Buffer.alloc(raw.length);
  const middle = (raw.length + 1) >> 1;
  for (let i = 0; i < raw.length; i++) out[(i & 1 ? middle : 0) + (i >> 1)] = raw[i];
  for (let i = raw.length - 1; i > 0; i--) out[i] = (out[i] - out[i - 1] + 128) & 255;
  return out;
}

function header(width, height, code) {
  const word = (name) => Buffer.from(`${name}\0`, "latin1");
  const ints = (...values) => {
    const out = Buffer.alloc(4 * values.length);
    values.forEach((v, i) => out.writeInt32LE(v, 4 * i));
    return out;
  };
  const floats = (...values) => {
    const out = Buffer.alloc(4 * values.length);
    values.forEach((v, i) => out.writeFloatLE(v, 4 * i));
    return out;
  };
  const attribute = (name, type, value) => Buffer.concat([word(name), word(type), ints(value.length), value]);
  const channels = Buffer.concat([...["A", "B", "G", "R"].flatMap((name) => [word(name), ints(code, 0, 1, 1)]), Buffer.from([0])]);
  const window = ints(0, 0, width - 1, height - 1);
  return Buffer.concat([
    ints(20000630, 2),
    attribute("channels", "chlist", channels),
    attribute("compression", "compression", Buffer.from([3])),
    attribute("dataWindow", "box2i", window),
    attribute("displayWindow", "box2i", window),
    attribute("lineOrder", "lineOrder", Buffer.from([0])),
    attribute("pixelAspectRatio", "float", floats(1)),
    attribute("screenWindowCenter", "v2f", floats(0, 0)),
    attribute("screenWindowWidth", "float", floats(1)),
    Buffer.from([0]),
  ]);
}
