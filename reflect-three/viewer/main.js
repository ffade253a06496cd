/**
 * The page: opens an export, switches methods, lays Cycles' picture over it. `?export=ADDRESS` opens one that is served; `&method=NAME` shows a method of it.
 */
import { ReflectError, ReflectLoader } from "../src/index.js";
import { droppedFiles } from "./folder.js";
import { Stage } from "./stage.js";

const at = (id) => document.getElementById(id);
const asked = new URLSearchParams(location.search);
const megabytes = (bytes) => (bytes < 1e6 ? `${Math.max(1, Math.round(bytes / 1e3))} KB` : `${(bytes / 1e6).toFixed(bytes < 1e7 ? 1 : 0)} MB`);
const words = (method) => method.replaceAll("_", " ");

let stage = null;
let reflections = null;
let truth = null; // address of Cycles' picture
let opening = 0;

try {
  stage = new Stage(at("canvas"), at("frame"), (time) => (at("frame-time").textContent = `${time.toFixed(time < 10 ? 1 : 0)} ms`));
} catch {
  tell(new Error("This browser shows no WebGL 2: update it, or switch its hardware acceleration on."));
}

async function open(from) {
  if (!stage) return;
  const own = ++opening;
  tell(null);
  progress({ method: null, loaded: 0, total: 0, shown: null });
  try {
    const opened = await new ReflectLoader(stage.renderer).load(from, { onProgress: progress, onWarning: (sentence) => tell(new Error(sentence)) });
    if (own !== opening) return void opened.dispose();
    await reflections?.dispose();
    URL.revokeObjectURL(truth);
    truth = null;
    reflections = opened;
    document.body.dataset.state = "open";
    at("name").textContent = document.title = reflections.manifest.scene.name || "Reflect";
    document.title += " – Reflect";
    listMethods();
    showViews();
    await stage.show(reflections);
    await view("around");
    const wanted = asked.get("method");
    await use(reflections.methods.includes(wanted) ? wanted : best());
    if (asked.get("view") === "compare" && reflections.manifest.pictures.length) await view("compare");
  } catch (error) {
    tell(error);
  } finally {
    at("loading").hidden = true;
  }
}

/** What a plan chose, or what was named last: exports name the plain ones first. */
const best = () => (reflections.methods.includes("auto") ? "auto" : reflections.methods.at(-1));

async function use(method) {
  const input = document.querySelector(`input[name="method"][value="${CSS.escape(method)}"]`);
  if (input) input.checked = true;
  tell(null);
  try {
    const own = reflections;
    if (!(await own.use(method, { onProgress: progress, prepare: (object) => stage.output.prepare(object, stage.scene, stage.camera) })) || own !== reflections) return;
    at("memory").textContent = megabytes(own.sizeOf(method).memory);
    at("loading").hidden = true;
    at("tag-ours").textContent = words(method);
  } catch (error) {
    tell(error);
    at("loading").hidden = true;
  }
  stage.draw();
}

function progress({ method, loaded, total, shown }) {
  at("loading").hidden = false;
  if (total) at("bar").value = loaded / total;
  else at("bar").removeAttribute("value");
  const size = total ? `: ${megabytes(loaded)} of ${megabytes(total)}` : "";
  at("loading-text").textContent = `${method ? words(method) : "Scene"}${size}${shown && shown !== method ? `, ${words(shown)} meanwhile` : ""}`;
  stage.draw();
}

function listMethods() {
  const list = at("methods").querySelector(".choices");
  list.replaceChildren(
    ...reflections.methods.map((method) => {
      const label = document.createElement("label");
      const input = Object.assign(document.createElement("input"), { type: "radio", name: "method", value: method });
      const text = Object.assign(document.createElement("span"), { textContent: words(method) });
      const size = Object.assign(document.createElement("small"), { textContent: megabytes(reflections.sizeOf(method).download) });
      input.addEventListener("change", () => use(method));
      label.append(input, text, size);
      return label;
    }),
  );
  at("methods").hidden = false;
  at("numbers").hidden = false;
}

function showViews() {
  at("views").hidden = false;
  at("views").querySelector(".row").hidden = !reflections.manifest.pictures.length;
}

async function view(which) {
  const picture = which === "compare" ? reflections.manifest.pictures[0] : null;
  document.querySelector(`input[name="view"][value="${which}"]`).checked = true;
  try {
    if (picture && !truth) truth = URL.createObjectURL(await reflections.pictureFile(picture.truth));
    await stage.compare(picture);
  } catch (error) {
    return tell(error);
  }
  if (truth) at("truth").src = truth;
  for (const id of ["truth", "edge", "tag-ours", "tag-cycles", "wipe-row"]) at(id).hidden = !picture;
  at("home").hidden = Boolean(picture);
  wipe();
}

function wipe() {
  const share = Number(at("wipe").value);
  at("truth").style.clipPath = `inset(0 0 0 ${share}%)`;
  at("edge").style.left = `${share}%`;
}

function tell(error) {
  const box = at("error");
  box.hidden = !error;
  if (!error) return;
  box.textContent = error instanceof ReflectError || error.constructor === Error ? error.message : `Something went wrong that should not: ${error}`;
  if (!(error instanceof ReflectError)) console.warn(error);
}

for (const id of ["folder", "folder-first"]) {
  at(id).addEventListener("change", ({ target }) => {
    if (target.files.length) open([...target.files]);
  });
}
for (const input of document.querySelectorAll('input[name="view"]')) input.addEventListener("change", () => view(input.value));
at("wipe").addEventListener("input", wipe);
at("home").addEventListener("click", () => stage.home());

// The picture itself may be wiped, too.
at("frame").addEventListener("pointermove", (event) => {
  if (at("wipe-row").hidden || (event.pointerType === "mouse" && !event.buttons)) return;
  const { left, width } = at("frame").getBoundingClientRect();
  at("wipe").value = (100 * (event.clientX - left)) / width;
  wipe();
});

addEventListener("dragover", (event) => {
  event.preventDefault();
  document.body.classList.add("dropping");
});
addEventListener("dragleave", (event) => event.relatedTarget || document.body.classList.remove("dropping"));
addEventListener("drop", async (event) => {
  event.preventDefault();
  document.body.classList.remove("dropping");
  try {
    await open(await droppedFiles(event.dataTransfer));
  } catch (error) {
    tell(error);
  }
});

if (asked.has("export") && stage) open(asked.get("export"));
