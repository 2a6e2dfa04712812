// Contact points, coloured by force.
import { BufferAttribute, BufferGeometry, Color, Group, InstancedMesh, LineBasicMaterial, LineSegments, Matrix4, MeshBasicMaterial, SphereGeometry } from "three";

/** Light yellow to dark red, as the pictures of graspd-view. */
const STOPS: [number, number, number][] = [
  [255, 245, 180], [254, 204, 92], [250, 141, 60], [220, 50, 32], [110, 0, 38],
];

export function heat(level: number): [number, number, number] {
  const scaled = Math.min(1, Math.max(0, level || 0)) * (STOPS.length - 1);
  const stop = Math.min(STOPS.length - 2, Math.floor(scaled));
  const t = scaled - stop;
  return [0, 1, 2].map((c) => Math.round(STOPS[stop][c] * (1 - t) + STOPS[stop + 1][c] * t)) as [number, number, number];
}

/** Length of the line of the largest force [m]. */
const LINE = 0.025;

export class Contacts {
  readonly group = new Group();
  private readonly sphere = new SphereGeometry(1, 12, 8);
  private readonly material = new MeshBasicMaterial({ transparent: true, depthTest: false });
  private readonly lines = new LineBasicMaterial({ vertexColors: true, transparent: true, depthTest: false, opacity: 0.8 });

  constructor(private readonly radius: number) {}

  /** Replaces what is shown; gives the largest force [N]. */
  set(contacts: number[][]): number {
    for (const child of [...this.group.children]) {
      this.group.remove(child);
      if (child instanceof InstancedMesh) child.dispose();
      else if (child instanceof LineSegments) child.geometry.dispose();
    }
    if (contacts.length === 0) return 0;
    const sizes = contacts.map((c) => Math.hypot(c[3], c[4], c[5]));
    const largest = Math.max(...sizes);
    const dots = new InstancedMesh(this.sphere, this.material, contacts.length);
    const ends = new Float32Array(6 * contacts.length);
    const colors = new Float32Array(6 * contacts.length);
    const place = new Matrix4();
    const color = new Color();
    contacts.forEach((contact, i) => {
      const [x, y, z, fx, fy, fz] = contact;
      const level = largest > 0 ? sizes[i] / largest : 0;
      const r = this.radius * (0.6 + 0.6 * Math.sqrt(level));
      place.makeScale(r, r, r).setPosition(x, y, z);
      dots.setMatrixAt(i, place);
      const [red, green, blue] = heat(level);
      color.setRGB(red / 255, green / 255, blue / 255, "srgb");
      dots.setColorAt(i, color);
      // The line comes from the side of the hand.
      const scale = largest > 0 ? LINE / largest : 0;
      ends.set([x, y, z, x - scale * fx, y - scale * fy, z - scale * fz], 6 * i);
      colors.set([color.r, color.g, color.b, color.r, color.g, color.b], 6 * i);
    });
    dots.renderOrder = 7;
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(ends, 3));
    geometry.setAttribute("color", new BufferAttribute(colors, 3));
    const lines = new LineSegments(geometry, this.lines);
    lines.renderOrder = 6;
    dots.frustumCulled = lines.frustumCulled = false;
    this.group.add(lines, dots);
    return largest;
  }
}
