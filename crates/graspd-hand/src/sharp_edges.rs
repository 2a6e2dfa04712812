//! Sharp convex edges of link meshes: the places that dig in first, and that points spread over faces miss.

use std::collections::HashMap;

use graspd_geom::TriangleMesh;
use nalgebra::{Point3, Vector3};

/// Edges whose faces turn by less than this are part of a smooth surface (cosine of 35 degrees).
const SMOOTH_COSINE: f64 = 0.82;

/// A straight stretch of a sharp convex edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SharpEdge {
    start: Point3<f64>,
    end: Point3<f64>,
    /// Unit mean of the two faces' normals.
    normal: Vector3<f64>,
}

impl SharpEdge {
    pub(crate) fn length(&self) -> f64 {
        (self.end - self.start).norm()
    }
}

/// Returns the sharp edges of a closed, outward-oriented mesh, in the order of its faces.
pub(crate) fn sharp_edges(mesh: &TriangleMesh) -> Vec<SharpEdge> {
    // The face on whose boundary each directed edge lies; vertices at one position count as one.
    let mut ids = HashMap::new();
    let id: Vec<usize> = mesh
        .vertices
        .iter()
        .map(|p| {
            let next = ids.len();
            *ids.entry([p.x.to_bits(), p.y.to_bits(), p.z.to_bits()])
                .or_insert(next)
        })
        .collect();
    let mut owner = HashMap::new();
    for (face, corners) in mesh.faces.iter().enumerate() {
        for (a, b) in sides(corners) {
            owner.insert((id[a], id[b]), face);
        }
    }
    let mut found = Vec::new();
    for (face, corners) in mesh.faces.iter().enumerate() {
        let normal = mesh.area_vector(face);
        for (a, b) in sides(corners) {
            let Some(&other) = owner.get(&(id[b], id[a])) else {
                continue;
            };
            // Each edge once.
            if other <= face {
                continue;
            }
            let other_normal = mesh.area_vector(other);
            let (Some(n), Some(m)) = (normal.try_normalize(0.0), other_normal.try_normalize(0.0))
            else {
                continue;
            };
            let (start, end) = (mesh.vertices[a], mesh.vertices[b]);
            let center = mesh
                .corners(other)
                .iter()
                .fold(Vector3::zeros(), |sum, p| sum + p.coords)
                / 3.0;
            let is_convex = (center - start.coords).dot(&n) < 0.0;
            let Some(mean) = (n + m).try_normalize(1e-9) else {
                continue;
            };
            if is_convex && n.dot(&m) < SMOOTH_COSINE {
                found.push(SharpEdge {
                    start,
                    end,
                    normal: mean,
                });
            }
        }
    }
    found
}

fn sides(corners: &[u32; 3]) -> [(usize, usize); 3] {
    let [a, b, c] = corners.map(|index| index as usize);
    [(a, b), (b, c), (c, a)]
}

/// Returns points along sharp edges, `spacing` \[m\] apart on the whole, with the edges' normals.
pub(crate) fn points_along(
    sharp_edges: &[SharpEdge],
    spacing: f64,
) -> Vec<(Point3<f64>, Vector3<f64>)> {
    let mut points = Vec::new();
    // The distance left over on one stretch carries on to the next, so that short ones get their share.
    let mut next = 0.5 * spacing;
    for edge in sharp_edges {
        let length = edge.length();
        while next <= length {
            let at = edge.start + (edge.end - edge.start) * (next / length);
            points.push((at, edge.normal));
            next += spacing;
        }
        next -= length;
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use graspd_geom::{box_mesh, sphere_mesh};

    #[test]
    fn a_box_has_its_twelve_edges_and_a_fine_ball_none() {
        let mesh = box_mesh(Vector3::new(0.02, 0.03, 0.05), 0.004);
        let length: f64 = sharp_edges(&mesh).iter().map(SharpEdge::length).sum();
        assert!((length - 4.0 * (0.02 + 0.03 + 0.05)).abs() < 1e-9);
        assert!(sharp_edges(&sphere_mesh(0.02, 0.004)).is_empty());
    }

    #[test]
    fn concave_edges_are_no_ridges() {
        // A box turned inside out has only concave edges.
        let mut mesh = box_mesh(Vector3::new(0.02, 0.03, 0.05), 0.01);
        for face in &mut mesh.faces {
            face.swap(1, 2);
        }
        assert!(sharp_edges(&mesh).is_empty());
    }

    #[test]
    fn points_lie_on_edges_at_the_asked_spacing() {
        let mesh = box_mesh(Vector3::new(0.02, 0.03, 0.05), 0.004);
        let points = points_along(&sharp_edges(&mesh), 0.005);
        assert_eq!(points.len(), 80);
        for (p, normal) in points {
            let outside = [p.x.abs() - 0.01, p.y.abs() - 0.015, p.z.abs() - 0.025];
            let touched = outside.iter().filter(|d| d.abs() < 1e-12).count();
            assert!(touched >= 2, "{p} is not on an edge");
            assert!((normal.norm() - 1.0).abs() < 1e-12 && normal.dot(&p.coords) > 0.0);
        }
    }
}
