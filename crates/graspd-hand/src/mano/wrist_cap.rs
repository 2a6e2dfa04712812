//! The surface of a skinned hand made closed: its wrist is open.

use graspd_geom::{Topology, TriangleMesh, topology};
use nalgebra::Point3;

/// What closes a surface: for each loop of its boundary a fan of triangles about the loop's middle.
#[derive(Clone, Debug)]
pub(crate) struct WristCap {
    /// The faces of the open surface and of the fans, outward oriented; the middle of loop k is vertex `v + k`.
    pub(crate) faces: Vec<[u32; 3]>,
    /// Vertices of each loop.
    pub(crate) loops: Vec<Vec<u32>>,
}

impl WristCap {
    /// Closes the surface, and turns it inside out if it was.
    ///
    /// # Errors
    /// The topology of what cannot be closed by fans, as three faces at an edge.
    pub(crate) fn new(vertices: &[Point3<f64>], faces: &[[u32; 3]]) -> Result<Self, Topology> {
        let mut open = TriangleMesh {
            vertices: vertices.to_vec(),
            faces: faces.to_vec(),
        };
        let loops: Vec<Vec<u32>> = topology(&open)
            .boundary_loops
            .into_iter()
            .map(|l| l.vertices)
            .collect();
        for vertices in &loops {
            let middle = open.vertices.len() as u32;
            let center = middle_of(vertices.iter().map(|&v| open.vertices[v as usize]));
            let mut fan = fan(vertices, middle);
            // The fan runs against the faces that it meets.
            let edge = [vertices[0], vertices[1 % vertices.len()]];
            if has_directed_edge(&open.faces, edge) {
                for face in &mut fan {
                    face.swap(1, 2);
                }
            }
            open.vertices.push(center);
            open.faces.extend(fan);
        }
        let closed = topology(&open);
        if !closed.is_closed() {
            return Err(closed);
        }
        if signed_volume(&open) < 0.0 {
            for face in &mut open.faces {
                face.swap(1, 2);
            }
        }
        Ok(Self {
            faces: open.faces,
            loops,
        })
    }

    /// Returns the closed surface over posed vertices, `[v]`.
    pub(crate) fn surface(&self, mut vertices: Vec<Point3<f64>>) -> TriangleMesh {
        self.close(&mut vertices);
        TriangleMesh {
            vertices,
            faces: self.faces.clone(),
        }
    }

    /// Adds the middles of the loops to posed vertices.
    pub(crate) fn close(&self, vertices: &mut Vec<Point3<f64>>) {
        for wrist in &self.loops {
            let center = middle_of(wrist.iter().map(|&v| vertices[v as usize]));
            vertices.push(center);
        }
    }
}

/// Makes triangles from each edge of a loop to `middle`, along the loop's own direction.
fn fan(vertices: &[u32], middle: u32) -> Vec<[u32; 3]> {
    let next = vertices.iter().cycle().skip(1);
    let edges = vertices.iter().zip(next);
    edges.map(|(&a, &b)| [a, b, middle]).collect()
}

fn has_directed_edge(faces: &[[u32; 3]], edge: [u32; 2]) -> bool {
    faces
        .iter()
        .any(|&[a, b, c]| [[a, b], [b, c], [c, a]].contains(&edge))
}

fn middle_of(points: impl ExactSizeIterator<Item = Point3<f64>>) -> Point3<f64> {
    let count = points.len() as f64;
    let sum = points.fold(nalgebra::Vector3::zeros(), |sum, p| sum + p.coords);
    Point3::from(sum / count)
}

/// Computes the volume by the divergence theorem: negative where faces point inwards.
fn signed_volume(mesh: &TriangleMesh) -> f64 {
    (0..mesh.faces.len())
        .map(|face| mesh.corners(face)[0].coords.dot(&mesh.area_vector(face)))
        .sum()
}
