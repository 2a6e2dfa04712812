//! Interpenetration volume: how much of the hand is inside the object.

use graspd_geom::SignedDistance;

use crate::voxels::count_common_voxels;

/// Volume of the hand's solid inside the object \[cm^3\]: of those voxels of size `voxel_size` \[m\] whose centre is
/// inside the hand and has a negative true signed distance to the object.
///
/// `hand`: of the posed hand in the object's frame. Its parts may overlap: what is inside any of them is inside
/// the hand. The error falls with the voxel size, at first order or faster.
pub fn interpenetration_volume_cm3(
    hand: &SignedDistance,
    object: &SignedDistance,
    voxel_size: f64,
) -> f64 {
    count_common_voxels(object, hand, voxel_size) as f64 * voxel_size.powi(3) * 1e6
}
