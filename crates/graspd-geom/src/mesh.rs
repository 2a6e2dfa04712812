//! Indexed triangle meshes.

use nalgebra::{Isometry3, Point3, Vector3};

/// A triangle mesh: corners of the triangles as indices into a list of vertices, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions \[m\], `[n, 3]`.
    pub vertices: Vec<Point3<f64>>,
    /// Vertex indices of each triangle, `[m, 3]`.
    pub faces: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// The corners of face `face`.
    ///
    /// # Panics
    /// If `face` or one of its indices is out of range.
    pub fn corners(&self, face: usize) -> [Point3<f64>; 3] {
        self.faces[face].map(|index| self.vertices[index as usize])
    }
    /// Twice the area times the outward unit normal of face `face`: (b - a) x (c - a).
    pub fn area_vector(&self, face: usize) -> Vector3<f64> {
        let [a, b, c] = self.corners(face);
        (b - a).cross(&(c - a))
    }
    /// Surface area \[m^2\].
    pub fn area(&self) -> f64 {
        (0..self.faces.len())
            .map(|face| 0.5 * self.area_vector(face).norm())
            .sum()
    }
    /// The axis-aligned bounding box as (lowest, highest) corner; `None` for a mesh without vertices.
    pub fn bounds(&self) -> Option<(Point3<f64>, Point3<f64>)> {
        let first = *self.vertices.first()?;
        Some(
            self.vertices
                .iter()
                .fold((first, first), |(low, high), p| (low.inf(p), high.sup(p))),
        )
    }
    /// Every vertex moved by a rigid motion.
    pub fn transformed(&self, motion: &Isometry3<f64>) -> Self {
        Self {
            vertices: self.vertices.iter().map(|p| motion * p).collect(),
            faces: self.faces.clone(),
        }
    }
    /// Every coordinate multiplied by `factor`.
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            vertices: self.vertices.iter().map(|p| p * factor).collect(),
            faces: self.faces.clone(),
        }
    }
    /// Appends another mesh's vertices and faces; the two stay unconnected.
    pub fn append(&mut self, other: &Self) {
        let offset = self.vertices.len() as u32;
        self.vertices.extend_from_slice(&other.vertices);
        self.faces
            .extend(other.faces.iter().map(|face| face.map(|i| i + offset)));
    }
}
