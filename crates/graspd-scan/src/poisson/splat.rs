//! Spreading samples over cells, and reading them back.

use std::ops::Range;

use rayon::prelude::*;

use super::octree::{cell_of, cells_across};
use super::runs::Runs;
use super::samples::Sample;

/// Which samples, sorted by z at least as finely, lie in the given layers of cells of a level (numbered from 1).
pub(super) fn in_layers(samples: &[Sample], depth: u32, layers: Range<usize>) -> &[Sample] {
    let before =
        |layer: usize| samples.partition_point(|sample| cell_of(sample.position[2], depth) < layer);
    &samples[before(layers.start)..before(layers.end)]
}

/// The quadratic B-spline about a coordinate at the middles of its cell and the cells before and after it.
fn weights(coordinate: f64, depth: u32) -> (usize, [f64; 3]) {
    let cell = cell_of(coordinate, depth);
    let t = coordinate * cells_across(depth) as f64 - (cell - 1) as f64;
    let (before, after) = (1.0 - t, t);
    (
        cell,
        [
            0.5 * before * before,
            0.5 + before * after,
            0.5 * after * after,
        ],
    )
}

/// Adds each sample's value to the 27 cells around it, weighted by B-splines whose sum is 1.
///
/// Every sample with a value must have its 27 cells in the set.
pub(super) fn splat<const N: usize>(
    cells: &Runs,
    depth: u32,
    samples: &[Sample],
    value: impl Fn(&Sample) -> Option<[f64; N]> + Sync,
) -> Vec<[f64; N]> {
    let mut sums = vec![[0.0; N]; cells.len()];
    cells
        .layers(&mut sums)
        .into_par_iter()
        .enumerate()
        .for_each(|(z, layer)| {
            if layer.is_empty() {
                return;
            }
            let start = cells.layer(z).start;
            for sample in in_layers(samples, depth, z.saturating_sub(1)..z + 2) {
                let Some(value) = value(sample) else { continue };
                let [x, y, middle] = sample.position.map(|x| weights(x, depth));
                for dy in 0..3 {
                    let Some(first) = cells.find(z, y.0 + dy - 1, x.0 as u32 - 1) else {
                        continue;
                    };
                    let row = middle.1[z + 1 - middle.0] * y.1[dy];
                    for dx in 0..3 {
                        for k in 0..N {
                            layer[first - start + dx][k] += row * x.1[dx] * value[k];
                        }
                    }
                }
            }
        });
    sums
}

/// The values of the 27 cells around a position, weighted as by [`splat`]; cells outside the set count as 0.
pub(super) fn gather<const N: usize>(
    cells: &Runs,
    depth: u32,
    values: &[[f64; N]],
    position: &[f64; 3],
) -> [f64; N] {
    let [x, y, z] = position.map(|x| weights(x, depth));
    let mut sum = [0.0; N];
    for (dz, dy, dx) in (0..27).map(|i| (i / 9, i / 3 % 3, i % 3)) {
        if let Some(cell) = cells.find(z.0 + dz - 1, y.0 + dy - 1, (x.0 + dx - 1) as u32) {
            for k in 0..N {
                sum[k] += z.1[dz] * y.1[dy] * x.1[dx] * values[cell][k];
            }
        }
    }
    sum
}
