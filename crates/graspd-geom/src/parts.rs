//! Connected parts of a mesh.

use std::collections::HashMap;

use crate::TriangleMesh;

const NO_PART: u32 = u32::MAX;

/// Returns the connected parts of a mesh (through shared vertices), in order of their first faces.
///
/// # Examples
/// ```
/// use graspd_geom::{box_mesh, connected_parts};
/// use nalgebra::{Isometry3, Vector3};
///
/// let cube = box_mesh(Vector3::repeat(0.1), 0.1);
/// let mut two = cube.clone();
/// two.append(&cube.transformed(&Isometry3::translation(0.05, 0.0, 0.0)));
/// assert_eq!(connected_parts(&two)[0].faces.len(), cube.faces.len());
/// assert_eq!(connected_parts(&two).len(), 2);
/// ```
///
/// # Panics
/// If a face has an index that no vertex has.
pub fn connected_parts(mesh: &TriangleMesh) -> Vec<TriangleMesh> {
    let parts = components(&mesh.faces, mesh.vertices.len());
    let of = |faces: &Vec<u32>| submesh(mesh, faces);
    parts.iter().map(of).collect()
}

/// Returns the faces of each connected part of a mesh (through shared vertices), in order of the first face.
///
/// # Panics
/// If a face has an index of at least `vertices`.
pub fn components(faces: &[[u32; 3]], vertices: usize) -> Vec<Vec<u32>> {
    let mut groups = Groups::new(vertices);
    for &[a, b, c] in faces {
        groups.join(a, b);
        groups.join(b, c);
    }
    let mut number = vec![NO_PART; vertices];
    let mut parts: Vec<Vec<u32>> = Vec::new();
    for (face, corners) in faces.iter().enumerate() {
        let root = groups.root(corners[0]) as usize;
        if number[root] == NO_PART {
            number[root] = parts.len() as u32;
            parts.push(Vec::new());
        }
        parts[number[root] as usize].push(face as u32);
    }
    parts
}

/// Returns some faces of a mesh with the vertices that they use.
///
/// # Panics
/// If a face, or a vertex of one, does not exist.
pub fn submesh(mesh: &TriangleMesh, faces: &[u32]) -> TriangleMesh {
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

/// Disjoint sets of the numbers below a count (union-find with path halving).
pub struct Groups {
    parent: Vec<u32>,
}

impl Groups {
    /// Makes sets of one member each.
    pub fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).collect(),
        }
    }
    /// Returns the lowest member of the set of `member`.
    ///
    /// # Panics
    /// If `member` is out of range.
    pub fn root(&mut self, mut member: u32) -> u32 {
        while self.parent[member as usize] != member {
            let grandparent = self.parent[self.parent[member as usize] as usize];
            self.parent[member as usize] = grandparent;
            member = grandparent;
        }
        member
    }
    /// Joins the sets of two members.
    ///
    /// # Panics
    /// If either is out of range.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}
