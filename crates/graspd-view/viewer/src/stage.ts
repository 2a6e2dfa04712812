// Renderer, camera, light. Draws only when something has changed.
import {
  Box3, DirectionalLight, HemisphereLight, PCFSoftShadowMap, PerspectiveCamera, Scene, Sphere, Vector3, WebGLRenderer, type Object3D,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

export class Stage {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(28, 1, 0.01, 10);
  readonly controls: OrbitControls;
  /** How often a picture was drawn. */
  drawn = 0;
  private readonly renderer: WebGLRenderer;
  private readonly key = new DirectionalLight(0xffffff, 2.3);
  private readonly center = new Vector3();
  private radius = 0.2;
  private isStale = true;

  constructor(private readonly container: HTMLElement) {
    this.renderer = new WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFSoftShadowMap;
    const canvas = this.renderer.domElement;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", "The hand and the object in three dimensions");
    container.prepend(canvas);
    this.camera.up.set(0, 0, 1);
    this.scene.add(new HemisphereLight(0xffffff, 0xb5b0a8, 1.9));
    this.key.castShadow = true;
    this.key.shadow.mapSize.set(1024, 1024);
    this.key.shadow.normalBias = 0.001;
    this.key.shadow.bias = -0.0005;
    this.key.shadow.radius = 4;
    this.scene.add(this.key, this.key.target);
    const fill = new DirectionalLight(0xffffff, 0.5);
    fill.position.set(1, 0.3, -0.6);
    this.camera.add(fill);
    this.scene.add(this.camera);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.invalidate());
    new ResizeObserver(() => this.resize()).observe(container);
    this.resize();
    const tick = () => {
      if (this.isStale) this.draw();
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  invalidate(): void {
    this.isStale = true;
  }

  add(...objects: Object3D[]): void {
    this.scene.add(...objects);
  }

  /** Draws at once, so that a page that is hidden is ready, too. */
  draw(): void {
    this.isStale = false;
    // The key light stands above the viewer's left shoulder.
    const away = this.camera.position.clone().sub(this.controls.target).normalize();
    const right = new Vector3().crossVectors(this.camera.up, away).normalize();
    const up = new Vector3().crossVectors(away, right);
    this.key.position.copy(this.center)
      .addScaledVector(away, 2 * this.radius).addScaledVector(up, 2.2 * this.radius).addScaledVector(right, -1.6 * this.radius);
    this.key.target.position.copy(this.center);
    this.renderer.render(this.scene, this.camera);
    ++this.drawn;
  }

  /** Looks at a box from a direction, as near as possible. */
  frame(box: Box3, direction: Vector3): void {
    const sphere = box.getBoundingSphere(new Sphere());
    this.center.copy(sphere.center);
    this.radius = Math.max(1e-3, sphere.radius);
    const half = Math.min(this.camera.fov, this.camera.fov * this.camera.aspect) * Math.PI / 360;
    const distance = 0.86 * this.radius / Math.sin(half);
    this.controls.target.copy(this.center);
    this.camera.position.copy(this.center).addScaledVector(direction.clone().normalize(), distance);
    this.camera.near = Math.max(1e-3, distance / 100);
    this.camera.far = 20 * distance;
    this.controls.minDistance = 0.15 * this.radius;
    this.controls.maxDistance = 8 * distance;
    this.camera.updateProjectionMatrix();
    const shadow = this.key.shadow.camera;
    shadow.left = shadow.bottom = -1.3 * this.radius;
    shadow.right = shadow.top = 1.3 * this.radius;
    shadow.near = 0.5 * this.radius;
    shadow.far = 6 * this.radius;
    shadow.updateProjectionMatrix();
    this.controls.update();
    this.invalidate();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.container;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }
}
