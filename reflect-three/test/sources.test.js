import assert from "node:assert/strict";
import { createServer } from "node:http";
import test from "node:test";
import { sourceOf } from "../src/sources.js";
import { isSentence } from "./sentence.js";

/** As a browser's folder chooser gives them. */
const chosen = (path, text) => Object.assign(new File([text], path.split("/").at(-1)), { relativePath: path });

test("files of a chosen folder are found beside their manifest, and by nothing else", async () => {
  const source = sourceOf([chosen("out/reflect.json", "{}"), chosen("out/images/a.exr", "12345"), chosen("other/images/b.exr", "1")]);
  assert.equal((await source.read("images/a.exr", 5, true)).byteLength, 5);
  await assert.rejects(source.read("images/a.exr", 4, true), /bytes are 5 in the file where the manifest says 4/);
  await assert.rejects(source.read("images/b.exr", 1, true), isSentence);
});

test("another origin's Content-Length is not believed: of a packed file it is the packed one's", async (t) => {
  const response = new Response("12345", { headers: { "Content-Length": "3" } });
  Object.defineProperty(response, "type", { value: "cors" });
  t.mock.method(globalThis, "fetch", async () => response);
  assert.equal((await sourceOf("https://example.com/e/").read("scene.gltf", 5, true)).byteLength, 5);
});

test("a server's files: missing ones, and ones that never end, are told with a sentence", async () => {
  const server = createServer((request, response) => {
    if (request.url === "/e%20x/reflect.json") return response.end("{}");
    if (request.url === "/e%20x/endless") return void endless(response);
    response.statusCode = 404;
    response.end();
  });
  const endless = (response) => {
    const timer = setInterval(() => response.write(Buffer.alloc(65536)), 1);
    response.on("close", () => clearInterval(timer));
  };
  await new Promise((ready) => server.listen(0, "127.0.0.1", ready));
  try {
    const source = sourceOf(`http://127.0.0.1:${server.address().port}/e x`);
    assert.equal((await source.read("reflect.json", 10, false)).byteLength, 2);
    await assert.rejects(source.read("images/a.exr", 10, true), /server says 404/);
    await assert.rejects(source.read("endless", 200000, true), (error) => isSentence(error) && /endless: bytes are/.test(error.message));
  } finally {
    server.closeAllConnections();
    server.close();
  }
});
