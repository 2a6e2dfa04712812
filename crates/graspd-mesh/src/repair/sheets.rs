//! Cutting faces that hang together in any way into oriented 2-manifolds with boundary.

use std::collections::VecDeque;

use nalgebra::Vector3;

use super::halfedge::{NONE, ends, next, sorted_sides};
use graspd_geom::Groups;
use graspd_geom::TriangleMesh;

/// Oriented 2-manifolds with boundary: around every vertex there is one ring or one fan of faces.
#[derive(Clone, Debug)]
pub(super) struct Sheets {
    pub(super) mesh: TriangleMesh,
    /// The side of another face along the same edge, for each side; [`NONE`] on the boundary.
    pub(super) twin: Vec<u32>,
    /// Whether each face was turned over.
    pub(super) is_flipped: Vec<bool>,
    /// Vertices added where manifolds were cut apart.
    pub(super) split_vertices: usize,
}

impl Sheets {
    /// Joins faces in pairs along edges, turns them over until neighbours agree, and gives each manifold vertices of
    /// its own.
    ///
    /// Where more than two faces meet at an edge, those that agree on the outside and are the least bent
    /// go together. Where a surface is not orientable it is cut. Every connected part keeps the
    /// orientation that most of its area has.
    pub(super) fn new(mesh: &TriangleMesh) -> Self {
        let twin = pair_sides(mesh);
        let mut sheets = Self {
            mesh: mesh.clone(),
            is_flipped: vec![false; mesh.faces.len()],
            twin,
            split_vertices: 0,
        };
        sheets.orient();
        sheets.split_vertices();
        sheets.close_slits();
        // Halving a side may rename another that is in the list, hence more than one round.
        const ROUNDS: usize = 8;
        for _ in 0..ROUNDS {
            if !sheets.part_repeated_edges() {
                break;
            }
        }
        sheets
    }

    /// Boundary loops as sides in order: each ends where the next starts.
    pub(super) fn boundary_loops(&self) -> Vec<Vec<u32>> {
        let mut out_of = vec![NONE; self.mesh.vertices.len()];
        let open = |side: u32| self.twin[side as usize] == NONE;
        for side in (0..self.twin.len() as u32).filter(|&side| open(side)) {
            out_of[ends(&self.mesh.faces, side)[0] as usize] = side;
        }
        let mut loops = Vec::new();
        for first in 0..self.mesh.vertices.len() {
            let mut walk = Vec::new();
            let mut side = out_of[first];
            while side != NONE {
                let [from, to] = ends(&self.mesh.faces, side);
                out_of[from as usize] = NONE;
                walk.push(side);
                side = out_of[to as usize];
            }
            if !walk.is_empty() {
                loops.push(walk);
            }
        }
        loops
    }

    /// Leaves out whole connected parts.
    pub(super) fn drop_faces(&mut self, is_dropped: &[bool]) {
        let mut kept = 0;
        let number: Vec<u32> = is_dropped
            .iter()
            .map(|&is_dropped| {
                kept += u32::from(!is_dropped);
                kept.wrapping_sub(1)
            })
            .collect();
        let keep = |face: usize| !is_dropped[face];
        let faces = std::mem::take(&mut self.mesh.faces);
        let twin = std::mem::take(&mut self.twin);
        for face in (0..faces.len()).filter(|&face| keep(face)) {
            self.mesh.faces.push(faces[face]);
            self.is_flipped[number[face] as usize] = self.is_flipped[face];
            self.twin
                .extend(twin[3 * face..3 * face + 3].iter().map(|&side| match side {
                    NONE => NONE,
                    side => 3 * number[side as usize / 3] + side % 3,
                }));
        }
        self.is_flipped.truncate(self.mesh.faces.len());
    }

    fn orient(&mut self) {
        let faces = &mut self.mesh.faces;
        let mut is_seen = vec![false; faces.len()];
        let mut queue = VecDeque::new();
        let mut members = Vec::new();
        for first in 0..faces.len() {
            if is_seen[first] {
                continue;
            }
            is_seen[first] = true;
            queue.push_back(first as u32);
            members.clear();
            while let Some(face) = queue.pop_front() {
                members.push(face);
                for side in 3 * face..3 * face + 3 {
                    let twin = self.twin[side as usize];
                    if twin == NONE {
                        continue;
                    }
                    let other = twin as usize / 3;
                    let disagree = (ends(faces, side)[0] == ends(faces, twin)[0])
                        != (self.is_flipped[face as usize] != self.is_flipped[other]);
                    if !is_seen[other] {
                        is_seen[other] = true;
                        self.is_flipped[other] = disagree;
                        queue.push_back(other as u32);
                    } else if disagree {
                        self.twin[side as usize] = NONE;
                        self.twin[twin as usize] = NONE;
                    }
                }
            }
            let area = |face: u32| {
                let [a, b, c] =
                    faces[face as usize].map(|vertex| self.mesh.vertices[vertex as usize]);
                (b - a).cross(&(c - a)).norm()
            };
            let balance: f64 = members
                .iter()
                .map(|&face| {
                    if self.is_flipped[face as usize] {
                        -area(face)
                    } else {
                        area(face)
                    }
                })
                .sum();
            if balance < 0.0 {
                for &face in &members {
                    self.is_flipped[face as usize] ^= true;
                }
            }
        }
        // Side e of [a, b, c] is side 2 - e of [a, c, b].
        let renumbered = |side: u32| {
            let face = side / 3;
            if side != NONE && self.is_flipped[face as usize] {
                3 * face + 2 - side % 3
            } else {
                side
            }
        };
        let mut twin = vec![NONE; self.twin.len()];
        for (side, &other) in (0u32..).zip(&self.twin) {
            twin[renumbered(side) as usize] = renumbered(other);
        }
        self.twin = twin;
        for (face, &is_flipped) in faces.iter_mut().zip(&self.is_flipped) {
            if is_flipped {
                face.swap(1, 2);
            }
        }
    }

    /// Gives every ring or fan of faces around a vertex a vertex of its own; the first keeps the old one.
    fn split_vertices(&mut self) {
        // Corner e of face f is number 3 f + e: where side 3 f + e starts.
        let mut corners = Groups::new(self.twin.len());
        for (side, &twin) in (0u32..).zip(&self.twin) {
            if twin != NONE && side < twin {
                corners.join(side, next(twin));
                corners.join(next(side), twin);
            }
        }
        let mut owner = vec![NONE; self.mesh.vertices.len()];
        let mut vertex_of = vec![NONE; self.twin.len()];
        for corner in 0..self.twin.len() as u32 {
            let root = corners.root(corner);
            let vertex = &mut self.mesh.faces[corner as usize / 3][corner as usize % 3];
            if corner == root {
                let old = *vertex as usize;
                vertex_of[root as usize] = if owner[old] == NONE {
                    owner[old] = root;
                    *vertex
                } else {
                    self.mesh.vertices.push(self.mesh.vertices[old]);
                    self.split_vertices += 1;
                    self.mesh.vertices.len() as u32 - 1
                };
            }
            *vertex = vertex_of[root as usize];
        }
    }

    /// Joins the two sides of boundary loops of length two.
    fn close_slits(&mut self) {
        for walk in self.boundary_loops() {
            if let [a, b] = walk[..] {
                self.twin[a as usize] = b;
                self.twin[b as usize] = a;
            }
        }
    }

    /// Puts a vertex in the middle of every edge whose two ends are those of another edge, too; gives whether there
    /// was one.
    fn part_repeated_edges(&mut self) -> bool {
        let sides = sorted_sides(&self.mesh.faces);
        let mut repeated = Vec::new();
        for uses in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            if uses.len() > 1 && !(uses.len() == 2 && self.twin[uses[0].2 as usize] == uses[1].2) {
                // One of each pair of twins; the first edge of all may stay.
                let edges = uses.iter().map(|one| one.2).filter(|&side| {
                    self.twin[side as usize] == NONE || side < self.twin[side as usize]
                });
                repeated.extend(edges.skip(1));
            }
        }
        for &side in &repeated {
            let [from, to] = ends(&self.mesh.faces, side);
            let [a, b] = [from, to].map(|vertex| self.mesh.vertices[vertex as usize]);
            let middle = self.mesh.vertices.len() as u32;
            self.mesh.vertices.push(nalgebra::center(&a, &b));
            let twin = self.twin[side as usize];
            let rest = self.halve(side, middle);
            if twin != NONE {
                let twin_rest = self.halve(twin, middle);
                self.link(side, twin_rest);
                self.link(twin, rest);
            }
        }
        !repeated.is_empty()
    }

    /// Cuts the face of a side a -> b in two at a vertex m on it: the side becomes a -> m, and the new side m -> b
    /// is returned.
    fn halve(&mut self, side: u32, middle: u32) -> u32 {
        let [_, b] = ends(&self.mesh.faces, side);
        let (after, opposite) = (next(side), next(next(side)));
        let apex = ends(&self.mesh.faces, opposite)[0];
        let new = 3 * self.mesh.faces.len() as u32;
        self.mesh.faces.push([middle, b, apex]);
        self.is_flipped.push(self.is_flipped[side as usize / 3]);
        self.twin.extend([NONE; 3]);
        let outer = self.twin[after as usize];
        self.link(new + 1, outer);
        self.link(new + 2, after);
        self.mesh.faces[side as usize / 3][after as usize % 3] = middle;
        new
    }

    fn link(&mut self, a: u32, b: u32) {
        for (one, other) in [(a, b), (b, a)] {
            if one != NONE {
                self.twin[one as usize] = other;
            }
        }
    }
}

/// The partner of each side of a face along its edge, or [`NONE`].
fn pair_sides(mesh: &TriangleMesh) -> Vec<u32> {
    let mut twin = vec![NONE; 3 * mesh.faces.len()];
    let mut link = |a: u32, b: u32| {
        twin[a as usize] = b;
        twin[b as usize] = a;
    };
    for uses in sorted_sides(&mesh.faces).chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        match uses {
            [_] => {}
            [a, b] => link(a.2, b.2),
            _ => {
                for [a, b] in pairs_at_edge(mesh, uses) {
                    link(a, b);
                }
            }
        }
    }
    twin
}

/// Which of the faces at an edge go together: greedily, those that agree on the outside before those that do not.
///
/// Of an even number of faces, those between which the solid is thinnest: solids that touch along an edge come apart.
/// Of an odd number, the least bent, so that a fin is left over.
fn pairs_at_edge(mesh: &TriangleMesh, uses: &[(u32, u32, u32)]) -> Vec<[u32; 2]> {
    /// More faces than this at one edge are not worth an order.
    const MOST: usize = 64;
    let uses = &uses[..uses.len().min(MOST)];
    let is_even = uses.len().is_multiple_of(2);
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    let (low, high, _) = uses[0];
    let along = (at(high) - at(low))
        .try_normalize(0.0)
        .unwrap_or_else(Vector3::zeros);
    // Directions from the edge into each face.
    let into: Vec<Vector3<f64>> = uses
        .iter()
        .map(|one| {
            let away = at(ends(&mesh.faces, next(one.2))[1]) - at(low);
            (away - along * along.dot(&away))
                .try_normalize(0.0)
                .unwrap_or_else(Vector3::zeros)
        })
        .collect();
    let is_upward = |i: usize| ends(&mesh.faces, uses[i].2)[0] == low;
    let mut candidates = Vec::new();
    for i in 0..uses.len() {
        for j in 0..i {
            let bend = into[i].dot(&into[j]);
            let cost = if is_even {
                let inward = if is_upward(i) {
                    into[i].cross(&along)
                } else {
                    along.cross(&into[i])
                };
                let angle = into[j].dot(&inward).atan2(bend);
                angle.rem_euclid(std::f64::consts::TAU)
            } else {
                bend
            };
            candidates.push((is_upward(i) == is_upward(j), cost, j, i));
        }
    }
    candidates.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut is_taken = vec![false; uses.len()];
    let mut pairs = Vec::new();
    for (_, _, j, i) in candidates {
        if !is_taken[i] && !is_taken[j] {
            is_taken[i] = true;
            is_taken[j] = true;
            pairs.push([uses[j].2, uses[i].2]);
        }
    }
    pairs
}
