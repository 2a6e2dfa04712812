//! A smooth patch over a hole: triangulated, refined to the density around it, and faired.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};

use super::triangulate::{EdgeSet, edge, triangulate};

/// Triangles are split while their centre is farther from their corners than the edges around are long, over this.
const DENSITY: f64 = std::f64::consts::SQRT_2;
/// No patch gets more vertices than this: memory stays bounded on holes that are large and finely edged.
const MAX_VERTICES: usize = 100_000;
/// Rounds of refinement; each about halves the edges.
const REFINEMENTS: usize = 24;
/// Sweeps of edge flips after each refinement.
const FLIPS: usize = 8;
/// Sweeps of fairing, and the factor by which each overshoots (successive over-relaxation).
const FAIRING: usize = 300;
const OVERSHOOT: f64 = 1.7;
/// The fairing ends when no vertex moves by more than this part of the ring's length.
const STILL: f64 = 1e-7;

/// What fills a hole.
pub(super) struct Patch {
    /// New vertices, numbered after those that were there.
    pub(super) vertices: Vec<Point3<f64>>,
    pub(super) faces: Vec<[u32; 3]>,
}

/// Fills the ring, whose vertices come in the order in which the patch runs around it.
///
/// `spacing`: for every vertex of the ring, how long the edges of the surface around it are. `taken`: edges that the
/// patch must not repeat; those of the ring may be among them.
pub(super) fn fill(
    ring: &[u32],
    vertices: &[Point3<f64>],
    spacing: &HashMap<u32, f64>,
    taken: &EdgeSet,
) -> Patch {
    let mut work = Work {
        old: vertices,
        taken,
        patch: Patch {
            vertices: Vec::new(),
            faces: Vec::new(),
        },
        spacing: spacing.clone(),
    };
    match triangulate(ring, vertices, taken) {
        Some(faces) => work.patch.faces = faces,
        None => work.fan(ring),
    }
    work.refine();
    work.fair(ring);
    work.patch
}

struct Work<'a> {
    old: &'a [Point3<f64>],
    taken: &'a EdgeSet,
    patch: Patch,
    spacing: HashMap<u32, f64>,
}

impl Work<'_> {
    fn at(&self, vertex: u32) -> Point3<f64> {
        let vertex = vertex as usize;
        if vertex < self.old.len() {
            self.old[vertex]
        } else {
            self.patch.vertices[vertex - self.old.len()]
        }
    }

    fn add(&mut self, p: Point3<f64>, spacing: f64) -> u32 {
        let vertex = (self.old.len() + self.patch.vertices.len()) as u32;
        self.patch.vertices.push(p);
        self.spacing.insert(vertex, spacing);
        vertex
    }

    /// Triangles from the ring to its middle, for rings whose chords are all taken.
    fn fan(&mut self, ring: &[u32]) {
        let count = ring.len() as f64;
        let sum = ring
            .iter()
            .map(|&v| self.old[v as usize].coords)
            .sum::<Vector3<f64>>();
        let spacing = ring.iter().map(|v| self.spacing[v]).sum::<f64>() / count;
        let middle = self.add((sum / count).into(), spacing);
        for (i, &from) in ring.iter().enumerate() {
            let to = ring[(i + 1) % ring.len()];
            self.patch.faces.push([from, to, middle]);
        }
    }

    /// Splits triangles that are large for where they are, and flips edges towards a Delaunay triangulation.
    fn refine(&mut self) {
        self.flip_edges();
        for _ in 0..REFINEMENTS {
            let mut was_split = false;
            for index in 0..self.patch.faces.len() {
                if self.patch.vertices.len() >= MAX_VERTICES {
                    break;
                }
                let face = self.patch.faces[index];
                let [a, b, c] = face.map(|v| self.at(v));
                let center = Point3::from((a.coords + b.coords + c.coords) / 3.0);
                let spacing = face.map(|v| self.spacing[&v]);
                let here = spacing.iter().sum::<f64>() / 3.0;
                let is_large = [a, b, c]
                    .iter()
                    .zip(spacing)
                    .all(|(corner, there)| DENSITY * (center - corner).norm() > here.max(there));
                if is_large {
                    was_split = true;
                    let middle = self.add(center, here);
                    let [a, b, c] = face;
                    self.patch.faces[index] = [a, b, middle];
                    self.patch.faces.push([b, c, middle]);
                    self.patch.faces.push([c, a, middle]);
                }
            }
            if !was_split {
                break;
            }
            self.flip_edges();
        }
    }

    fn flip_edges(&mut self) {
        let mut face_at: HashMap<(u32, u32), u32> = HashMap::new();
        for (index, &[a, b, c]) in (0u32..).zip(&self.patch.faces) {
            for side in [(a, b), (b, c), (c, a)] {
                face_at.insert(side, index);
            }
        }
        for _ in 0..FLIPS {
            let mut was_flipped = false;
            for index in 0..self.patch.faces.len() as u32 {
                for corner in 0..3 {
                    was_flipped |= self.flip(&mut face_at, index, corner);
                }
            }
            if !was_flipped {
                break;
            }
        }
    }

    /// Turns the edge from a corner of a face to the next into the other diagonal, if that is allowed and better.
    fn flip(&mut self, face_at: &mut HashMap<(u32, u32), u32>, index: u32, corner: usize) -> bool {
        let face = self.patch.faces[index as usize];
        let (a, b, c) = (face[corner], face[(corner + 1) % 3], face[(corner + 2) % 3]);
        let Some(&other) = face_at.get(&(b, a)) else {
            return false;
        };
        let Some(&d) = self.patch.faces[other as usize]
            .iter()
            .find(|&&v| v != a && v != b)
        else {
            return false;
        };
        let is_there = c == d
            || face_at.contains_key(&(c, d))
            || face_at.contains_key(&(d, c))
            || self.taken.contains(&edge(c, d));
        if is_there || !self.is_better([a, b, c, d]) {
            return false;
        }
        for side in [(a, b), (b, a)] {
            face_at.remove(&side);
        }
        for (at, face) in [(index, [c, a, d]), (other, [d, b, c])] {
            self.patch.faces[at as usize] = face;
            for i in 0..3 {
                face_at.insert((face[i], face[(i + 1) % 3]), at);
            }
        }
        true
    }

    /// Whether the faces a d c and b c d beat a b c and b a d: the angles opposite the edge a b sum to more than
    /// half a turn, and the new faces look the same way as the old.
    fn is_better(&self, corners: [u32; 4]) -> bool {
        const MARGIN: f64 = 1e-9;
        let [a, b, c, d] = corners.map(|v| self.at(v));
        let cosine = |u: Vector3<f64>, v: Vector3<f64>| u.dot(&v) / (u.norm() * v.norm());
        let at_c = cosine(a - c, b - c).clamp(-1.0, 1.0).acos();
        let at_d = cosine(a - d, b - d).clamp(-1.0, 1.0).acos();
        let normal = (b - a).cross(&(c - a)) + (a - b).cross(&(d - b));
        let [first, second] = [(a - c).cross(&(d - c)), (b - d).cross(&(c - d))];
        // Not a number where an edge has no length: then nothing is flipped.
        at_c + at_d > std::f64::consts::PI + MARGIN
            && normal.dot(&first) > 0.0
            && normal.dot(&second) > 0.0
    }

    /// Moves the new vertices until each is the mean of its neighbours: the patch becomes a membrane in the ring.
    fn fair(&mut self, ring: &[u32]) {
        if self.patch.vertices.is_empty() {
            return;
        }
        let first = self.old.len() as u32;
        let mut neighbours = vec![Vec::new(); self.patch.vertices.len()];
        for face in &self.patch.faces {
            for corner in 0..3 {
                // Around a vertex inside the patch, every neighbour comes next once.
                if face[corner] >= first {
                    neighbours[(face[corner] - first) as usize].push(face[(corner + 1) % 3]);
                }
            }
        }
        let length: f64 = (0..ring.len())
            .map(|i| (self.at(ring[i]) - self.at(ring[(i + 1) % ring.len()])).norm())
            .sum();
        for _ in 0..FAIRING {
            let mut farthest: f64 = 0.0;
            for (vertex, around) in neighbours.iter().enumerate() {
                let sum: Vector3<f64> = around.iter().map(|&v| self.at(v).coords).sum();
                let step = sum / around.len() as f64 - self.patch.vertices[vertex].coords;
                self.patch.vertices[vertex] += step * OVERSHOOT;
                farthest = farthest.max(step.norm());
            }
            if farthest <= STILL * length {
                break;
            }
        }
    }
}
