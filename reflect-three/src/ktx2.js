/**
 * A float image as KTX2: one picture without mips, RGBA halfs or floats, as it is or by Zstandard [Khronos, "KTX File Format Specification 2.0", 3]. Texels go to the
 * graphics card as they come out.
 */
import { ZSTDDecoder } from "three/addons/libs/zstddec.module.js";
import { ReflectError } from "./ReflectError.js";

const MAGIC = [0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a];
const HEAD = 104; // bytes, with one level
const FORMATS = { half: 97, float: 109 }; // Vulkan's R16G16B16A16_SFLOAT and R32G32B32A32_SFLOAT
const BYTES = { half: 8, float: 16 };
const FRAME = 0xfd2fb528; // how Zstandard's frames begin
const SIZE_BYTES = [0, 2, 4, 8]; // of a frame's content size, by the two highest bits of its descriptor

/**
 * @param {ArrayBuffer} bytes the whole file
 * @param {string} file its name, for errors
 * @param {{width: number, height: number, type: "half"|"float"}} promised by the manifest
 * @returns {Promise<Uint16Array | Float32Array>} the picture's bottom row first
 */
export async function ktx2Texels(bytes, file, promised) {
  const { data, packed } = ktx2Level(bytes, file, promised);
  const size = promised.width * promised.height * BYTES[promised.type];
  const texels = packed ? await unpacked(data, size) : data;
  if (texels === null || texels.byteLength !== size) throw new ReflectError(file, "", "cannot be decoded");
  return turnedOver(promised.type === "half" ? new Uint16Array(texels.buffer) : new Float32Array(texels.buffer), promised);
}

/** The level's bytes as a copy of their own. Refuses what is not the file that the manifest promises, before memory is taken. */
export function ktx2Level(bytes, file, { width, height, type }) {
  const refuse = (field, reason) => {
    throw new ReflectError(file, field, reason);
  };
  const view = new DataView(bytes);
  if (bytes.byteLength < HEAD || MAGIC.some((byte, i) => view.getUint8(i) !== byte)) refuse("", "is no KTX2");
  const [format, , across, down, depth, layers, faces, levels, scheme] = Array.from({ length: 9 }, (_, i) => view.getUint32(12 + 4 * i, true));
  if (across !== width || down !== height) refuse("the header's size", `is ${across} x ${down} where the manifest says ${width} x ${height}`);
  if (format !== FORMATS[type]) refuse("the header's vkFormat", `is ${format}, not ${FORMATS[type]}`);
  if (depth !== 0 || layers !== 0 || faces !== 1 || levels !== 1) refuse("the header", "is not of one picture");
  if (scheme !== 0 && scheme !== 2) refuse("the header's supercompressionScheme", "is neither 0 nor Zstandard's 2");
  const [start, length, size] = [80, 88, 96].map((at) => Number(view.getBigUint64(at, true)));
  if (size !== width * height * BYTES[type]) refuse("the level's uncompressedByteLength", "is not that of its texels");
  if (start < HEAD || start + length > bytes.byteLength) refuse("the level", "lies outside of the file");
  const data = new Uint8Array(bytes.slice(start, start + length));
  if (scheme === 0 ? length !== size : contentSize(data) !== size) refuse("the level", "does not hold its texels");
  return { data, packed: scheme === 2 };
}

/** What a frame of Zstandard says it holds [RFC 8878, 3.1.1.1], or -1: a decoder takes that memory. */
function contentSize(data) {
  const view = new DataView(data.buffer);
  if (data.byteLength < 18 || view.getUint32(0, true) !== FRAME) return -1;
  const descriptor = view.getUint8(4);
  const single = (descriptor >> 5) & 1;
  const at = 5 + (single ? 0 : 1) + [0, 1, 2, 4][descriptor & 3];
  const count = SIZE_BYTES[descriptor >> 6] || (single ? 1 : 0);
  if (count === 1) return view.getUint8(at);
  if (count === 2) return view.getUint16(at, true) + 256;
  return count === 4 ? view.getUint32(at, true) : count === 8 ? Number(view.getBigUint64(at, true)) : -1;
}

let decoder;
async function unpacked(data, size) {
  decoder ??= new ZSTDDecoder();
  await decoder.init();
  try {
    return decoder.decode(data, size);
  } catch {
    return null;
  }
}

function turnedOver(texels, { width, height }) {
  const out = new texels.constructor(texels.length);
  const row = 4 * width;
  for (let y = 0; y < height; y++) out.set(texels.subarray(y * row, (y + 1) * row), (height - 1 - y) * row);
  return out;
}
