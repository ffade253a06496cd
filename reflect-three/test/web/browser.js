/** Headless Chromium whose WebGL 2 is SwiftShader: the same pictures on every machine, with no graphics card. */
import { chromium } from "playwright-core";

export function opened(path = process.env.CHROMIUM ?? "/usr/bin/chromium") {
  return chromium.launch({
    executablePath: path,
    args: ["--no-sandbox", `--use-angle=${process.env.ANGLE ?? "swiftshader"}`, "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
  });
}
