/**
 * The files of a folder that was dropped on the page, each with its path.
 */

/**
 * @param {DataTransfer} transfer
 * @returns {Promise<File[]>} with `relativePath`
 */
export async function droppedFiles(transfer) {
  const items = [...transfer.items].filter((item) => item.kind === "file");
  // Asked for at once: after a first await the list is empty. Handles also work in a page that was opened as a file, where entries do not.
  const asked = items.map((item) => item.getAsFileSystemHandle?.() ?? item.webkitGetAsEntry());
  const found = [];
  for (const handle of await Promise.all(asked)) {
    if (handle?.kind) await fromHandle(handle, "", found);
    else if (handle) await fromEntry(handle, "", found);
  }
  return found;
}

async function fromHandle(handle, before, found) {
  if (handle.kind === "file") return void found.push(named(await handle.getFile(), before + handle.name));
  for await (const inside of handle.values()) await fromHandle(inside, `${before}${handle.name}/`, found);
}

async function fromEntry(entry, before, found) {
  if (entry.isFile) return void found.push(named(await new Promise((take, fail) => entry.file(take, fail)), before + entry.name));
  const reader = entry.createReader();
  const next = () => new Promise((take, fail) => reader.readEntries(take, fail));
  for (let some = await next(); some.length; some = await next()) {
    for (const inside of some) await fromEntry(inside, `${before}${entry.name}/`, found);
  }
}

const named = (file, relativePath) => Object.assign(file, { relativePath });
