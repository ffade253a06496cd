/**
 * An image of the manifest as a texture of three: texels as they are, bottom row first, no filter, no mips, no colour space. Kernels fetch by number.
 */
import {
  CompressedTexture, DataTexture, FloatType, HalfFloatType, NearestFilter, NoColorSpace, RGBAFormat, RGB_S3TC_DXT1_Format, UnsignedByteType,
} from "three";
import { EXRLoader } from "three/addons/loaders/EXRLoader.js";
import { ReflectError } from "./ReflectError.js";
import { ddsBlocks, decodeBc1, turnedOver } from "./bc1.js";
import { checkExr } from "./exrHeader.js";
import { KINDS } from "./limits.js";

/**
 * @param {ArrayBuffer} bytes the file, whose checksum holds
 * @param {import("./checkManifest.js").ImageEntry} image
 * @param {boolean} compressed whether the graphics card reads DXT1
 */
export function textureOf(bytes, image, compressed) {
  const kind = KINDS[image.kind];
  if (!kind.exr) return blockTexture(bytes, image, compressed);
  checkExr(bytes, image.file, { width: image.width, height: image.height, type: kind.exr });
  return exrTexture(bytes, image.file, kind.exr, image);
}

/**
 * @param {"half"|"float"} type as the header has it, so that no number is rounded
 * @returns {DataTexture}
 */
export function exrTexture(bytes, file, type, { width, height }) {
  const loader = new EXRLoader();
  loader.setDataType(type === "half" ? HalfFloatType : FloatType);
  let decoded;
  try {
    decoded = loader.parse(bytes);
  } catch {
    throw new ReflectError(file, "", "cannot be decoded");
  }
  if (decoded.width !== width || decoded.height !== height || decoded.data.length !== 4 * width * height) {
    throw new ReflectError(file, "", "decodes to another size than its header says");
  }
  return plain(new DataTexture(decoded.data, width, height, RGBAFormat, decoded.type));
}

function blockTexture(bytes, image, compressed) {
  const { width, height } = image;
  const blocks = turnedOver(ddsBlocks(bytes, image.file, image), width, height);
  if (!compressed) return plain(new DataTexture(decodeBc1(blocks, width, height), width, height, RGBAFormat, UnsignedByteType));
  return plain(new CompressedTexture([{ data: blocks, width, height }], width, height, RGB_S3TC_DXT1_Format, UnsignedByteType));
}

function plain(texture) {
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.generateMipmaps = false;
  texture.flipY = false;
  texture.colorSpace = NoColorSpace;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}
