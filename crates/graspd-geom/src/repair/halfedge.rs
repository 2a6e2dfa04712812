//! Sides of faces: three to a face, number 3 f + e running from its corner e to the next.

use std::collections::HashMap;

use crate::TriangleMesh;

/// No other side.
pub(super) const NONE: u32 = u32::MAX;

/// The next side of the same face.
pub(super) fn next(side: u32) -> u32 {
    if side % 3 == 2 { side - 2 } else { side + 1 }
}

/// The vertices that a side runs from and to.
pub(super) fn ends(faces: &[[u32; 3]], side: u32) -> [u32; 2] {
    let face = faces[side as usize / 3];
    let corner = side as usize % 3;
    [face[corner], face[(corner + 1) % 3]]
}

/// The sides of all faces as (lower vertex, higher vertex, side), sorted.
pub(super) fn sorted_sides(faces: &[[u32; 3]]) -> Vec<(u32, u32, u32)> {
    let mut sides: Vec<_> = (0..3 * faces.len() as u32)
        .map(|side| {
            let [from, to] = ends(faces, side);
            (from.min(to), from.max(to), side)
        })
        .collect();
    sides.sort_unstable();
    sides
}

/// Whether every edge has exactly two faces, which run along it in opposite directions, and every face three
/// different vertices.
pub(super) fn is_edge_manifold(mesh: &TriangleMesh) -> bool {
    let is_face = |&[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    mesh.faces.iter().all(is_face)
        && sorted_sides(&mesh.faces)
            .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
            .all(|uses| {
                uses.len() == 2
                    && ends(&mesh.faces, uses[0].2)[0] != ends(&mesh.faces, uses[1].2)[0]
            })
}

/// Sets of numbers that grow together.
pub(super) struct Groups {
    parent: Vec<u32>,
}

impl Groups {
    pub(super) fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).collect(),
        }
    }
    /// The lowest member of the set of `member`.
    pub(super) fn root(&mut self, mut member: u32) -> u32 {
        while self.parent[member as usize] != member {
            let grandparent = self.parent[self.parent[member as usize] as usize];
            self.parent[member as usize] = grandparent;
            member = grandparent;
        }
        member
    }
    pub(super) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}

/// The faces of each part of a mesh that hangs together through shared vertices, in order of the first face.
pub(super) fn components(faces: &[[u32; 3]], vertices: usize) -> Vec<Vec<u32>> {
    let mut groups = Groups::new(vertices);
    for &[a, b, c] in faces {
        groups.join(a, b);
        groups.join(b, c);
    }
    let mut number = vec![NONE; vertices];
    let mut parts: Vec<Vec<u32>> = Vec::new();
    for (face, corners) in faces.iter().enumerate() {
        let root = groups.root(corners[0]) as usize;
        if number[root] == NONE {
            number[root] = parts.len() as u32;
            parts.push(Vec::new());
        }
        parts[number[root] as usize].push(face as u32);
    }
    parts
}

/// Some faces of a mesh, with the vertices that they use.
pub(super) fn part(mesh: &TriangleMesh, faces: &[u32]) -> TriangleMesh {
    let mut number = HashMap::with_capacity(faces.len());
    let mut part = TriangleMesh::default();
    for &face in faces {
        let corners = mesh.faces[face as usize].map(|vertex| {
            *number.entry(vertex).or_insert_with(|| {
                part.vertices.push(mesh.vertices[vertex as usize]);
                part.vertices.len() as u32 - 1
            })
        });
        part.faces.push(corners);
    }
    part
}

/// The mesh without vertices that no face uses.
pub(super) fn compacted(mut mesh: TriangleMesh) -> TriangleMesh {
    let mut number = vec![NONE; mesh.vertices.len()];
    for &vertex in mesh.faces.iter().flatten() {
        number[vertex as usize] = 0;
    }
    let mut kept = 0;
    for (vertex, new) in number.iter_mut().enumerate() {
        if *new != NONE {
            *new = kept;
            mesh.vertices[kept as usize] = mesh.vertices[vertex];
            kept += 1;
        }
    }
    mesh.vertices.truncate(kept as usize);
    for vertex in mesh.faces.iter_mut().flatten() {
        *vertex = number[*vertex as usize];
    }
    mesh
}
