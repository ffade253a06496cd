/**
 * Small checks of values that a stranger wrote. Each either returns the value or throws a ReflectError that says where it stood.
 */
import { ReflectError } from "./ReflectError.js";
import { DEPTH, DIGITS, ENTRIES, FLOAT } from "./limits.js";

export const MANIFEST = "reflect.json";

/** @returns {never} */
export function refuse(field, reason) {
  throw new ReflectError(MANIFEST, field, reason);
}

const isObject = (value) => typeof value === "object" && value !== null && !Array.isArray(value);

export function object(value, field) {
  if (!isObject(value)) refuse(field, "is not an object");
  if (Object.keys(value).length > ENTRIES) refuse(field, `has more than ${ENTRIES} entries`);
  return value;
}

/** An object with exactly these fields. */
export function record(value, field, names) {
  for (const key of Object.keys(object(value, field))) if (!names.includes(key)) refuse(field, `has a field "${key.slice(0, 40)}" that no manifest has`);
  for (const name of names) if (!Object.hasOwn(value, name)) refuse(field, `has no field ${name}`);
  return value;
}

export function list(value, field, length = null) {
  if (!Array.isArray(value)) refuse(field, "is not a list");
  if (value.length > ENTRIES) refuse(field, `has more than ${ENTRIES} entries`);
  if (length !== null && value.length !== length) refuse(field, `has ${value.length} entries in place of ${length}`);
  return value;
}

/** Also an empty one: what has no material shows one without a name. */
export function text(value, field, most = 1024) {
  if (typeof value !== "string") refuse(field, "is not a text");
  if (value.length > most) refuse(field, `is longer than ${most} characters`);
  return value;
}

/** The name of a method or a kind of asset. */
export function word(value, field) {
  if (typeof value !== "string" || !/^[A-Za-z][A-Za-z0-9_]{0,79}$/.test(value)) refuse(field, "is not a word of letters, digits and _");
  return value;
}

export function number(value, field, least = -FLOAT, most = FLOAT) {
  if (typeof value !== "number" || !Number.isFinite(value)) refuse(field, "is not a finite number");
  if (value < least || value > most) refuse(field, `is ${value} and not between ${least} and ${most}`);
  return value;
}

export function whole(value, field, least, most) {
  number(value, field);
  if (!Number.isSafeInteger(value)) refuse(field, `is ${value} and not a whole number`);
  return number(value, field, least, most);
}

/** An own entry of a table: never something that all objects have, such as "constructor". */
export function entry(table, id, field) {
  text(id, field);
  if (!Object.hasOwn(table, id)) refuse(field, `names "${id.slice(0, 40)}", which is not there`);
  return table[id];
}

/** Every number is finite, whatever field it stands in, and nothing is nested without end. JSON has no NaN, but 1e999. */
export function allFinite(value, field = "", depth = 0) {
  if (depth > DEPTH) refuse(field, "is nested too deeply");
  if (typeof value === "number") {
    if (!Number.isFinite(value)) refuse(field, "is not a finite number");
  } else if (typeof value === "object" && value !== null) {
    for (const key of Object.keys(value)) {
      allFinite(value[key], Array.isArray(value) ? `${field}[${key}]` : field ? `${field}.${key}` : key, depth + 1);
    }
  }
}

const NAME = /^[\p{L}\p{N}_(+][\p{L}\p{N}_ .,()+-]{0,199}$/u;

/** A file's name in one of the export's folders ("" for the export's own): no way out of it, and no address. */
export function fileName(value, field, folder, endings) {
  text(value, field, 255);
  const start = folder && `${folder}/`;
  const name = value.startsWith(start) ? value.slice(start.length) : null;
  if (name === null || !NAME.test(name) || name.includes("..") || !endings.some((ending) => name.endsWith(ending))) {
    refuse(field, `is "${value.slice(0, 60)}", which is no plain name ${folder ? `in ${folder}/` : "in the export"} that ends with ${endings.join(" or ")}`);
  }
  return value;
}

/** An id is the name of its file without folder and ending. */
export function idOf(id, file, field) {
  if (file.slice(file.lastIndexOf("/") + 1, file.lastIndexOf(".")) !== id) refuse(field, "is not named as its file is");
}

/** The checksum of a file; a name that holds its beginning must be that file's. */
export function sha256(value, field, file = null) {
  if (typeof value !== "string" || !/^[0-9a-f]{64}$/.test(value)) refuse(field, "is not a SHA-256 in 64 small hexadecimal digits");
  if (file !== null && file.slice(0, file.lastIndexOf(".")).slice(-DIGITS) !== value.slice(0, DIGITS)) refuse(field, "is not the one that the file's name begins");
  return value;
}
