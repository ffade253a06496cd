/**
 * BC1 (DXT1) in a .dds file [Microsoft, "Programming guide for DDS"]: its header held against the manifest, and its blocks for graphics cards that cannot
 * read them. A block is two colours of 5:6:5 bits and 16 indices of 2 bits, a byte for each row of four texels, the left one lowest.
 */
import { ReflectError } from "./ReflectError.js";

const HEADER_BYTES = 128;
const DXT1 = 0x31545844;

/**
 * @param {ArrayBuffer} bytes the whole file
 * @param {string} file its name, for errors
 * @param {{width: number, height: number}} promised by the manifest
 * @returns {Uint8Array} the blocks as they lie in the file, top row first
 */
export function ddsBlocks(bytes, file, { width, height }) {
  const refuse = (field, reason) => {
    throw new ReflectError(file, field, reason);
  };
  const view = new DataView(bytes);
  if (bytes.byteLength < HEADER_BYTES || view.getUint32(0, true) !== 0x20534444) refuse("", "is no DDS");
  if (view.getUint32(4, true) !== 124 || view.getUint32(76, true) !== 32) refuse("the header", "has another size");
  if (view.getUint32(84, true) !== DXT1) refuse("the header's code", "is not DXT1");
  const [rows, columns] = [view.getUint32(12, true), view.getUint32(16, true)];
  if (columns !== width || rows !== height) refuse("the header's size", `is ${columns} x ${rows} where the manifest says ${width} x ${height}`);
  if (view.getUint32(28, true) > 1) refuse("the header", "has mipmaps");
  if (bytes.byteLength !== HEADER_BYTES + (width * height) / 2) refuse("", "has not as many blocks as its header says");
  return new Uint8Array(bytes, HEADER_BYTES);
}

/**
 * Bottom row first, as textures have it: rows of blocks, and the rows in each block. The colours stay as they are.
 * @param {Uint8Array} blocks
 * @returns {Uint8Array} a copy
 */
export function turnedOver(blocks, width, height) {
  const [columns, rows] = [width / 4, height / 4];
  const out = new Uint8Array(blocks.length);
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column < columns; column++) {
      const from = 8 * ((rows - 1 - row) * columns + column);
      const to = 8 * (row * columns + column);
      for (let i = 0; i < 4; i++) {
        out[to + i] = blocks[from + i];
        out[to + 4 + i] = blocks[from + 7 - i];
      }
    }
  }
  return out;
}

/**
 * @param {Uint8Array} blocks rows of blocks, in either order
 * @returns {Uint8Array} RGBA, 8 bits each, alpha 255, rows in the order of the blocks
 */
export function decodeBc1(blocks, width, height) {
  const out = new Uint8Array(4 * width * height);
  const columns = width / 4;
  const palette = new Uint8Array(12);
  for (let block = 0; block < blocks.length / 8; block++) {
    readPalette(blocks, 8 * block, palette);
    const x = 4 * (block % columns);
    const y = 4 * Math.floor(block / columns);
    for (let row = 0; row < 4; row++) {
      let codes = blocks[8 * block + 4 + row];
      let to = 4 * ((y + row) * width + x);
      for (let column = 0; column < 4; column++, codes >>= 2, to += 4) {
        const from = 3 * (codes & 3);
        out[to] = palette[from];
        out[to + 1] = palette[from + 1];
        out[to + 2] = palette[from + 2];
        out[to + 3] = 255;
      }
    }
  }
  return out;
}

/** The four colours of a block: two, and between them two thirds or, where the first is not the greater, their mean and black. */
function readPalette(blocks, at, palette) {
  const first = blocks[at] | (blocks[at + 1] << 8);
  const second = blocks[at + 2] | (blocks[at + 3] << 8);
  for (let channel = 0; channel < 3; channel++) {
    const [shift, most] = [[11, 31], [5, 63], [0, 31]][channel];
    const a = (((first >> shift) & most) / most) * 255;
    const b = (((second >> shift) & most) / most) * 255;
    palette[channel] = Math.round(a);
    palette[3 + channel] = Math.round(b);
    palette[6 + channel] = Math.round(first > second ? (2 * a + b) / 3 : (a + b) / 2);
    palette[9 + channel] = first > second ? Math.round((a + 2 * b) / 3) : 0;
  }
}
