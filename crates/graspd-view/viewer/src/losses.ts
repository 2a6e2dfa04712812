// The losses along an optimisation, on a logarithmic scale.
import type { LossCurves } from "./format";

export const LOSS_COLORS = ["#2f6f9f", "#c2571a", "#7a5ea8", "#3f8f4f", "#b0803a"];
/** Losses below this share of the largest are drawn at the bottom. */
const DECADES = 12;

export class LossPlot {
  private curves: LossCurves | null = null;
  private step = 0;

  constructor(private readonly canvas: HTMLCanvasElement, seek: (step: number) => void) {
    const point = (event: PointerEvent) => {
      if (!this.curves) return;
      const box = canvas.getBoundingClientRect();
      const { left, right } = this.margins();
      const share = (event.clientX - box.left - left) / (box.width - left - right);
      const last = this.curves.steps[this.curves.steps.length - 1];
      seek(Math.min(1, Math.max(0, share)) * last);
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      point(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) point(event);
    });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  set(curves: LossCurves | null): void {
    this.curves = curves;
    this.draw();
  }

  mark(step: number): void {
    this.step = step;
    this.draw();
  }

  private margins() {
    return { left: 44, right: 10, top: 8, bottom: 22 };
  }

  draw(): void {
    const ratio = window.devicePixelRatio || 1;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    const paint = this.canvas.getContext("2d");
    if (!paint || !this.curves) return;
    paint.scale(ratio, ratio);
    const style = getComputedStyle(this.canvas);
    const ink = style.color;
    const { left, right, top, bottom } = this.margins();
    const { steps, values } = this.curves;
    const found = values.flat().filter((v): v is number => v !== null && v > 0).map(Math.log10);
    if (found.length === 0) return;
    const high = Math.ceil(found.reduce((a, b) => Math.max(a, b)));
    const low = Math.max(high - DECADES, Math.floor(found.reduce((a, b) => Math.min(a, b))));
    const span = Math.max(1, high - low);
    const lastStep = Math.max(1, steps[steps.length - 1]);
    const x = (step: number) => left + (width - left - right) * (step / lastStep);
    const y = (log: number) => top + (height - top - bottom) * ((high - Math.max(low, log)) / span);
    paint.font = "11px system-ui, sans-serif";
    paint.fillStyle = ink;
    paint.strokeStyle = ink;
    paint.lineWidth = 1;
    const stride = Math.ceil(span / 5);
    for (let log = low; log <= high; log += stride) {
      paint.globalAlpha = 0.15;
      paint.beginPath();
      paint.moveTo(left, y(log));
      paint.lineTo(width - right, y(log));
      paint.stroke();
      paint.globalAlpha = 0.8;
      paint.textAlign = "right";
      paint.fillText(`1e${log}`, left - 5, y(log) + 4);
    }
    paint.textAlign = "left";
    paint.fillText("0", left, height - 6);
    paint.textAlign = "right";
    paint.fillText(`step ${steps[steps.length - 1]}`, width - right, height - 6);
    paint.globalAlpha = 1;
    paint.lineWidth = 1.5;
    values.forEach((row, at) => {
      paint.strokeStyle = LOSS_COLORS[at % LOSS_COLORS.length];
      paint.beginPath();
      let isDown = false;
      row.forEach((value, i) => {
        if (value === null || !(value > 0)) {
          isDown = false;
          return;
        }
        const [px, py] = [x(steps[i]), y(Math.log10(value))];
        if (isDown) paint.lineTo(px, py);
        else paint.moveTo(px, py);
        isDown = true;
      });
      paint.stroke();
    });
    paint.strokeStyle = ink;
    paint.globalAlpha = 0.7;
    paint.beginPath();
    paint.moveTo(x(Math.min(this.step, lastStep)), top);
    paint.lineTo(x(Math.min(this.step, lastStep)), height - bottom);
    paint.stroke();
    paint.globalAlpha = 1;
  }
}
