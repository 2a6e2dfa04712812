// What graspd-view writes into a page (crates/graspd-view/src/page/): one JSON description, and one compressed
// block of integers that the description points into.
import { unzlibSync } from "fflate";

/** `count` integers of `width` bytes at byte `at`, each stored as its difference to the one `stride` before it, first
 * all lowest bytes, then all second ones. */
export interface Section {
  at: number;
  count: number;
  width: 1 | 2 | 4;
  stride: number;
}

export interface MeshDescription {
  vertices: Section;
  faces: Section;
  origin: [number, number, number];
  step: number;
}

export interface RigidHand {
  kind: "rigid";
  bodies: number;
  parts: { body: number; mesh: MeshDescription }[];
}

/** A frame is a base pose and all vertices in the frame of the base. */
export interface SkinnedHand {
  kind: "skinned";
  vertices: number;
  faces: Section;
}

export interface FieldDescription {
  samples: Section;
  dims: [number, number, number];
  origin: [number, number, number];
  spacing: [number, number, number];
  /** Distance of the value 255; 0 is its negative. */
  range: number;
}

export interface Column {
  label: string;
  unit: string;
  about: string;
  digits: number;
}

export interface LossCurves {
  steps: number[];
  /** One row for each name of `loss_names`; null where the loss has no logarithm. */
  values: (number | null)[][];
}

export interface GraspDescription {
  rank: number | null;
  index: number;
  metrics: (number | null)[];
  details: [string, string][];
  /** Position of each frame on the slider: 0 pre-grasp, 1 grasp, 2 squeeze. */
  times: number[];
  motion: Section;
  /** x, y, z [m] and force [N] on the object, six numbers a contact. */
  contacts: number[][];
  optimization: { steps: number[]; motion: Section; losses: LossCurves } | null;
  /** The box around object and hand. */
  low: [number, number, number];
  high: [number, number, number];
  /** From where to look at first: towards the viewer. */
  look: [number, number, number];
}

export interface Description {
  object_name: string;
  hand_name: string;
  facts: [string, string][];
  columns: Column[];
  loss_names: { label: string; unit: string }[];
  object: MeshDescription;
  hand: RigidHand | SkinnedHand;
  field: FieldDescription;
  /** Metres of one unit of a frame's lengths. */
  length_step: number;
  grasps: GraspDescription[];
}

export class Data {
  readonly description: Description;
  private readonly block: Uint8Array;

  constructor(json: string, base64: string) {
    this.description = JSON.parse(json) as Description;
    const text = atob(base64.trim());
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
    this.block = unzlibSync(bytes);
  }

  unsigned(section: Section): Uint8Array | Uint16Array | Uint32Array {
    const { at, count, width, stride } = section;
    const values =
      width === 1 ? new Uint8Array(count) : width === 2 ? new Uint16Array(count) : new Uint32Array(count);
    for (let plane = 0; plane < width; ++plane) {
      const first = at + plane * count;
      for (let i = 0; i < count; ++i) values[i] |= this.block[first + i] << (8 * plane);
    }
    // Typed arrays wrap around, as the differences did.
    for (let i = stride; i < count; ++i) values[i] += values[i - stride];
    return values;
  }

  signed(section: Section): Int16Array {
    return new Int16Array(this.unsigned(section).buffer);
  }
}
