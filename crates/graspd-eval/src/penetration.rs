//! Penetration depth: how deep the hand's surface gets into the object.

use graspd_geom::{SignedDistance, TriangleMesh};
use nalgebra::Point3;

use crate::voxels::SurfaceVoxel;

/// Largest depth of a point of the hand's surface inside the object \[mm\]; 0 if none is inside.
///
/// Looks at every vertex of the hand and at a point in every surface voxel (`half_diagonal` \[m\]: of a voxel).
pub(crate) fn max_penetration_mm(
    hand: &TriangleMesh,
    voxels: &[SurfaceVoxel],
    half_diagonal: f64,
    object: &SignedDistance,
) -> f64 {
    let (low, high) = object.bounds();
    let is_within =
        |p: &Point3<f64>| (0..3).all(|axis| low[axis] < p[axis] && p[axis] < high[axis]);
    let deepest_vertex = (hand.vertices.iter().filter(|p| is_within(p)))
        .map(|p| object.signed_distance(p))
        .fold(0.0, f64::min);
    let deepest = voxels.iter().fold(deepest_vertex, |deepest, voxel| {
        // The point is no deeper than its voxel's centre and the way there.
        if voxel.distance - half_diagonal < deepest {
            deepest.min(object.signed_distance(&voxel.point))
        } else {
            deepest
        }
    });
    // -0.0 is not a depth to report.
    (-deepest).max(0.0) * 1e3
}
