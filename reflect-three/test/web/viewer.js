/**
 * node viewer.js EXPORT OUT METHOD: the built viewer, opened as a file, is given the export's folder; pictures of what a person sees, and OUT/viewer.json with what
 * the page says. tests/web/test_viewer.py looks at them.
 */
import { mkdirSync, writeFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { opened } from "./browser.js";

const [from, out, method] = process.argv.slice(2);
const PAGE = resolve(dirname(fileURLToPath(import.meta.url)), "../../viewer/dist/index.html");

const browser = await opened();
mkdirSync(out, { recursive: true });
const told = { errors: [], asked: [] };
try {
  const page = await browser.newPage({ viewport: { width: 1100, height: 700 } });
  page.on("pageerror", (error) => told.errors.push(String(error)));
  page.on("console", (message) => message.type() === "error" && told.errors.push(message.text()));
  page.on("request", (request) => /^https?:/.test(request.url()) && told.asked.push(request.url()));
  await page.goto(`${pathToFileURL(PAGE)}?method=${method}`);
  await page.screenshot({ path: join(out, "welcome.png") });
  await page.locator("#folder-first").setInputFiles(resolve(from));
  const shown = () => page.waitForFunction(() => document.getElementById("loading").hidden && document.getElementById("memory").textContent !== "–", null, { timeout: 120000 });
  await shown();
  await page.waitForFunction(() => document.getElementById("frame-time").textContent !== "–");
  await page.waitForTimeout(1500);
  told.name = await page.locator("#name").textContent();
  told.methods = await page.locator("#methods label").allTextContents();
  told.checked = await page.locator("#methods input:checked").inputValue();
  told.memory = await page.locator("#memory").textContent();
  told.error = await page.locator("#error").isVisible();
  await page.screenshot({ path: join(out, "around.png") });
  await page.locator("#canvas").focus();
  for (let i = 0; i < 6; i++) await page.keyboard.press("ArrowLeft");
  await page.waitForTimeout(1000);
  await page.screenshot({ path: join(out, "turned.png") });
  // As a person without a mouse would: the radio buttons' own keys.
  await page.locator('input[name="view"][value="around"]').focus();
  await page.keyboard.press("ArrowRight");
  await page.locator("#wipe-row").waitFor({ state: "visible" });
  await page.waitForTimeout(1500);
  told.wipe = await page.locator("#wipe").inputValue();
  await page.screenshot({ path: join(out, "compare.png") });
  await page.setViewportSize({ width: 390, height: 740 });
  await page.waitForTimeout(1500);
  await page.screenshot({ path: join(out, "narrow.png") });
  told.wide = await page.evaluate(() => document.documentElement.scrollWidth);
} finally {
  await browser.close();
  writeFileSync(join(out, "viewer.json"), JSON.stringify(told, null, 1));
}
