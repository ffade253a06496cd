/**
 * Draws a scene through the export's view transform without an EffectComposer: scene-linear into a half-float target, then LookPass to the canvas.
 */
import { HalfFloatType, Vector2, WebGLRenderTarget } from "three";

const size = new Vector2();

export class ReflectOutput {
  /**
   * @param {import("three").WebGLRenderer} renderer
   * @param {import("./look.js").LookPass} look reflections.lookPass()
   * @param {{samples?: number}} [options] samples: of anti-aliasing; 0 for a picture that is compared number by number
   */
  constructor(renderer, look, { samples = 4 } = {}) {
    this.renderer = renderer;
    this.look = look;
    this.look.renderToScreen = true;
    this.target = new WebGLRenderTarget(1, 1, { type: HalfFloatType, samples });
  }

  render(scene, camera) {
    this.renderer.getDrawingBufferSize(size);
    if (this.target.width !== size.x || this.target.height !== size.y) this.target.setSize(size.x, size.y);
    this.renderer.setRenderTarget(this.target);
    this.renderer.render(scene, camera);
    this.look.render(this.renderer, null, this.target);
    this.renderer.setRenderTarget(null);
  }

  /**
   * Compiles what an object needs without drawing it, where the browser can beside the page: `reflections.use(method, {prepare: (o) => output.prepare(o, scene, camera)})`.
   */
  async prepare(object, scene, camera) {
    // A program is compiled for the kind of target that it draws into.
    this.renderer.setRenderTarget(this.target);
    const compiled = this.renderer.compileAsync(object, camera, scene);
    this.renderer.setRenderTarget(null);
    await compiled;
  }

  dispose() {
    this.target.dispose();
    this.look.dispose();
  }
}
