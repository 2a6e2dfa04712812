// The hand, at any time of a motion.
import {
  BufferAttribute, BufferGeometry, Group, Mesh, MeshStandardMaterial, Quaternion, type Object3D, type ShaderMaterial,
} from "three";
import type { Data, Description, Section } from "./format";
import { creased, positions } from "./geometry";

/** Frames of one hand, each a row of integers. */
export class Motion {
  readonly frames: Int16Array;
  readonly count: number;

  constructor(data: Data, section: Section, readonly times: number[]) {
    this.frames = data.signed(section);
    this.count = times.length;
  }

  /** The frames on both sides of a time, as the places where they begin, and how far the time is between them. */
  around(time: number): [number, number, number] {
    const times = this.times;
    const channels = this.frames.length / this.count;
    let next = times.findIndex((t) => t >= time);
    if (next < 0) next = times.length - 1;
    const before = Math.max(0, next - 1);
    const gap = times[next] - times[before];
    const share = gap > 0 ? Math.min(1, Math.max(0, (time - times[before]) / gap)) : 1;
    return [before * channels, next * channels, share];
  }
}

export class HandModel {
  readonly group = new Group();
  private readonly bodies: Object3D[] = [];
  private readonly skin: { geometry: BufferGeometry; positions: Float32Array } | null = null;
  private readonly overlays: Mesh[] = [];
  private readonly lengthStep: number;

  constructor(data: Data, description: Description, material: MeshStandardMaterial, overlay: ShaderMaterial) {
    this.lengthStep = description.length_step;
    const hand = description.hand;
    if (hand.kind === "rigid") {
      for (let body = 0; body < hand.bodies; ++body) {
        const group = new Group();
        this.bodies.push(group);
        this.group.add(group);
      }
      for (const part of hand.parts) {
        const faces = data.unsigned(part.mesh.faces);
        this.add(this.bodies[part.body], creased(positions(data, part.mesh), faces, 1.1), material, overlay);
      }
    } else {
      const geometry = new BufferGeometry();
      const vertices = new Float32Array(3 * hand.vertices);
      geometry.setAttribute("position", new BufferAttribute(vertices, 3));
      geometry.setIndex(new BufferAttribute(new Uint32Array(data.unsigned(hand.faces)), 1));
      this.skin = { geometry, positions: vertices };
      const group = new Group();
      this.bodies.push(group);
      this.group.add(group);
      this.add(group, geometry, material, overlay);
    }
  }

  private add(to: Object3D, geometry: BufferGeometry, material: MeshStandardMaterial, overlay: ShaderMaterial): void {
    const solid = new Mesh(geometry, material);
    solid.castShadow = true;
    solid.receiveShadow = true;
    // A skin's bounds change with every frame; there is one hand, and it is always in view.
    solid.frustumCulled = false;
    const inside = new Mesh(geometry, overlay);
    inside.frustumCulled = false;
    inside.renderOrder = 5;
    this.overlays.push(inside);
    to.add(solid, inside);
  }

  showOverlay(shown: boolean): void {
    for (const overlay of this.overlays) overlay.visible = shown;
  }

  place(motion: Motion, time: number): void {
    const [from, to, share] = motion.around(time);
    const frames = motion.frames;
    const first = new Quaternion();
    const second = new Quaternion();
    this.bodies.forEach((body, index) => {
      const a = from + 7 * index;
      const b = to + 7 * index;
      const between = (k: number) => this.lengthStep * (frames[a + k] + share * (frames[b + k] - frames[a + k]));
      body.position.set(between(0), between(1), between(2));
      // Stored real part first; three keeps it last.
      first.set(frames[a + 4], frames[a + 5], frames[a + 6], frames[a + 3]).normalize();
      second.set(frames[b + 4], frames[b + 5], frames[b + 6], frames[b + 3]).normalize();
      body.quaternion.slerpQuaternions(first, second, share);
    });
    if (this.skin) {
      const out = this.skin.positions;
      const [a, b] = [from + 7, to + 7];
      for (let i = 0; i < out.length; ++i) {
        out[i] = this.lengthStep * (frames[a + i] + share * (frames[b + i] - frames[a + i]));
      }
      this.skin.geometry.getAttribute("position").needsUpdate = true;
      this.skin.geometry.computeVertexNormals();
    }
  }
}
