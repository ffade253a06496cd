/**
 * How large an export may be. What rows of tables stand for makes a manifest long; these numbers only keep a hostile one from taking the browser's memory.
 */
export const FORMAT = 1;
export const MANIFEST_BYTES = 64 * 2 ** 20;
export const SIDE = 16384; // texels
export const IMAGES_BYTES = 4 * 2 ** 30; // all images together, on the graphics card and on the way
export const FILE_BYTES = IMAGES_BYTES;
export const BUFFER_BYTES = 2 ** 30; // of a glTF
export const PICTURE_BYTES = 256 * 2 ** 20; // a file for an <img>, or of a glTF
export const VALUES = 2 ** 27; // of a glTF's accessor
export const EMPTY_VALUES = 2 ** 20; // of one that no buffer fills
export const SHADER_BYTES = 4 * 2 ** 20;
export const DEFLATE = 1032; // bytes that it can make of one at most
export const SLOTS = 224; // vec4: of a fragment shader's uniforms that WebGL 2 promises
export const DIGITS = 12; // of a content's SHA-256 in its file's name
export const FLOAT = 3.4e38; // a graphics card keeps hardly more
export const NODE = 2 ** 24 - 1;
export const SCENE = "scene.gltf";
export const BAKES = "bakes.json";
export const SCENE_BYTES = 256 * 2 ** 20;
export const ENTRIES = 65536; // of any table
export const DEPTH = 64; // of nested lists

/** Bytes of a texel by the image's kind: on the card, and what the file's header must say. */
export const KINDS = {
  tx: { bits: 64, exr: "half" },
  buf: { bits: 128, exr: "float" },
  look: { bits: 64, exr: "half" },
  bc1: { bits: 4, exr: null },
};
