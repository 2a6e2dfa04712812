//! How deep a point is inside a part.

use graspd_geom::TriangleMesh;
use nalgebra::{Point3, Vector3};

/// A closed part with its signed distance, in the frame of the part's mesh.
pub(crate) struct Solid {
    bounds: (Point3<f64>, Point3<f64>),
    planes: Vec<(Vector3<f64>, f64)>,
}

impl Solid {
    pub(crate) fn new(mesh: &TriangleMesh) -> Self {
        let planes = (0..mesh.faces.len())
            .filter_map(|face| {
                let normal = mesh.area_vector(face).try_normalize(1e-14)?;
                Some((normal, normal.dot(&mesh.corners(face)[0].coords)))
            })
            .collect();
        Self {
            bounds: mesh.bounds().unwrap_or_default(),
            planes,
        }
    }

    /// Lowest and highest corner of the bounding box.
    pub(crate) fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        self.bounds
    }

    /// Distance to the surface, negative inside \[m\]; outside the bounding box only positive.
    pub(crate) fn signed_distance(&self, point: Point3<f64>) -> f64 {
        let (low, high) = self.bounds;
        let outside = (low - point).sup(&(point - high)).max();
        if outside > 0.0 {
            return outside;
        }
        self.planes
            .iter()
            .map(|(normal, offset)| normal.dot(&point.coords) - offset)
            .fold(f64::NEG_INFINITY, f64::max)
    }
}
