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

  dispose() {
    this.target.dispose();
    this.look.dispose();
  }
}
