/**
 * npm run build: the viewer as one page, viewer/dist/index.html, with three and everything else inside. It needs no server and no network.
 */
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const HERE = dirname(fileURLToPath(import.meta.url));
const read = (name) => readFileSync(join(HERE, name), "utf8");

const bundled = await build({ entryPoints: [join(HERE, "main.js")], bundle: true, minify: true, format: "iife", target: "es2022", write: false, legalComments: "inline" });
const style = await build({ entryPoints: [join(HERE, "viewer.css")], minify: true, write: false });
// The page runs itself and nothing that an export could bring.
const POLICY = "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval'; style-src 'unsafe-inline'; img-src blob: data:; connect-src 'self' http: https: blob: data:";

/** A function in place of text: three's source has dollar signs. */
const page = read("index.html")
  .replace(/<script type="importmap">[\s\S]*?<\/script>\s*/, () => `<meta http-equiv="Content-Security-Policy" content="${POLICY}" />\n    `)
  .replace(/<link rel="stylesheet"[^>]*>/, () => `<style>${style.outputFiles[0].text}</style>`)
  .replace(/<script type="module"[^>]*><\/script>/, () => `<script>${bundled.outputFiles[0].text}</script>`);
mkdirSync(join(HERE, "dist"), { recursive: true });
writeFileSync(join(HERE, "dist", "index.html"), page);
console.log(`viewer/dist/index.html, ${Math.round(page.length / 1024)} KB`);
