/**
 * Headless Chromium with WebGL 2 on software, the same on every machine: Mesa's llvmpipe where it is, as Blender uses it here, else Chromium's own SwiftShader,
 * which takes many minutes to compile kernels of a thousand lines. ANGLE=swiftshader chooses.
 */
import { existsSync, readdirSync } from "node:fs";
import { chromium } from "playwright-core";

const LIBRARIES = "/usr/lib";

export function opened(path = process.env.CHROMIUM ?? "/usr/bin/chromium") {
  const angle = process.env.ANGLE ?? (hasMesa() ? "gl-egl" : "swiftshader");
  return chromium.launch({
    executablePath: path,
    args: ["--no-sandbox", `--use-angle=${angle}`, "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
    env: { ...process.env, LIBGL_ALWAYS_SOFTWARE: "1" },
  });
}

function hasMesa() {
  if (!existsSync(LIBRARIES)) return false;
  return ["", ...readdirSync(LIBRARIES)].some((folder) => existsSync(`${LIBRARIES}/${folder}/libEGL_mesa.so.0`));
}
