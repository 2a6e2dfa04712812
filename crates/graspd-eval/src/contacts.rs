//! The contacts of a posed hand, for the wrench-space metrics.

use graspd_geom::SignedDistance;

use crate::voxels::SurfaceVoxel;
use crate::wrench_space::Contact;

/// A contact for each surface voxel of the hand with a point closer to the object than `tolerance` \[m\], or inside.
///
/// The contact lies at the nearest point of the object's surface, and its normal is the object's own there,
/// pointing inwards. `half_diagonal` \[m\]: of a voxel.
pub(crate) fn contacts(
    voxels: &[SurfaceVoxel],
    half_diagonal: f64,
    object: &SignedDistance,
    tolerance: f64,
) -> Vec<Contact> {
    let candidates = voxels
        .iter()
        .filter(|voxel| voxel.distance < tolerance + half_diagonal);
    candidates
        .filter_map(|voxel| {
            let (distance, outward) = object.distance_and_gradient(&voxel.point);
            (distance < tolerance && outward != nalgebra::Vector3::zeros()).then(|| Contact {
                point: voxel.point - outward * distance,
                normal: -outward,
            })
        })
        .collect()
}
