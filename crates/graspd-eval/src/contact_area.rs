//! Contact area: how much of the hand's surface touches the object.

use crate::voxels::SurfaceVoxel;

/// Area of the hand's outer surface in contact \[cm^2\]: that within the surface voxels whose *centre* has a true
/// signed distance to the object below `threshold` \[m\].
///
/// A voxel counts with the area of the surface inside it, not with the area of its side, so that the sum tends to
/// the true area whichever way the surface is tilted. A surface that just touches (distance 0) has about half of
/// its voxels counted at threshold 0, since their centres lie on both sides of it; one that is pressed in by half a
/// voxel has all of them counted.
pub(crate) fn contact_area_cm2(voxels: &[SurfaceVoxel], threshold: f64) -> f64 {
    let touching = voxels.iter().filter(|voxel| voxel.distance < threshold);
    // The empty sum of floats is -0.
    (touching.map(|voxel| voxel.area).sum::<f64>() + 0.0) * 1e4
}
