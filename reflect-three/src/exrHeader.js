/**
 * The header of an EXR, so that what it says can be held against the manifest before a decoder takes memory for it [OpenEXR, "Technical Introduction"].
 */
import { ReflectError } from "./ReflectError.js";

const MAGIC = 20000630;
const TYPES = ["uint", "half", "float"];
const BYTES = { uint: 4, half: 2, float: 4 };
const ZIP = 3; // blocks of 16 rows
const ROWS = 16;
const HEADER_BYTES = 65536; // ours have a few hundred

/**
 * @typedef {{width: number, height: number, channels: {name: string, type: string}[], compression: number, end: number}} ExrHeader
 * @param {ArrayBuffer} bytes the whole file
 * @param {string} file its name, for errors
 * @returns {ExrHeader} end: offset of the table of blocks
 */
export function exrHeader(bytes, file) {
  const refuse = (field, reason) => {
    throw new ReflectError(file, field, reason);
  };
  const view = new DataView(bytes);
  if (bytes.byteLength < 8 || view.getUint32(0, true) !== MAGIC) refuse("", "is no EXR");
  // The flags are those of tiled, deep and multi-part files, and of long names: ours have none.
  if (view.getUint32(4, true) !== 2) refuse("the version", "is not that of one picture in rows");
  const most = Math.min(bytes.byteLength, HEADER_BYTES);
  let at = 8;
  const text = () => {
    const start = at;
    while (at < most && view.getUint8(at) !== 0) at++;
    if (at >= most || at - start > 255) refuse("the header", "has no end");
    return String.fromCharCode(...new Uint8Array(bytes, start, at++ - start));
  };
  const found = {};
  const names = new Set();
  for (let name = text(); name !== ""; name = text()) {
    const type = text();
    if (at + 4 > most) refuse("the header", "has no end");
    const size = view.getUint32(at, true);
    at += 4;
    if (size > most - at) refuse(`the header's ${name}`, "is longer than the file");
    if (names.has(name)) refuse(`the header's ${name}`, "is there twice");
    names.add(name);
    found[`${name}:${type}`] = { at, size };
    at += size;
  }
  const attribute = (key, size) => {
    const value = Object.hasOwn(found, key) ? found[key] : refuse("the header", `has no ${key}`);
    if (size !== null && value.size !== size) refuse(`the header's ${key}`, "has another size");
    return value;
  };
  const window = attribute("dataWindow:box2i", 16).at;
  const [left, bottom, right, top] = [0, 4, 8, 12].map((offset) => view.getInt32(window + offset, true));
  const [width, height] = [right - left + 1, top - bottom + 1];
  if (!(width > 0 && height > 0)) refuse("the header's dataWindow", "is empty");
  if (view.getUint8(attribute("lineOrder:lineOrder", 1).at) !== 0) refuse("the header's lineOrder", "is not increasing");
  const compression = view.getUint8(attribute("compression:compression", 1).at);
  const channels = readChannels(view, attribute("channels:chlist", null), refuse);
  return { width, height, channels, compression, end: at };
}

/** Names and types of at most 16 channels; all must have every texel. */
function readChannels(view, { at, size }, refuse) {
  const end = at + size;
  const channels = [];
  while (at < end && view.getUint8(at) !== 0) {
    let name = "";
    while (at < end && view.getUint8(at) !== 0) name += String.fromCharCode(view.getUint8(at++));
    if (at + 17 > end || channels.length >= 16) refuse("the header's channels", "are no list of channels");
    const type = TYPES[view.getUint32(at + 1, true)];
    if (!type || view.getUint32(at + 9, true) !== 1 || view.getUint32(at + 13, true) !== 1) refuse(`the header's channel ${name}`, "is of a kind that no export has");
    channels.push({ name, type });
    at += 17;
  }
  return channels;
}

/**
 * Refuses an EXR that is not the one which the manifest promises: size, channels, type, ZIP; and blocks that lie outside of the file or are larger than what
 * they hold, which a compressor stores as it is.
 * @param {ArrayBuffer} bytes
 * @param {string} file
 * @param {{width: number, height: number, type: "half"|"float", channels?: string}} promised
 */
export function checkExr(bytes, file, { width, height, type, channels = "ABGR" }) {
  const refuse = (field, reason) => {
    throw new ReflectError(file, field, reason);
  };
  const header = exrHeader(bytes, file);
  if (header.width !== width || header.height !== height) {
    refuse("the header's dataWindow", `is ${header.width} x ${header.height} where the manifest says ${width} x ${height}`);
  }
  const names = header.channels.map((channel) => channel.name).join("");
  if (names !== channels) refuse("the header's channels", `are "${names.slice(0, 20)}" in place of "${channels}"`);
  if (header.channels.some((channel) => channel.type !== type)) refuse("the header's channels", `are not ${type}`);
  if (header.compression !== ZIP) refuse("the header's compression", "is not ZIP");
  const blocks = Math.ceil(height / ROWS);
  if (header.end + 8 * blocks > bytes.byteLength) refuse("the table of blocks", "is longer than the file");
  const view = new DataView(bytes);
  const start = header.end + 8 * blocks;
  let at = start;
  // Blocks one after another, as they are decoded: the table's offsets must say the same.
  for (let block = 0; block < blocks; block++) {
    const rows = Math.min(ROWS, height - block * ROWS);
    if (view.getUint32(header.end + 8 * block + 4, true) !== 0 || view.getUint32(header.end + 8 * block, true) !== at) {
      refuse(`the offset of block ${block}`, "is not where the block before it ends");
    }
    if (at + 8 > bytes.byteLength) refuse(`block ${block}`, "lies outside of the file");
    const size = view.getUint32(at + 4, true);
    if (size < 1 || size > rows * width * channels.length * BYTES[type]) refuse(`block ${block}`, "is larger than what it holds");
    if (at + 8 + size > bytes.byteLength) refuse(`block ${block}`, "is longer than the file");
    at += 8 + size;
  }
}
