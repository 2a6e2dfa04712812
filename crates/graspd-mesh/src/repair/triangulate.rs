//! Triangulating a closed loop in space without new vertices.

use std::collections::HashSet;

use nalgebra::Point3;

/// Loops of at most this many vertices are triangulated optimally, which takes time with the cube of their number;
/// longer ones are first cut in two along short chords.
const LONGEST_OPTIMAL: usize = 160;
/// Weight of a triangle's squared perimeter beside its area: of equally large patches, the one with the roundest
/// triangles is wanted.
const ROUNDNESS: f64 = 1e-3;

/// Edges that a patch must not repeat, as (lower, higher) vertex.
pub(super) type EdgeSet = HashSet<(u32, u32)>;

/// An edge as an [`EdgeSet`] has it.
pub(super) fn edge(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// The triangles of least total area (and, of equals, the roundest) that span a loop of different vertices; they run
/// around it in its own direction. `None` if every way needs a chord among the `forbidden`.
///
/// # Source
/// Barequet and Sharir, "Filling gaps in the boundary of a polyhedron", Computer Aided Geometric Design 12 (1995);
/// Liepa, "Filling Holes in Meshes", Symposium on Geometry Processing 2003.
pub(super) fn triangulate(
    ring: &[u32],
    vertices: &[Point3<f64>],
    forbidden: &EdgeSet,
) -> Option<Vec<[u32; 3]>> {
    let mut faces = Vec::with_capacity(ring.len().saturating_sub(2));
    let mut waiting = vec![ring.to_vec()];
    while let Some(ring) = waiting.pop() {
        if ring.len() <= LONGEST_OPTIMAL {
            optimal(&ring, vertices, forbidden, &mut faces)?;
        } else {
            let [i, j] = short_chord(&ring, vertices, forbidden)?;
            let mut other = ring[j..].to_vec();
            other.extend(&ring[..=i]);
            waiting.push(ring[i..=j].to_vec());
            waiting.push(other);
        }
    }
    Some(faces)
}

/// The shortest allowed chord between vertices that are at least a quarter of the ring apart.
fn short_chord(ring: &[u32], vertices: &[Point3<f64>], forbidden: &EdgeSet) -> Option<[usize; 2]> {
    /// On long rings only every k-th vertex is looked at.
    const MAX_COMPARED: usize = 1000;
    let n = ring.len();
    let stride = n.div_ceil(MAX_COMPARED);
    let at = |i: usize| vertices[ring[i] as usize];
    let mut best = None;
    let mut shortest = f64::INFINITY;
    for i in (0..n).step_by(stride) {
        for j in (i + n / 4..(i + n - n / 4).min(n)).step_by(stride) {
            let length = (at(i) - at(j)).norm_squared();
            if length < shortest && !forbidden.contains(&edge(ring[i], ring[j])) {
                shortest = length;
                best = Some([i, j]);
            }
        }
    }
    best
}

/// By dynamic programming over all stretches of the ring.
fn optimal(
    ring: &[u32],
    vertices: &[Point3<f64>],
    forbidden: &EdgeSet,
    faces: &mut Vec<[u32; 3]>,
) -> Option<()> {
    let n = ring.len();
    let at = |i: usize| vertices[ring[i] as usize];
    let weight = |i: usize, k: usize, j: usize| {
        let [a, b, c] = [at(i), at(k), at(j)];
        let [u, v, w] = [b - a, c - b, a - c];
        let perimeter = u.norm() + v.norm() + w.norm();
        0.5 * u.cross(&v).norm() + ROUNDNESS * perimeter * perimeter
    };
    // Of the stretch from i to j: the least weight, and the corner that makes a triangle with its ends.
    let mut least = vec![0.0; n * n];
    let mut corner = vec![0; n * n];
    for span in 2..n {
        for i in 0..n - span {
            let j = i + span;
            let mut best = (f64::INFINITY, i + 1);
            // The ring's own closing edge is no chord.
            if span == n - 1 || !forbidden.contains(&edge(ring[i], ring[j])) {
                for k in i + 1..j {
                    let sides = least[i * n + k] + least[k * n + j];
                    if sides < best.0 {
                        let total = sides + weight(i, k, j);
                        if total < best.0 {
                            best = (total, k);
                        }
                    }
                }
            }
            (least[i * n + j], corner[i * n + j]) = best;
        }
    }
    if n < 3 || !least[n - 1].is_finite() {
        return None;
    }
    let mut waiting = vec![(0, n - 1)];
    while let Some((i, j)) = waiting.pop() {
        if j - i >= 2 {
            let k = corner[i * n + j];
            faces.push([ring[i], ring[k], ring[j]]);
            waiting.push((i, k));
            waiting.push((k, j));
        }
    }
    Some(())
}
