//! What a fit knows of the object: how far it is, and which way.

use graspd_geom::{SdfGrid, SignedDistance, Vec3};
use nalgebra::Vector3;

/// The signed distance to an object.
pub(super) trait DistanceField {
    /// Signed distance \[m\] and the object's outward unit normal, 0 where there is none.
    fn distance_and_normal(&self, point: &Vector3<f64>) -> (f64, Vector3<f64>);
}

impl DistanceField for SdfGrid {
    fn distance_and_normal(&self, point: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let (distance, gradient) = self.distance_and_gradient(Vec3::from(*point));
        (distance, Vector3::from(gradient.normalize_or_zero()))
    }
}

/// The grid, and near the surface, where cells are too coarse for edges, the mesh itself.
pub(super) struct ExactNearSurface<'a> {
    pub(super) grid: &'a SdfGrid,
    pub(super) mesh: &'a SignedDistance,
    /// From this distance on the grid will do \[m\].
    pub(super) band: f64,
}

impl DistanceField for ExactNearSurface<'_> {
    fn distance_and_normal(&self, point: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let far = self.grid.distance_and_normal(point);
        if far.0 > self.band {
            return far;
        }
        self.mesh.distance_and_gradient(&(*point).into())
    }
}
