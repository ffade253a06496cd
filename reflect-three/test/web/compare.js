import { WebGLRenderer, Scene } from "three";
import { ReflectLoader, ReflectOutput } from "../../src/index.js";

const canvas = document.querySelector("canvas");
let renderer, scene, reflections, output, camera;

/** @returns {Promise<object>} what is there and how long opening took */
window.open_ = async (url, rays, pose, plain) => {
  renderer ??= new WebGLRenderer({ canvas, preserveDrawingBuffer: true });
  const start = performance.now();
  reflections = await new ReflectLoader(plain ? null : renderer).load(url, { rays });
  const opened = performance.now() - start;
  const picture = reflections.manifest.pictures[0];
  renderer.setPixelRatio(1);
  renderer.setSize(picture.width, picture.height, false);
  scene = new Scene();
  scene.add(reflections.scene);
  if (pose) reflections.scene.position.fromArray(pose.position), reflections.scene.rotation.fromArray(pose.rotation), reflections.scene.scale.setScalar(pose.scale);
  camera = await reflections.cameraOf(picture);
  output = new ReflectOutput(renderer, await reflections.lookPass(), { samples: 0 });
  await reflections.showBehind(picture);
  const gl = renderer.getContext();
  const debug = gl.getExtension("WEBGL_debug_renderer_info");
  return { methods: reflections.methods, width: picture.width, height: picture.height, opened, device: gl.getParameter(debug ? debug.UNMASKED_RENDERER_WEBGL : gl.RENDERER) };
};

/** @returns {Promise<object>} the canvas as base64 of RGBA bytes, bottom row first, and what it took */
window.draw = async (method) => {
  const progress = [];
  const start = performance.now();
  let compile = 0;
  const prepare = async (object) => {
    const began = performance.now();
    await output.prepare(object, scene, camera);
    compile = Math.max(compile, performance.now() - began);
  };
  await reflections.use(method, { onProgress: (told) => progress.push({ ...told, at: performance.now() - start }), prepare });
  const ready = performance.now();
  output.render(scene, camera);
  const gl = renderer.getContext();
  const { width, height } = canvas;
  const pixels = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  const first = performance.now();
  const frames = 3;
  for (let i = 0; i < frames; i++) output.render(scene, camera);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  const frame = (performance.now() - first) / frames;
  let text = "";
  for (let i = 0; i < pixels.length; i += 4096) text += String.fromCharCode(...pixels.subarray(i, i + 4096));
  return { pixels: btoa(text), load: ready - start - compile, compile, first: first - ready, frame, error: gl.getError(), shown: reflections.shown, progress, size: reflections.sizeOf(method) };
};

/** A life: two methods asked for at once, three's own mirrors, all freed. What is left of it on the card, and what `use` said. */
window.live = async (first, second) => {
  const answers = await Promise.all([reflections.use(first), reflections.use(second)]);
  const { shown } = reflections;
  output.render(scene, camera);
  const most = renderer.info.memory.textures;
  await reflections.release();
  output.render(scene, camera);
  await reflections.use(null);
  await reflections.showBehind(null);
  const ordinary = [...reflections.ordinary].every(([mesh, material]) => mesh.material === material);
  output.render(scene, camera);
  await reflections.dispose();
  output.dispose();
  return { answers, shown, most, ordinary, left: { ...renderer.info.memory }, error: renderer.getContext().getError() };
};
window.ready = true;
