/**
 * What a person is told when an export cannot be shown: one sentence that names the file and the field.
 */
export class ReflectError extends Error {
  /**
   * @param {string} file the file that is wrong, by its name in the export
   * @param {string} field what is wrong with it, or where
   * @param {string} reason the end of the sentence, without the full stop
   */
  constructor(file, field, reason) {
    super(`${shortened(file)}: ${field ? `${shortened(field)} ` : ""}${shortened(reason, 200)}.`);
    this.name = "ReflectError";
    this.file = file;
    this.field = field;
  }
}

/** Text from a stranger's file, as far as it may stand in a sentence: one line, no control characters, not endless. */
export function shortened(text, most = 80) {
  const plain = String(text).slice(0, 4 * most).replace(/[\u0000-\u001f\u007f-\u009f\u2028\u2029\u202a-\u202e\u2066-\u2069]+/g, " ");
  return plain.length > most ? `${plain.slice(0, most - 1)}…` : plain;
}
