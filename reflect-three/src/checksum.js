/**
 * Whether bytes are those that the manifest promises. Browsers give SHA-256 to pages of https, localhost and files; over plain http there is none.
 */
import { ReflectError } from "./ReflectError.js";

/**
 * @param {ArrayBuffer} bytes
 * @param {string} file its name, for errors
 * @param {{bytes: number, sha256: string}} promised
 * @param {SubtleCrypto | undefined} subtle
 * @returns {Promise<boolean>} false where nothing can compute it: lengths and headers are all that was checked then
 */
export async function checkBytes(bytes, file, promised, subtle = globalThis.crypto?.subtle) {
  if (bytes.byteLength !== promised.bytes) throw new ReflectError(file, "bytes", `are ${bytes.byteLength} where the manifest says ${promised.bytes}`);
  if (!subtle) return false;
  const digest = new Uint8Array(await subtle.digest("SHA-256", bytes));
  const hex = Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
  if (hex !== promised.sha256) throw new ReflectError(file, "sha256", "is not the manifest's, so the file was changed or damaged");
  return true;
}

export const NO_CHECKSUMS = "This page has no crypto.subtle (it needs https or localhost): files are checked by length and header, not by checksum.";
