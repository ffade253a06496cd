/**
 * node draw.js EXPORT OUT [METHOD,METHOD] [--rays N] [--pose JSON] [--plain]: what the browser draws of an export's first picture, as OUT/<method>.rgba (8 bits, bottom row
 * first) and OUT/drawn.json. --plain: as if the graphics card read no DXT1. tests/web/test_three.py holds them against Blender.
 */
import { mkdirSync, writeFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";
import { opened } from "./browser.js";
import { served } from "./server.js";

const { values, positionals } = parseArgs({ allowPositionals: true, options: { rays: { type: "string", default: "7" }, pose: { type: "string", default: "null" }, plain: { type: "boolean", default: false } } });
const [from, out, wanted] = positionals;
const PACKAGE = resolve(dirname(fileURLToPath(import.meta.url)), "../..");

const { server, address } = await served({ package: PACKAGE, export: resolve(from) });
const browser = await opened();
try {
  const page = await browser.newPage();
  const said = [];
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && said.push(message.text()));
  page.on("pageerror", (error) => said.push(String(error)));
  // Each method on a page of its own: what it takes to load is not what others have left.
  const afresh = async () => {
    await page.goto(`${address}/package/test/web/compare.html`);
    await page.waitForFunction("window.ready");
    return page.evaluate((asked) => window.open_(...asked), [`${address}/export/`, Number(values.rays), JSON.parse(values.pose), values.plain]);
  };
  const told = await afresh();
  mkdirSync(out, { recursive: true });
  told.drawn = {};
  for (const method of wanted ? wanted.split(",") : told.methods) {
    await afresh();
    const { pixels, ...rest } = await page.evaluate((name) => window.draw(name), method);
    writeFileSync(join(out, `${method}.rgba`), Buffer.from(pixels, "base64"));
    told.drawn[method] = rest;
    console.log(method, Object.entries(rest).filter(([, v]) => typeof v === "number").map(([k, v]) => `${k} ${v.toFixed(1)}`).join(" "));
  }
  told.life = await page.evaluate(([first, second]) => window.live(first, second), [told.methods[0], told.methods.at(-1)]);
  told.said = said;
  writeFileSync(join(out, "drawn.json"), JSON.stringify(told, null, 1));
  for (const line of said) console.log("page:", line.slice(0, 2000));
} finally {
  await browser.close();
  server.closeAllConnections();
  server.close();
}
