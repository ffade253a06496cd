/**
 * Where an export's files come from: a folder on a server, or files that a person chose or dropped. Both give bytes by name and never more than they are
 * asked for, so that a file that is too long costs nothing.
 */
import { ReflectError } from "./ReflectError.js";
import { MANIFEST } from "./check.js";

/**
 * @typedef {{read(name: string, most: number, exact: boolean, onBytes?: (bytes: number) => void, signal?: AbortSignal): Promise<ArrayBuffer>}} Source
 *   most: bytes that are read at most; exact: as many must be there
 */

/**
 * @param {string | URL | Iterable<File>} from the folder's address or that of its reflect.json, or the folder's files
 * @returns {Source}
 */
export function sourceOf(from) {
  return typeof from === "string" || from instanceof URL ? urlSource(from) : fileSource(from);
}

function urlSource(url) {
  const page = globalThis.document?.baseURI ?? globalThis.location?.href;
  const address = new URL(url, page);
  if (!address.pathname.endsWith("/") && !address.pathname.endsWith(".json")) address.pathname += "/";
  return {
    async read(name, most, exact, onBytes, signal) {
      let response;
      try {
        response = await fetch(new URL(encodedPath(name), address), { signal });
      } catch (error) {
        if (signal?.aborted) throw error;
        throw new ReflectError(name, "", "cannot be fetched; the server does not answer, or does not allow this page to read it");
      }
      if (!response.ok) throw new ReflectError(name, "", `cannot be fetched (the server says ${response.status})`);
      // Of a file that was packed on the way it is the packed one's, and another origin does not say whether that is so.
      const told = response.type === "cors" || response.headers.get("Content-Encoding") ? null : response.headers.get("Content-Length");
      if (told !== null) checkLength(name, Number(told), most, exact);
      return collected(name, response.body, most, exact, onBytes);
    },
  };
}

/** Names are checked before; what is left for an address are spaces and the like. */
const encodedPath = (name) => name.split("/").map(encodeURIComponent).join("/");

function fileSource(files) {
  const all = [...files].map((file) => ({ file, path: file.webkitRelativePath || file.relativePath || file.name }));
  const root = all
    .filter(({ path }) => path === MANIFEST || path.endsWith(`/${MANIFEST}`))
    .sort((a, b) => a.path.length - b.path.length)[0];
  const folder = root ? root.path.slice(0, -MANIFEST.length) : "";
  const byName = new Map(all.filter(({ path }) => path.startsWith(folder)).map(({ file, path }) => [path.slice(folder.length), file]));
  return {
    async read(name, most, exact, onBytes) {
      const file = byName.get(name);
      if (!file) throw new ReflectError(name, "", "is not among the files; choose the folder that reflect export wrote");
      checkLength(name, file.size, most, exact);
      const bytes = await file.arrayBuffer();
      onBytes?.(bytes.byteLength);
      return bytes;
    },
  };
}

function checkLength(name, length, most, exact) {
  if (length > most || (exact && length !== most)) {
    throw new ReflectError(name, "bytes", `are ${length} in the file where ${exact ? "the manifest says" : "at most these are taken:"} ${most}`);
  }
}

/** A stream's bytes; it ends as soon as there are too many. Memory grows with what came, not with what was promised. */
async function collected(name, stream, most, exact, onBytes) {
  const parts = [];
  let length = 0;
  const reader = stream.getReader();
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    length += part.value.byteLength;
    if (length > most) {
      await reader.cancel().catch(() => {});
      checkLength(name, length, most, exact);
    }
    parts.push(part.value);
    onBytes?.(part.value.byteLength);
  }
  checkLength(name, length, most, exact);
  const out = new Uint8Array(length);
  let at = 0;
  for (const part of parts) {
    out.set(part, at);
    at += part.byteLength;
  }
  return out.buffer;
}
