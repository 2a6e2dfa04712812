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

/// The same surface counted as published evaluations count it \[cm^2\]: how many surface voxels
/// have a centre with a true signed distance below `threshold` \[m\], times the area of one side of
/// a voxel, h^2.
///
/// A plane with unit normal n passes through `(|n_x| + |n_y| + |n_z|) / h^2` voxels per area: this overestimates an
/// inclined surface by up to sqrt(3), by 1.5 on average over directions, and does not converge as voxels shrink.
///
/// # Source
/// The evaluations after ObMan's (Y. Hasson et al., "Learning joint reconstruction of hands and
/// manipulated objects", CVPR 2019) take the voxels that a mesh's surface passes through and
/// multiply their number by a power of the voxel size; Grasp'D describes its contact area as done
/// like its volume, over the hand's shell.
pub(crate) fn voxel_count_area_cm2(voxels: &[SurfaceVoxel], threshold: f64, size: f64) -> f64 {
    let touching = voxels.iter().filter(|voxel| voxel.distance < threshold);
    touching.count() as f64 * size * size * 1e4
}
