//! Removing faces without area from a closed surface, which dropping them would open.

use std::collections::HashMap;

use nalgebra::Point3;

use graspd_geom::TriangleMesh;

/// A face is degenerate if its height is at most this part of its longest side.
const FLAT: f64 = 1e-9;
/// Of a degenerate face, a side shorter than this part of the longest is shrunk to a point.
const SHORT: f64 = 1e-6;
/// What cannot be shrunk nor flipped has a corner moved by this part of the longest side at that corner.
const NUDGES: [f64; 3] = [1e-6, 1e-5, 1e-4];
/// Removing one face may flatten its neighbour; after so many rounds the rest is left.
const ROUNDS: usize = 16;

/// Whether a triangle is flat to within rounding.
pub(super) fn is_degenerate([a, b, c]: &[Point3<f64>; 3]) -> bool {
    let longest = (b - a)
        .norm_squared()
        .max((c - b).norm_squared())
        .max((a - c).norm_squared());
    let twice_area = (b - a).cross(&(c - a)).norm();
    // Also if not a number.
    twice_area.is_nan() || twice_area <= FLAT * longest
}

/// How many faces are degenerate.
pub(super) fn degenerate_faces(mesh: &TriangleMesh) -> usize {
    (0..mesh.faces.len())
        .filter(|&face| is_degenerate(&mesh.corners(face)))
        .count()
}

/// Shrinks the short sides of degenerate faces and flips their long ones, where that leaves the surface a manifold,
/// and moves a corner of the others by next to nothing; gives how many faces were changed.
pub(super) fn remove_degenerate(mesh: &mut TriangleMesh) -> usize {
    let mut changed = 0;
    for _ in 0..ROUNDS {
        let flat: Vec<u32> = (0..mesh.faces.len() as u32)
            .filter(|&face| is_degenerate(&mesh.corners(face as usize)))
            .collect();
        if flat.is_empty() {
            break;
        }
        let mut work = Work::new(mesh);
        let before = changed;
        for face in flat {
            changed += usize::from(work.remove(face));
        }
        let is_gone = work.is_gone;
        let mut index = 0;
        mesh.faces.retain(|_| {
            index += 1;
            !is_gone[index - 1]
        });
        if changed == before {
            break;
        }
    }
    changed + nudge_degenerate(mesh)
}

/// Moves corners of degenerate faces, each so little that no one can tell, to where fewer faces are degenerate; gives
/// how many faces that helps.
///
/// Where a surface touches itself, two vertices at the same place may share neighbours, so that neither shrinking nor
/// flipping is possible.
fn nudge_degenerate(mesh: &mut TriangleMesh) -> usize {
    let mut flat: Vec<usize> = (0..mesh.faces.len())
        .filter(|&face| is_degenerate(&mesh.corners(face)))
        .collect();
    if flat.is_empty() {
        return 0;
    }
    let before = flat.len();
    let mut faces_at: HashMap<u32, Vec<usize>> = HashMap::new();
    for &vertex in flat.iter().flat_map(|&face| &mesh.faces[face]) {
        faces_at.entry(vertex).or_default();
    }
    for (index, face) in mesh.faces.iter().enumerate() {
        for vertex in face {
            if let Some(faces) = faces_at.get_mut(vertex) {
                faces.push(index);
            }
        }
    }
    for &face in &flat {
        for vertex in mesh.faces[face] {
            if !is_degenerate(&mesh.corners(face)) {
                break;
            }
            nudge(mesh, vertex, &faces_at[&vertex]);
        }
    }
    flat.retain(|&face| is_degenerate(&mesh.corners(face)));
    before - flat.len()
}

/// Moves a vertex if fewer of the faces around it are degenerate then.
fn nudge(mesh: &mut TriangleMesh, vertex: u32, around: &[usize]) {
    let old = mesh.vertices[vertex as usize];
    let count = |mesh: &TriangleMesh| {
        (around.iter())
            .filter(|&&face| is_degenerate(&mesh.corners(face)))
            .count()
    };
    let flat = count(mesh);
    let longest = (around.iter())
        .flat_map(|&face| mesh.corners(face))
        .map(|corner| (corner - old).norm())
        .fold(0.0, f64::max);
    for part in NUDGES {
        for direction in 0..6 {
            let mut moved = old;
            let step = if direction < 3 { part } else { -part };
            moved[direction % 3] += step * longest;
            mesh.vertices[vertex as usize] = moved;
            if count(mesh) < flat {
                return;
            }
        }
    }
    mesh.vertices[vertex as usize] = old;
}

struct Work<'a> {
    mesh: &'a mut TriangleMesh,
    /// The face on the left of each directed edge.
    face_at: HashMap<(u32, u32), u32>,
    is_gone: Vec<bool>,
}

impl<'a> Work<'a> {
    fn new(mesh: &'a mut TriangleMesh) -> Self {
        let mut face_at = HashMap::with_capacity(3 * mesh.faces.len());
        for (index, &[a, b, c]) in (0u32..).zip(&mesh.faces) {
            for side in [(a, b), (b, c), (c, a)] {
                face_at.insert(side, index);
            }
        }
        Self {
            is_gone: vec![false; mesh.faces.len()],
            mesh,
            face_at,
        }
    }

    fn at(&self, vertex: u32) -> Point3<f64> {
        self.mesh.vertices[vertex as usize]
    }

    fn remove(&mut self, face: u32) -> bool {
        if self.is_gone[face as usize] || !is_degenerate(&self.mesh.corners(face as usize)) {
            return false;
        }
        let [a, b, c] = self.mesh.faces[face as usize];
        let mut sides = [[a, b, c], [b, c, a], [c, a, b]]
            .map(|[from, to, apex]| ((self.at(to) - self.at(from)).norm(), from, to, apex));
        sides.sort_by(|x, y| x.0.total_cmp(&y.0));
        let [short, _, long] = sides;
        if short.0 <= SHORT * long.0 {
            self.shrink(short.1, short.2)
        } else {
            self.flip(face, long.1, long.2, long.3)
        }
    }

    fn apex(&self, from: u32, to: u32) -> Option<(u32, u32)> {
        let &face = self.face_at.get(&(from, to))?;
        let corners = self.mesh.faces[face as usize];
        let apex = corners.into_iter().find(|&v| v != from && v != to)?;
        Some((face, apex))
    }

    /// Replaces the face's long side a -> b by the edge between its apex and that of the neighbour.
    fn flip(&mut self, face: u32, a: u32, b: u32, c: u32) -> bool {
        let Some((other, d)) = self.apex(b, a) else {
            return false;
        };
        if c == d || self.face_at.contains_key(&(c, d)) || self.face_at.contains_key(&(d, c)) {
            return false;
        }
        self.face_at.remove(&(a, b));
        self.face_at.remove(&(b, a));
        self.put(face, [c, a, d]);
        self.put(other, [d, b, c]);
        true
    }

    fn put(&mut self, index: u32, face: [u32; 3]) {
        self.mesh.faces[index as usize] = face;
        for i in 0..3 {
            self.face_at.insert((face[i], face[(i + 1) % 3]), index);
        }
    }

    /// The vertices around a vertex, starting with `first`.
    fn ring(&self, vertex: u32, first: u32) -> Option<Vec<(u32, u32)>> {
        let mut ring = Vec::new();
        let mut at = first;
        loop {
            let (face, apex) = self.apex(vertex, at)?;
            ring.push((face, at));
            at = apex;
            if at == first {
                return Some(ring);
            }
            if ring.len() > self.mesh.faces.len() {
                return None;
            }
        }
    }

    /// Moves vertex b into its neighbour a, if the two have no neighbours in common beyond the two faces between
    /// them (the link condition).
    fn shrink(&mut self, a: u32, b: u32) -> bool {
        let (Some(around_a), Some(around_b)) = (self.ring(a, b), self.ring(b, a)) else {
            return false;
        };
        let common = around_a
            .iter()
            .filter(|(_, v)| around_b.iter().any(|(_, w)| v == w))
            .count();
        // Two that both have three neighbours are corners of a tetrahedron, which would fold flat.
        if common != 2 || around_a.len() + around_b.len() < 7 {
            return false;
        }
        for &(face, _) in &around_b {
            let corners = self.mesh.faces[face as usize];
            for i in 0..3 {
                self.face_at.remove(&(corners[i], corners[(i + 1) % 3]));
            }
        }
        for (face, _) in around_b {
            let corners = self.mesh.faces[face as usize];
            if corners.contains(&a) {
                self.is_gone[face as usize] = true;
            } else {
                self.put(face, corners.map(|v| if v == b { a } else { v }));
            }
        }
        true
    }
}
