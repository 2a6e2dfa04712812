//! How densely the surface is sampled around each sample.

use rayon::prelude::*;

use super::octree::{cells_across, cells_around};
use super::runs::Runs;
use super::samples::Sample;
use super::splat::{gather, splat};

/// Samples that a cell should hold on average where the density is measured.
const SAMPLES_PER_CELL: f64 = 8.0;
/// Weighted number of samples within a kernel below which a coarser one is used.
const FEWEST: f64 = 3.0;
/// How many coarser levels are tried.
const COARSER: u32 = 2;
/// The coarsest level on which a density means anything.
const COARSEST: u32 = 2;
/// The two B-splines in a row (one spreads, one reads) at distance 0: (66/120) cell widths^-1, whatever the plane.
const KERNEL_PEAK: f64 = 0.55;

/// A density of samples over cells of several levels.
pub(super) struct Density {
    levels: Vec<(u32, Runs, Vec<[f64; 4]>)>,
}

impl Density {
    /// Measures the density where cells hold enough samples, no finer than `depth`.
    pub(super) fn new(samples: &[Sample], depth: u32) -> Self {
        let total: f64 = samples.iter().map(|sample| sample.count).sum();
        let mut finest = depth.max(COARSEST);
        while finest > COARSEST && total < SAMPLES_PER_CELL * occupied(samples, finest) as f64 {
            finest -= 1;
        }
        let coarsest = finest.saturating_sub(COARSER).max(COARSEST);
        let levels = (coarsest..=finest)
            .rev()
            .map(|depth| {
                let cells = cells_around(depth, samples);
                let sums = splat(&cells, depth, samples, |sample| {
                    let n = sample.normal;
                    Some([n.x, n.y, n.z, sample.count])
                });
                (depth, cells, sums)
            })
            .collect();
        Self { levels }
    }

    /// Samples per area of the unit cube at a position on a surface with the given unit normal.
    ///
    /// Each sample counts by (1 + cosine of the angle between the normals) / 2: the other side of a thin wall does
    /// not.
    pub(super) fn at(&self, position: &[f64; 3], normal: &[f64; 3]) -> f64 {
        let mut density = 0.0;
        for (depth, cells, sums) in &self.levels {
            let [x, y, z, count] = gather(cells, *depth, sums, position);
            let alike = 0.5 * (count + x * normal[0] + y * normal[1] + z * normal[2]);
            density = alike * (cells_across(*depth) as f64).powi(2) / KERNEL_PEAK;
            if alike >= FEWEST {
                break;
            }
        }
        density
    }
}

/// How many cells of a level hold samples.
fn occupied(samples: &[Sample], depth: u32) -> usize {
    let mut cells: Vec<[usize; 3]> = (samples.par_iter())
        .map(|sample| sample.position.map(|x| super::octree::cell_of(x, depth)))
        .collect();
    cells.par_sort_unstable();
    cells.dedup();
    cells.len()
}

/// Gives each sample its area and the depth at which cells hold `samples_per_cell`.
pub(super) fn assign(samples: &mut [Sample], density: &Density, depth: u32, samples_per_cell: f64) {
    samples.par_iter_mut().for_each(|sample| {
        let unit = sample.normal.try_normalize(0.0).unwrap_or_default();
        let density = density.at(&sample.position, &unit.into());
        sample.area = sample.count / density;
        sample.spread = (0.5 * (density / samples_per_cell).log2())
            .clamp(f64::from(COARSEST), f64::from(depth));
    });
}
