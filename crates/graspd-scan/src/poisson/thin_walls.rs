//! Walls thinner than a cell.
//!
//! A wall between two layers of nodes has no node inside: the function, trilinear in between, is about the same at
//! both of its sides and at the nodes, and noise decides whether the wall is there or there is a hole. There
//! the samples draw the function to a value slightly inside, so that the wall comes out about a cell thick.

use rayon::prelude::*;

use super::octree::cells_around;
use super::samples::Sample;
use super::splat::{gather, splat};

/// Where less than this part of the area around a sample looks the other way, nothing is thin. A wall of one cell has
/// 0.26, one of no thickness 0.5.
const THICK: f64 = 0.25;
/// Value that samples of both sides of a wall without thickness are drawn to; the surface's own is 0, and far
/// inside it is about -0.5. Less leaves holes, more thickens walls that have none.
const SLIGHTLY_INSIDE: f64 = -0.01;

/// Gives each sample the value that the function is drawn to there, for cells of a depth.
pub(super) fn aim(samples: &mut [Sample], depth: u32) {
    let cells = cells_around(depth, samples);
    let sums = splat(&cells, depth, samples, |sample| {
        let n = sample.normal * (sample.area / sample.count);
        Some([n.x, n.y, n.z, sample.area])
    });
    samples.par_iter_mut().for_each(|sample| {
        let [x, y, z, area] = gather(&cells, depth, &sums, &sample.position);
        let normal = sample.normal.try_normalize(0.0).unwrap_or_default();
        let opposite = 0.5 * (1.0 - (x * normal.x + y * normal.y + z * normal.z) / area);
        sample.target = SLIGHTLY_INSIDE * ((opposite - THICK) / (0.5 - THICK)).clamp(0.0, 1.0);
    });
}
