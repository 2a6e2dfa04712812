// Meshes as the renderer wants them.
import { BufferAttribute, BufferGeometry } from "three";
import type { Data, MeshDescription } from "./format";

export function positions(data: Data, mesh: MeshDescription): Float32Array {
  const integers = data.unsigned(mesh.vertices);
  const out = new Float32Array(integers.length);
  for (let i = 0; i < out.length; ++i) out[i] = mesh.origin[i % 3] + mesh.step * integers[i];
  return out;
}

/** A geometry whose normals are smooth over edges that turn by less than `creaseAngle` and sharp over others. */
export function creased(vertices: Float32Array, faces: ArrayLike<number>, creaseAngle: number): BufferGeometry {
  const count = faces.length / 3;
  const threshold = Math.cos(creaseAngle);
  const normals = new Float32Array(3 * count);
  const areas = new Float32Array(count);
  const firsts = new Uint32Array(vertices.length / 3 + 1);
  for (let f = 0; f < count; ++f) {
    const [a, b, c] = [3 * faces[3 * f], 3 * faces[3 * f + 1], 3 * faces[3 * f + 2]];
    const ux = vertices[b] - vertices[a], uy = vertices[b + 1] - vertices[a + 1], uz = vertices[b + 2] - vertices[a + 2];
    const vx = vertices[c] - vertices[a], vy = vertices[c + 1] - vertices[a + 1], vz = vertices[c + 2] - vertices[a + 2];
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    const norm = Math.hypot(nx, ny, nz);
    areas[f] = norm;
    const scale = norm > 0 ? 1 / norm : 0;
    normals.set([nx * scale, ny * scale, nz * scale], 3 * f);
    for (let k = 0; k < 3; ++k) ++firsts[faces[3 * f + k] + 1];
  }
  for (let v = 1; v < firsts.length; ++v) firsts[v] += firsts[v - 1];
  const about = new Uint32Array(3 * count);
  const filled = firsts.slice();
  for (let f = 0; f < count; ++f) for (let k = 0; k < 3; ++k) about[filled[faces[3 * f + k]]++] = f;

  const outPositions = new Float32Array(9 * count);
  const outNormals = new Float32Array(9 * count);
  for (let f = 0; f < count; ++f) {
    for (let k = 0; k < 3; ++k) {
      const v = faces[3 * f + k];
      let x = 0, y = 0, z = 0;
      const last = Math.min(firsts[v + 1], firsts[v] + 256);
      for (let at = firsts[v]; at < last; ++at) {
        const g = about[at];
        const cosine =
          normals[3 * f] * normals[3 * g] + normals[3 * f + 1] * normals[3 * g + 1] + normals[3 * f + 2] * normals[3 * g + 2];
        if (cosine >= threshold) {
          x += areas[g] * normals[3 * g];
          y += areas[g] * normals[3 * g + 1];
          z += areas[g] * normals[3 * g + 2];
        }
      }
      const norm = Math.hypot(x, y, z);
      const to = 9 * f + 3 * k;
      for (let axis = 0; axis < 3; ++axis) {
        outPositions[to + axis] = vertices[3 * v + axis];
        outNormals[to + axis] = norm > 0 ? [x, y, z][axis] / norm : normals[3 * f + axis];
      }
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(outPositions, 3));
  geometry.setAttribute("normal", new BufferAttribute(outNormals, 3));
  return geometry;
}
