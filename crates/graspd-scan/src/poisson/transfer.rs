//! Trilinear functions of one level as functions of the next finer one, and the transpose of that.

use rayon::prelude::*;

use super::octree::Level;

/// The nodes of the level above that make up node `number` along an axis, with their weights (the second may be 0).
fn parents(number: usize) -> [(usize, f64); 2] {
    // Node 1 is at the cube's border on every level.
    if number % 2 == 1 {
        let same = number / 2 + 1;
        [(same, 1.0), (same, 0.0)]
    } else {
        [(number / 2, 0.5), (number / 2 + 1, 0.5)]
    }
}

/// Calls `pair(fine, coarse, weight)`, all with a positive weight, for the fine nodes of one row within the cube.
fn each_pair(
    fine: &Level,
    above: &Level,
    [z, y]: [usize; 2],
    [coarse_z, coarse_y]: [usize; 2],
    row_weight: f64,
    mut pair: impl FnMut(usize, usize, f64),
) {
    let last = fine.nodes.side() - 1;
    for run in fine.nodes.row(z, y) {
        for x in run.first..run.end {
            if Level::is_outside(x as usize, last) {
                continue;
            }
            for (coarse_x, weight) in parents(x as usize) {
                if weight > 0.0
                    && let Some(coarse) = above.nodes.find(coarse_z, coarse_y, coarse_x as u32)
                {
                    pair(
                        (run.base + (x - run.first)) as usize,
                        coarse,
                        row_weight * weight,
                    );
                }
            }
        }
    }
}

/// The values at a level's nodes of a function given at the nodes of the level above. Nodes outside the cube get 0.
pub(super) fn prolong(fine: &Level, above: &Level, coarse_values: &[f64]) -> Vec<f64> {
    let mut values = vec![0.0; fine.nodes.len()];
    let last = fine.nodes.side() - 1;
    let layers = fine.nodes.layers(&mut values);
    layers.into_par_iter().enumerate().for_each(|(z, layer)| {
        if layer.is_empty() || Level::is_outside(z, last) {
            return;
        }
        let start = fine.nodes.layer(z).start;
        for y in 1..last {
            for (coarse_z, weight_z) in parents(z) {
                for (coarse_y, weight_y) in parents(y) {
                    let weight = weight_z * weight_y;
                    if weight > 0.0 {
                        each_pair(
                            fine,
                            above,
                            [z, y],
                            [coarse_z, coarse_y],
                            weight,
                            |fine, coarse, weight| {
                                layer[fine - start] += weight * coarse_values[coarse];
                            },
                        );
                    }
                }
            }
        }
    });
    values
}

/// Adds to integrals against the basis functions of the level above those against the functions of this one.
pub(super) fn restrict(fine: &Level, integrals: &[f64], above: &Level, sums: &mut [f64]) {
    let last = fine.nodes.side() - 1;
    let layers = above.nodes.layers(sums);
    layers
        .into_par_iter()
        .enumerate()
        .for_each(|(coarse_z, layer)| {
            if layer.is_empty() {
                return;
            }
            let start = above.nodes.layer(coarse_z).start;
            // Fine nodes at most one apart from 2 (coarse - 1) + 1.
            let near =
                |coarse: usize| (2 * coarse).saturating_sub(2).max(1)..=(2 * coarse).min(last - 1);
            for z in near(coarse_z) {
                let weight_z = if z + 1 == 2 * coarse_z { 1.0 } else { 0.5 };
                for coarse_y in 0..above.nodes.side() {
                    for y in near(coarse_y) {
                        let weight = weight_z * if y + 1 == 2 * coarse_y { 1.0 } else { 0.5 };
                        each_pair(
                            fine,
                            above,
                            [z, y],
                            [coarse_z, coarse_y],
                            weight,
                            |fine, coarse, weight| {
                                layer[coarse - start] += weight * integrals[fine];
                            },
                        );
                    }
                }
            }
        });
}
