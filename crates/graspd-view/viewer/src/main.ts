// The page of `graspd view`: what is shown, and what keys, clicks and touches do to it.
import { Box3, DoubleSide, Mesh, MeshStandardMaterial, Vector3 } from "three";
import { Contacts, heat } from "./contacts";
import { Data, type GraspDescription } from "./format";
import { creased, positions } from "./geometry";
import { HandModel, Motion } from "./hand";
import { LOSS_COLORS, LossPlot } from "./losses";
import { Penetration } from "./penetration";
import { Stage } from "./stage";
import { GraspTable } from "./table";

type Mode = "execution" | "optimization";

/** Seconds from pre-grasp to squeeze, and from the first step to the last. */
const DURATIONS: Record<Mode, number> = { execution: 2.5, optimization: 5 };
const STATIONS = ["pre-grasp", "grasp", "squeeze"];

function element<T extends HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page lacks #${id}`);
  return found as T;
}

function fail(message: string): void {
  const box = element("failure");
  box.textContent = message;
  box.hidden = false;
  document.documentElement.dataset.state = "failed";
}

class Viewer {
  private readonly data: Data;
  private readonly table: GraspTable;
  private readonly plot: LossPlot;
  private readonly slider = element<HTMLInputElement>("slider");
  private stage: Stage | null = null;
  private hand: HandModel | null = null;
  private penetration: Penetration | null = null;
  private contacts: Contacts | null = null;
  private objectMaterial: MeshStandardMaterial | null = null;

  private selected = 0;
  private mode: Mode = "execution";
  /** On the slider: 0 pre-grasp to 2 squeeze. */
  private time = 1;
  /** A step of the optimisation. */
  private step = 0;
  private motion: Motion | null = null;
  private path: Motion | null = null;
  private isPlaying = false;
  private lastTick = 0;
  private loadedAfter = 0;
  /** Whether the reader has turned the view. */
  private isTurned = false;

  constructor() {
    this.data = new Data(element("description").textContent ?? "", element("block").textContent ?? "");
    const { description } = this.data;
    element("title").textContent = `${description.object_name} · ${description.hand_name}`;
    element("facts").replaceChildren(...description.facts.map(([label, value]) => {
      const chip = document.createElement("span");
      chip.textContent = `${label} ${value}`;
      return chip;
    }));
    this.table = new GraspTable(element<HTMLTableElement>("table"), description, (grasp) => this.select(grasp, false));
    this.plot = new LossPlot(element<HTMLCanvasElement>("losses"), (step) => this.seek("optimization", step));
    element("loss-names").replaceChildren(...description.loss_names.map((name, at) => {
      const item = document.createElement("span");
      const dot = document.createElement("i");
      dot.style.background = LOSS_COLORS[at % LOSS_COLORS.length];
      item.append(dot, `${name.label}${name.unit ? ` [${name.unit}]` : ""}`);
      return item;
    }));
    this.buildStage();
    this.wire();
    const asked = Number(new URLSearchParams(location.hash.slice(1)).get("grasp") ?? "");
    const place = location.hash ? description.grasps.findIndex((g) => g.index === asked) : -1;
    this.select(place >= 0 ? place : this.table.order[0], true);
    this.stage?.draw();
    this.loadedAfter = performance.now();
    document.documentElement.dataset.state = "ready";
  }

  /** What the page shows, for scripts that drive it. */
  state() {
    const [camera, target] = [this.stage?.camera.position, this.stage?.controls.target];
    return {
      grasp: this.grasp.index,
      rank: this.grasp.rank,
      grasps: this.data.description.grasps.length,
      mode: this.mode,
      time: this.time,
      step: this.step,
      playing: this.isPlaying,
      order: this.table.order.map((i) => this.data.description.grasps[i].index),
      contacts: this.contacts?.group.visible ?? false,
      contact_count: this.grasp.contacts.length,
      penetration: this.penetration?.isShown ?? false,
      see_through: this.objectMaterial?.transparent ?? false,
      drawn: this.stage?.drawn ?? 0,
      camera: camera?.toArray() ?? null,
      target: target?.toArray() ?? null,
      loaded_after_ms: this.loadedAfter,
    };
  }

  private get grasp(): GraspDescription {
    return this.data.description.grasps[this.selected];
  }

  private buildStage(): void {
    const { description } = this.data;
    try {
      this.stage = new Stage(element("view"));
    } catch (error) {
      fail(`This browser draws no 3-D (WebGL 2 is missing): ${error}. Table and curves work all the same.`);
      return;
    }
    const objectMaterial = new MeshStandardMaterial({ color: 0x7492a5, roughness: 0.6, metalness: 0.02, side: DoubleSide });
    const faces = this.data.unsigned(description.object.faces);
    const object = new Mesh(creased(positions(this.data, description.object), faces, 0.7), objectMaterial);
    object.castShadow = object.receiveShadow = true;
    object.renderOrder = 2;
    this.objectMaterial = objectMaterial;
    this.penetration = new Penetration(this.data, description.field);
    const skin = new MeshStandardMaterial({ color: 0xe0bb9a, roughness: 0.7, side: DoubleSide });
    this.penetration.colour(skin);
    this.hand = new HandModel(this.data, description, skin, this.penetration.overlay());
    this.contacts = new Contacts(0.0011);
    this.stage.controls.addEventListener("start", () => (this.isTurned = true));
    this.stage.add(object, this.hand.group, this.contacts.group);
  }

  /** Frames the grasp from where it is seen best. */
  private resetView(): void {
    this.isTurned = false;
    this.frame();
  }

  /** Frames the grasp, from the direction that the reader has chosen, if any. */
  private frame(): void {
    const { low, high, look } = this.grasp;
    const box = new Box3(new Vector3(...low), new Vector3(...high));
    const direction = this.isTurned && this.stage
      ? this.stage.camera.position.clone().sub(this.stage.controls.target)
      : new Vector3(...look);
    this.stage?.frame(box, direction);
  }

  select(grasp: number, scroll: boolean): void {
    this.selected = grasp;
    const { grasps } = this.data.description;
    const described = this.grasp;
    this.motion = new Motion(this.data, described.motion, described.times);
    const optimization = described.optimization;
    this.path = optimization && new Motion(this.data, optimization.motion, optimization.steps);
    if (!optimization) this.mode = "execution";
    this.step = Math.min(this.step, this.lastStep);
    const [first, last] = this.span("execution");
    this.time = Math.min(last, Math.max(first, this.time));
    this.table.select(grasp, scroll);
    const largest = this.contacts?.set(described.contacts) ?? 0;
    element("force").textContent = largest > 0 ? `${largest.toPrecision(2)} N` : "–";
    element("place").textContent = `${described.rank === null ? "grasp" : `rank ${described.rank}`} (${this.table.order.indexOf(grasp) + 1} of ${grasps.length})`;
    element("details").replaceChildren(...described.details.flatMap(([label, value]) => {
      const [term, text] = [document.createElement("dt"), document.createElement("dd")];
      term.textContent = label;
      text.textContent = value;
      return [term, text];
    }));
    this.frame();
    this.plot.set(optimization ? optimization.losses : null);
    element("curves").hidden = !optimization;
    element("no-curves").hidden = optimization !== null;
    try {
      history.replaceState(null, "", `#grasp=${described.index}`);
    } catch {
      // Some browsers do not let a local file have an address of its own.
    }
    this.update();
  }

  private get lastStep(): number {
    const steps = this.grasp.optimization?.steps;
    return steps ? steps[steps.length - 1] : 0;
  }

  private span(mode: Mode): [number, number] {
    const times = mode === "execution" ? this.grasp.times : (this.grasp.optimization?.steps ?? [0]);
    return [times[0], times[times.length - 1]];
  }

  private get position(): number {
    return this.mode === "execution" ? this.time : this.step;
  }

  private seek(mode: Mode, position: number): void {
    if (mode === "optimization" && !this.path) return;
    this.mode = mode;
    const [first, last] = this.span(mode);
    const clamped = Math.min(last, Math.max(first, position));
    if (mode === "execution") this.time = clamped;
    else this.step = Math.round(clamped);
    this.update();
  }

  private setMode(mode: Mode): void {
    if (mode === "optimization" && !this.path) {
      this.say("this run has no trajectory: graspd synth --trajectory keeps one");
      return;
    }
    this.pause();
    this.mode = mode;
    this.update();
  }

  private update(): void {
    const inOptimization = this.mode === "optimization";
    const motion = inOptimization ? this.path : this.motion;
    if (motion) this.hand?.place(motion, this.position);
    const [first, last] = this.span(this.mode);
    this.slider.min = String(first);
    this.slider.max = String(last);
    this.slider.step = inOptimization ? "1" : "0.01";
    this.slider.value = String(this.position);
    this.slider.disabled = first === last;
    const nearest = STATIONS[Math.round(this.time)];
    element("where").textContent = inOptimization
      ? `step ${this.step} of ${last}`
      : Math.abs(this.time - Math.round(this.time)) < 0.005 ? nearest : this.time < 1 ? "closing" : "squeezing";
    this.slider.setAttribute("aria-valuetext", element("where").textContent ?? "");
    document.querySelectorAll<HTMLButtonElement>("[data-station]").forEach((button) => {
      const station = Number(button.dataset.station);
      button.disabled = station < this.span("execution")[0] || station > this.span("execution")[1];
      button.setAttribute("aria-pressed", String(!inOptimization && Math.abs(this.time - station) < 0.005));
    });
    const optimization = element<HTMLButtonElement>("optimization");
    optimization.setAttribute("aria-pressed", String(inOptimization));
    optimization.disabled = !this.path;
    element("play").textContent = this.isPlaying ? "❚❚" : "▶";
    element("play").setAttribute("aria-label", this.isPlaying ? "Pause" : "Play");
    // The points are where the grasp touches: they mean nothing at other times of the optimisation.
    if (this.contacts) {
      this.contacts.group.visible = this.wants("contacts") && (!inOptimization || this.step === last);
    }
    this.penetration?.show(this.wants("penetration"));
    this.hand?.showOverlay(this.wants("penetration"));
    if (this.hand) this.hand.group.visible = this.wants("hand");
    if (this.objectMaterial) {
      const seen = this.wants("see-through");
      this.objectMaterial.transparent = seen;
      this.objectMaterial.opacity = seen ? 0.35 : 1;
      this.objectMaterial.depthWrite = !seen;
      this.objectMaterial.needsUpdate = true;
    }
    this.plot.mark(inOptimization ? this.step : this.lastStep);
    this.stage?.invalidate();
  }

  private wants(id: string): boolean {
    return element<HTMLInputElement>(id).checked;
  }

  private toggle(id: string): void {
    const box = element<HTMLInputElement>(id);
    box.checked = !box.checked;
    this.update();
  }

  private play(): void {
    const [first, last] = this.span(this.mode);
    if (first === last) return;
    if (this.position >= last) this.seek(this.mode, first);
    this.isPlaying = true;
    this.lastTick = performance.now();
    let position = this.position;
    const tick = (now: number) => {
      if (!this.isPlaying) return;
      const seconds = Math.max(0, now - this.lastTick) / 1000;
      this.lastTick = now;
      position += (seconds / DURATIONS[this.mode]) * (last - first);
      if (position >= last) this.isPlaying = false;
      this.seek(this.mode, position);
      if (this.isPlaying) requestAnimationFrame(tick);
    };
    this.update();
    requestAnimationFrame(tick);
  }

  private pause(): void {
    this.isPlaying = false;
    this.update();
  }

  private move(by: number): void {
    this.select(this.table.neighbour(this.selected, by), true);
  }

  private say(text: string): void {
    element("where").textContent = text;
  }

  private wire(): void {
    this.slider.addEventListener("input", () => {
      this.isPlaying = false;
      this.seek(this.mode, Number(this.slider.value));
    });
    for (const id of ["contacts", "penetration", "see-through", "hand"]) {
      element(id).addEventListener("change", () => this.update());
    }
    const onClick = (id: string, work: () => void) => element(id).addEventListener("click", work);
    onClick("play", () => (this.isPlaying ? this.pause() : this.play()));
    onClick("previous", () => this.move(-1));
    onClick("next", () => this.move(1));
    onClick("optimization", () => this.setMode(this.mode === "optimization" ? "execution" : "optimization"));
    onClick("reset", () => this.resetView());
    onClick("help", () => element<HTMLDialogElement>("keys").showModal());
    onClick("close-help", () => element<HTMLDialogElement>("keys").close());
    document.querySelectorAll<HTMLButtonElement>("[data-station]").forEach((button) => {
      button.addEventListener("click", () => {
        this.isPlaying = false;
        this.seek("execution", Number(button.dataset.station));
      });
    });
    document.addEventListener("keydown", (event) => this.key(event));
    const scale = element("scale");
    scale.style.background = `linear-gradient(to right, ${[0, 0.25, 0.5, 0.75, 1].map((l) => `rgb(${heat(l).join(",")})`).join(",")})`;
  }

  private key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey || element<HTMLDialogElement>("keys").open) return;
    const [first, last] = this.span(this.mode);
    const stride = (event.shiftKey ? 0.2 : 0.02) * (last - first);
    const actions: Record<string, () => void> = {
      ArrowUp: () => this.move(-1),
      ArrowDown: () => this.move(1),
      k: () => this.move(-1),
      j: () => this.move(1),
      Home: () => this.select(this.table.order[0], true),
      End: () => this.select(this.table.order[this.table.order.length - 1], true),
      ArrowLeft: () => this.seek(this.mode, this.position - stride),
      ArrowRight: () => this.seek(this.mode, this.position + stride),
      "1": () => this.seek("execution", 0),
      "2": () => this.seek("execution", 1),
      "3": () => this.seek("execution", 2),
      " ": () => (this.isPlaying ? this.pause() : this.play()),
      o: () => this.setMode(this.mode === "optimization" ? "execution" : "optimization"),
      c: () => this.toggle("contacts"),
      p: () => this.toggle("penetration"),
      x: () => this.toggle("see-through"),
      h: () => this.toggle("hand"),
      r: () => this.resetView(),
      "?": () => element<HTMLDialogElement>("keys").showModal(),
    };
    const action = actions[event.key];
    // A button that has the focus is pressed by the space bar.
    if (!action || (event.key === " " && event.target instanceof HTMLButtonElement)) return;
    event.preventDefault();
    if (event.key !== " " && event.key.length === 1 && "123".includes(event.key)) this.isPlaying = false;
    action();
  }
}

try {
  const viewer = new Viewer();
  Object.assign(window, { graspd: { state: () => viewer.state() } });
} catch (error) {
  fail(`The page cannot be shown: ${error}`);
}
