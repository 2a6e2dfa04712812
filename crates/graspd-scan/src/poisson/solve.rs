//! From samples to the implicit function: one pass from the coarsest level to the finest.

use rayon::prelude::*;

use super::field::{add_parents, divergence, normal_field};
use super::octree::Level;
use super::samples::{Sample, merged};
use super::system::{System, add_targets, hats};
use super::transfer::{prolong, restrict};

/// The coarsest level: 64 cells.
const COARSEST: u32 = 2;
/// Samples are averaged over cells this many levels finer than those of the system that they enter.
pub(super) const FINER: u32 = 2;
/// Residual over right-hand side at which a level counts as solved.
const TOLERANCE: f64 = 1e-4;
/// No level needs as many iterations.
const MAX_ITERATIONS: usize = 200;

/// The implicit function: trilinear in the cells of the finest level that is there.
pub(super) struct Implicit {
    /// From the coarsest to the finest.
    pub(super) levels: Vec<Level>,
    /// At each level's nodes.
    pub(super) values: Vec<Vec<f64>>,
}

impl Implicit {
    /// Solves for the function whose gradient is nearest to the samples' normals and whose values at the samples are
    /// nearest to their targets, level by level.
    pub(super) fn new(samples: &[Sample], depth: u32, pull: f64) -> Self {
        let levels: Vec<Level> = (COARSEST..=depth)
            .map(|depth| Level::new(depth, samples))
            .collect();
        let fields: Vec<Vec<[f64; 3]>> = levels
            .iter()
            .map(|level| normal_field(level, samples))
            .collect();
        // Against each level's basis: the fields of all finer levels.
        let mut right: Vec<Vec<f64>> = levels
            .iter()
            .map(|level| vec![0.0; level.nodes.len()])
            .collect();
        for fine in (1..levels.len()).rev() {
            let own = divergence(&levels[fine], &fields[fine]);
            let (above, below) = right.split_at_mut(fine);
            let integrals: Vec<f64> = own.iter().zip(&below[0]).map(|(a, b)| a + b).collect();
            restrict(
                &levels[fine],
                &integrals,
                &levels[fine - 1],
                &mut above[fine - 1],
            );
        }
        let mut clouds = vec![samples.to_vec()];
        for depth in (COARSEST..depth).rev() {
            let finest = &clouds[clouds.len() - 1];
            clouds.push(merged(finest, depth + FINER));
        }
        let mut values: Vec<Vec<f64>> = Vec::new();
        let mut field: Vec<[f64; 3]> = Vec::new();
        for (index, (level, mut own)) in levels.iter().zip(fields).enumerate() {
            if index > 0 {
                add_parents(level, &mut own, &levels[index - 1], &field);
            }
            field = own;
            let cloud = clouds.pop().unwrap_or_default();
            let system = System::new(level, &cloud, pull);
            let scale = 1.0 / level.width();
            let mut whole: Vec<f64> = (divergence(level, &field).iter().zip(&right[index]))
                .map(|(coarse, fine)| scale * (coarse + fine))
                .collect();
            add_targets(level, &cloud, pull, &mut whole);
            let mut solution = match values.last() {
                Some(coarse) => prolong(level, &levels[index - 1], coarse),
                None => vec![0.0; level.nodes.len()],
            };
            system.solve(&whole, &mut solution, TOLERANCE, MAX_ITERATIONS);
            values.push(solution);
        }
        Self { levels, values }
    }

    /// The value at a point of the unit cube.
    pub(super) fn at(&self, position: &[f64; 3]) -> f64 {
        self.at_or_above(self.levels.len() - 1, position)
    }

    /// The value at a point of the unit cube of the function that levels up to one make.
    pub(super) fn at_or_above(&self, finest: usize, position: &[f64; 3]) -> f64 {
        for (level, values) in self.levels.iter().zip(&self.values).take(finest + 1).rev() {
            let (cell, hat) = hats(level, position);
            if level.cells.find(cell[2], cell[1], cell[0] as u32).is_none() {
                continue;
            }
            let mut sum = 0.0;
            for (dz, dy) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                if let Some(node) = level.nodes.find(cell[2] + dz, cell[1] + dy, cell[0] as u32) {
                    sum += hat[2][dz]
                        * hat[1][dy]
                        * (hat[0][0] * values[node] + hat[0][1] * values[node + 1]);
                }
            }
            return sum;
        }
        0.0
    }

    /// By how much the values at the samples are above their targets, a mean weighted by areas: the surface is
    /// where the function has this value.
    pub(super) fn mean_at(&self, samples: &[Sample]) -> f64 {
        let values: Vec<f64> = samples
            .par_iter()
            .map(|sample| self.at(&sample.position))
            .collect();
        let (sum, area) =
            (samples.iter().zip(&values)).fold((0.0, 0.0), |(sum, area), (sample, value)| {
                (
                    sum + sample.area * (value - sample.target),
                    area + sample.area,
                )
            });
        sum / area
    }
}
