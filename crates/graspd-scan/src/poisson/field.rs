//! The field of the samples' normals, which the gradient of the solution should follow, and its divergence.

use rayon::prelude::*;

use super::octree::Level;
use super::samples::Sample;
use super::splat::splat;

/// Area times normal per volume, in each cell of a level: of the samples that are spread over cells of this level.
///
/// A sample whose depth is between two levels is spread over both, in proportion.
pub(super) fn normal_field(level: &Level, samples: &[Sample]) -> Vec<[f64; 3]> {
    let depth = f64::from(level.depth);
    let cells_per_volume = level.width().powi(-3);
    let mut field = splat(&level.cells, level.depth, samples, |sample| {
        let share = 1.0 - (sample.spread - depth).abs();
        (share > 0.0).then(|| {
            (sample.normal * (share * cells_per_volume * sample.area / sample.count)).into()
        })
    });
    // Nothing is outside the cube.
    let last = level.cells.side() - 1;
    for (value, point) in field.iter_mut().zip(level.cells.points()) {
        if point.iter().any(|&x| Level::is_outside(x as usize, last)) {
            *value = [0.0; 3];
        }
    }
    field
}

/// Adds the field of the level above: every cell has its parent's value.
pub(super) fn add_parents(
    level: &Level,
    field: &mut [[f64; 3]],
    above: &Level,
    parents: &[[f64; 3]],
) {
    let layers = level.cells.layers(field);
    layers.into_par_iter().enumerate().for_each(|(z, layer)| {
        let start = level.cells.layer(z).start;
        for y in 0..level.cells.side() {
            for run in level.cells.row(z, y) {
                let (first, parent_row) =
                    (run.base as usize - start, (z.div_ceil(2), y.div_ceil(2)));
                for x in run.first..run.end {
                    if let Some(parent) =
                        above.cells.find(parent_row.0, parent_row.1, x.div_ceil(2))
                    {
                        let value = &mut layer[first + (x - run.first) as usize];
                        for axis in 0..3 {
                            value[axis] += parents[parent][axis];
                        }
                    }
                }
            }
        }
    });
}

/// The integral of the field times the gradient of each node's trilinear basis function.
pub(super) fn divergence(level: &Level, field: &[[f64; 3]]) -> Vec<f64> {
    let mut result = vec![0.0; level.nodes.len()];
    let face = 0.25 * level.width() * level.width();
    let layers = level.nodes.layers(&mut result);
    layers.into_par_iter().enumerate().for_each(|(z, layer)| {
        let start = level.nodes.layer(z).start;
        for (cell_z, sign_z) in [(z.wrapping_sub(1), face), (z, -face)] {
            for cell_y in 0..level.cells.side() {
                for run in level.cells.row(cell_z, cell_y) {
                    for (node_y, sign_y) in [(cell_y, -face), (cell_y + 1, face)] {
                        let Some(first) = level.nodes.find(z, node_y, run.first) else {
                            continue;
                        };
                        let count = (run.end - run.first) as usize;
                        let nodes = &mut layer[first - start..=first - start + count];
                        let cells = &field[run.base as usize..run.base as usize + count];
                        for (i, &[vx, vy, vz]) in cells.iter().enumerate() {
                            let across = sign_y * vy + sign_z * vz;
                            nodes[i] += across - face * vx;
                            nodes[i + 1] += across + face * vx;
                        }
                    }
                }
            }
        }
    });
    result
}
