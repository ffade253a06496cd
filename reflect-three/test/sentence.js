import assert from "node:assert/strict";
import { ReflectError } from "../src/ReflectError.js";

/** One sentence that names the file and, where there is one, the field. */
export function isSentence(error) {
  assert.ok(error instanceof ReflectError, `not ours: ${error?.stack ?? error}`);
  assert.match(error.message, /^[^:\n]+: [^\n]+\.$/);
  assert.ok(error.message.length < 400, error.message);
  return true;
}
