/**
 * The canvas: renderer, cameras and the scene of an export, drawn when something changed.
 */
import { Box3, Color, PMREMGenerator, PerspectiveCamera, Scene, Spherical, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { RoomEnvironment } from "three/addons/environments/RoomEnvironment.js";
import { ReflectOutput } from "../src/index.js";

const STEP = 0.08; // rad a key press

export class Stage {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {HTMLElement} frame what the canvas fills
   * @param {(milliseconds: number) => void} onFrame
   */
  constructor(canvas, frame, onFrame) {
    this.canvas = canvas;
    this.frame = frame;
    this.onFrame = onFrame;
    this.renderer = new WebGLRenderer({ canvas, antialias: false });
    this.free = new PerspectiveCamera(50, 1, 0.01, 1000);
    this.camera = this.free;
    this.controls = new OrbitControls(this.free, canvas);
    this.controls.addEventListener("change", () => this.draw());
    canvas.addEventListener("keydown", (event) => this._key(event));
    new ResizeObserver(() => this.draw()).observe(frame);
    this.reflections = null;
    this.picture = null;
    this._waiting = 0;
  }

  /** Shows an export from its first picture's camera, or from where all of it is seen. */
  async show(reflections) {
    this.output?.dispose();
    const scene = new Scene();
    scene.background = new Color(0.012, 0.014, 0.017);
    scene.add(reflections.scene);
    // Blender's exporter writes no area lamps and no world: without any lamp what does not mirror would be black.
    const lit = reflections.scene.getObjectsByProperty("isLight", true).length > 0;
    const generator = new PMREMGenerator(this.renderer);
    scene.environment = generator.fromScene(new RoomEnvironment()).texture;
    scene.environmentIntensity = lit ? 0.2 : 0.5;
    generator.dispose();
    this.reflections = reflections;
    this.scene = scene;
    this.output = new ReflectOutput(this.renderer, await reflections.lookPass());
    await this.home();
  }

  /** Back to Blender's camera. */
  async home() {
    const { reflections } = this;
    const picture = reflections.manifest.pictures[0];
    const blender = picture ? await reflections.cameraOf(picture) : reflections.scene.getObjectByProperty("isCamera", true);
    const box = new Box3().setFromObject(reflections.scene);
    const size = box.getSize(new Vector3()).length() || 1;
    const middle = box.getCenter(new Vector3());
    reflections.scene.updateWorldMatrix(true, true);
    if (blender) {
      blender.getWorldPosition(this.free.position);
      const ahead = blender.getWorldDirection(new Vector3());
      // On the line of sight, as far as what mirrors is.
      const far = Math.max(this._mirrors(middle).sub(this.free.position).dot(ahead), 0.05 * size);
      this.controls.target.copy(this.free.position).addScaledVector(ahead, far);
      this.free.fov = blender.fov ?? 50;
      this.fitted = picture ? picture.width / picture.height : (blender.aspect ?? 1);
    } else {
      this.free.position.copy(middle).add(new Vector3(0.6, 0.4, 0.9).multiplyScalar(size));
      this.controls.target.copy(middle);
      this.free.fov = 50;
      this.fitted = 1;
    }
    this.fov = this.free.fov;
    [this.free.near, this.free.far] = [size / 5000, size * 20];
    this.controls.update();
    this.draw();
  }

  /** The export's camera and Cycles' frame behind, or the free camera again. */
  async compare(picture) {
    await this.reflections.showBehind(picture);
    this.picture = picture;
    this.camera = picture ? await this.reflections.cameraOf(picture) : this.free;
    this.controls.enabled = !picture;
    this.frame.style.cssText = picture ? fitting(picture.width / picture.height) : "";
    this.draw();
  }

  /** In the next frame, once. */
  draw() {
    if (this._waiting || !this.output) return;
    this._waiting = requestAnimationFrame(() => {
      this._waiting = 0;
      this._draw();
    });
  }

  _draw() {
    const { clientWidth: width, clientHeight: height } = this.frame;
    if (!width || !height) return;
    const ratio = Math.min(devicePixelRatio, 2);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    if (this.camera === this.free) {
      this.free.aspect = width / height;
      // As much to either side as Blender's picture has, also where the window is narrower.
      const half = Math.tan((this.fov * Math.PI) / 360) * Math.max(1, this.fitted / this.free.aspect);
      this.free.fov = (Math.atan(half) * 360) / Math.PI;
      this.free.updateProjectionMatrix();
    }
    const start = performance.now();
    this.output.render(this.scene, this.camera);
    // One pixel read back: what was drawn is then really there, and the time is that of the graphics card as well.
    const gl = this.renderer.getContext();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    this.onFrame(performance.now() - start);
  }

  _mirrors(otherwise) {
    const box = new Box3();
    for (const mesh of this.reflections.mirrors) box.expandByObject(mesh);
    return box.isEmpty() ? otherwise.clone() : box.getCenter(new Vector3());
  }

  _key(event) {
    const turns = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, -STEP], ArrowDown: [0, STEP] }[event.key];
    const zoom = { "+": 0.9, "=": 0.9, "-": 1 / 0.9 }[event.key];
    if (!this.controls.enabled || (!turns && !zoom)) return;
    event.preventDefault();
    const { target } = this.controls;
    const around = new Spherical().setFromVector3(this.free.position.clone().sub(target));
    if (turns) {
      around.theta += turns[0];
      around.phi = Math.min(Math.max(around.phi + turns[1], 0.01), Math.PI - 0.01);
    }
    around.radius *= zoom ?? 1;
    this.free.position.setFromSpherical(around).add(target);
    this.controls.update();
    this.draw();
  }
}

/** The largest frame of a shape inside its surroundings, which measure themselves in container units. */
const fitting = (aspect) => `aspect-ratio:${aspect};width:min(100%,100cqh*${aspect});height:auto;`;
