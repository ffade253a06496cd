export { ReflectLoader } from "./ReflectLoader.js";
export { Reflections } from "./Reflections.js";
export { ReflectOutput } from "./ReflectOutput.js";
export { ReflectError } from "./ReflectError.js";
export { LookPass } from "./look.js";
export { checkManifest, parseManifest } from "./checkManifest.js";
