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
 * @returns {Promise<import("three").Texture>}
 * @param {ArrayBuffer} bytes the file, whose checksum holds
 * @param {import("./checkManifest.js").ImageEntry} image
 * @param {boolean} compressed whether the graphics card reads DXT1
 */
export async function textureOf(bytes, image, compressed) {
  const kind = KINDS[image.kind];
  if (!kind.exr) return blockTexture(bytes, image, compressed);
  if (image.file.endsWith(".ktx2")) {
    const { ktx2Texels } = await import("./ktx2.js"); // most exports have none, and its decoder is 50 KB
    const { width, height } = image;
    return plain(new DataTexture(await ktx2Texels(bytes, image.file, { width, height, type: kind.exr }), width, height, RGBAFormat, typeOf(kind.exr)));
  }
  checkExr(bytes, image.file, { width: image.width, height: image.height, type: kind.exr });
  return exrTexture(bytes, image.file, kind.exr, image);
}

/**
 * @param {"half"|"float"} type as the header has it, so that no number is rounded
 * @returns {DataTexture}
 */
export function exrTexture(bytes, file, type, { width, height }) {
  const loader = new EXRLoader();
  loader.setDataType(typeOf(type));
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

const typeOf = (type) => (type === "half" ? HalfFloatType : FloatType);

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
