//! The linear system of one level: stiffness of the trilinear elements and the pull of the samples.

use rayon::prelude::*;

use super::octree::{Level, cell_of, cells_across};
use super::samples::Sample;
use super::splat::in_layers;

/// Entries of a row of the matrix: the 27 nodes around a node, x fastest.
pub(super) const ROW: usize = 27;

/// Consecutive unknowns along x, and where their neighbours are.
struct UnknownRun {
    count: usize,
    /// The number of the first as an unknown.
    unknown: usize,
    /// The number of the first as a node.
    node: usize,
    /// The number of the node before the first, in each of the nine rows around.
    rows: [usize; 9],
}

/// Matrix and layout of one level's system, divided by the cells' width.
pub(super) struct System<'a> {
    level: &'a Level,
    /// For each layer of nodes.
    runs: Vec<Vec<UnknownRun>>,
    rows: Vec<[f64; ROW]>,
    /// 1 / diagonal for unknowns, 0 for other nodes.
    inverse_diagonal: Vec<f64>,
}

impl<'a> System<'a> {
    /// Assembles the integrals of grad B_i . grad B_j over the cube, plus `pull` / width times the samples' areas
    /// times B_i B_j.
    pub(super) fn new(level: &'a Level, samples: &[Sample], pull: f64) -> Self {
        let runs = unknown_runs(level);
        let mut rows = vec![[0.0; ROW]; level.unknowns.len()];
        let mut inverse_diagonal = vec![0.0; level.nodes.len()];
        let weight = pull / (level.width() * level.width());
        (level.unknowns.layers(&mut rows).into_par_iter())
            .zip(level.nodes.layers(&mut inverse_diagonal))
            .enumerate()
            .for_each(|(z, (rows, diagonal))| {
                if rows.is_empty() {
                    return;
                }
                let start = level.unknowns.layer(z).start;
                add_stiffness(level, z, rows);
                for sample in in_layers(samples, level.depth, z - 1..z + 1) {
                    add_sample(level, z, rows, start, sample, weight);
                }
                let node_start = level.nodes.layer(z).start;
                for run in &runs[z] {
                    for i in 0..run.count {
                        diagonal[run.node + i - node_start] =
                            1.0 / rows[run.unknown + i - start][ROW / 2];
                    }
                }
            });
        Self {
            level,
            runs,
            rows,
            inverse_diagonal,
        }
    }

    /// Matrix times vector, at unknowns; 0 at other nodes. Gives the product's dot product with the vector.
    fn apply(&self, vector: &[f64], product: &mut [f64]) -> f64 {
        let partial: Vec<f64> = (self.level.nodes.layers(product).into_par_iter())
            .enumerate()
            .map(|(z, product)| {
                let start = self.level.nodes.layer(z).start;
                let mut dot = 0.0;
                for run in &self.runs[z] {
                    let rows = &self.rows[run.unknown..run.unknown + run.count];
                    let around = run.rows.map(|first| &vector[first..first + run.count + 2]);
                    let out = &mut product[run.node - start..run.node - start + run.count];
                    for (i, (row, out)) in rows.iter().zip(out).enumerate() {
                        let mut sum = [0.0; 3];
                        for (k, near) in around.iter().enumerate() {
                            for dx in 0..3 {
                                sum[dx] += row[3 * k + dx] * near[i + dx];
                            }
                        }
                        *out = sum[0] + sum[1] + sum[2];
                        dot += *out * around[4][i + 1];
                    }
                }
                dot
            })
            .collect();
        partial.iter().sum()
    }

    /// Solves for the unknowns by conjugate gradients with the diagonal as preconditioner, from the values given;
    /// other nodes keep theirs. Ends when the residual is below `tolerance` times the norm of the right-hand side;
    /// gives the number of iterations.
    pub(super) fn solve(
        &self,
        right: &[f64],
        values: &mut [f64],
        tolerance: f64,
        most: usize,
    ) -> usize {
        let nodes = &self.level.nodes;
        let mut product = vec![0.0; values.len()];
        self.apply(values, &mut product);
        let is_unknown = |i: usize| self.inverse_diagonal[i] > 0.0;
        let mut residual: Vec<f64> = (0..values.len())
            .map(|i| {
                if is_unknown(i) {
                    right[i] - product[i]
                } else {
                    0.0
                }
            })
            .collect();
        let norm = (0..values.len())
            .filter(|&i| is_unknown(i))
            .map(|i| right[i] * right[i])
            .sum::<f64>();
        let small = tolerance * tolerance * norm;
        let mut direction: Vec<f64> = (residual.iter().zip(&self.inverse_diagonal))
            .map(|(r, d)| r * d)
            .collect();
        let mut descent: f64 = residual.iter().zip(&direction).map(|(r, z)| r * z).sum();
        let mut squared: f64 = residual.iter().map(|r| r * r).sum();
        for iteration in 0..most {
            if squared <= small || descent <= 0.0 {
                return iteration;
            }
            let curvature = self.apply(&direction, &mut product);
            let step = descent / curvature;
            let sums: Vec<[f64; 2]> = (nodes.layers(values).into_par_iter())
                .zip(nodes.layers(&mut residual))
                .enumerate()
                .map(|(z, (values, residual))| {
                    let start = nodes.layer(z).start;
                    let mut sums = [0.0; 2];
                    for i in 0..values.len() {
                        values[i] += step * direction[start + i];
                        residual[i] -= step * product[start + i];
                        let squared = residual[i] * residual[i];
                        sums[0] += squared * self.inverse_diagonal[start + i];
                        sums[1] += squared;
                    }
                    sums
                })
                .collect();
            let next: f64 = sums.iter().map(|sum| sum[0]).sum();
            squared = sums.iter().map(|sum| sum[1]).sum();
            let ratio = next / descent;
            descent = next;
            (nodes.layers(&mut direction).into_par_iter())
                .enumerate()
                .for_each(|(z, direction)| {
                    let start = nodes.layer(z).start;
                    for (i, d) in direction.iter_mut().enumerate() {
                        *d = residual[start + i] * self.inverse_diagonal[start + i] + ratio * *d;
                    }
                });
        }
        most
    }
}

fn unknown_runs(level: &Level) -> Vec<Vec<UnknownRun>> {
    let side = level.nodes.side();
    (0..side)
        .into_par_iter()
        .map(|z| {
            let mut runs = Vec::new();
            for y in 0..side {
                for run in level.unknowns.row(z, y) {
                    let number =
                        |dz: usize, dy: usize, x: u32| level.nodes.find(z + dz - 1, y + dy - 1, x);
                    let mut rows = [0; 9];
                    for (k, row) in rows.iter_mut().enumerate() {
                        // All eight cells around an unknown are there, hence all 27 nodes.
                        *row =
                            number(k / 3, k % 3, run.first - 1).expect("a node beside an unknown");
                    }
                    runs.push(UnknownRun {
                        count: (run.end - run.first) as usize,
                        unknown: run.base as usize,
                        node: rows[4] + 1,
                        rows,
                    });
                }
            }
            runs
        })
        .collect()
}

/// Integrals of products of hat functions and of their derivatives over one axis, for cells of width 1, between a
/// node and the one before it, itself and the one after it: halves where the node is at the cube's border.
fn one_axis(number: usize, last: usize) -> ([f64; 3], [f64; 3]) {
    let before = if number == 1 { 0.0 } else { 1.0 };
    let after = if number + 1 == last { 0.0 } else { 1.0 };
    (
        [before / 6.0, (before + after) / 3.0, after / 6.0],
        [-before, before + after, -after],
    )
}

fn add_stiffness(level: &Level, z: usize, rows: &mut [[f64; ROW]]) {
    let last = level.nodes.side() - 1;
    let (mass_z, stiff_z) = one_axis(z, last);
    let mut row = rows.iter_mut();
    for y in 1..last {
        let (mass_y, stiff_y) = one_axis(y, last);
        for run in level.unknowns.row(z, y) {
            for (x, row) in (run.first..run.end).zip(&mut row) {
                let (mass_x, stiff_x) = one_axis(x as usize, last);
                for (k, value) in row.iter_mut().enumerate() {
                    let [dz, dy, dx] = [k / 9, k / 3 % 3, k % 3];
                    *value = stiff_x[dx] * mass_y[dy] * mass_z[dz]
                        + mass_x[dx] * stiff_y[dy] * mass_z[dz]
                        + mass_x[dx] * mass_y[dy] * stiff_z[dz];
                }
            }
        }
    }
}

/// Adds a sample's pull to the rows of the nodes of layer z that its cell has.
fn add_sample(
    level: &Level,
    z: usize,
    rows: &mut [[f64; ROW]],
    start: usize,
    sample: &Sample,
    weight: f64,
) {
    let (cell, hat) = hats(level, &sample.position);
    let corner_z = z - cell[2];
    for corner in 0..4 {
        let (cy, cx) = (corner / 2, corner % 2);
        let Some(unknown) = level.unknowns.find(z, cell[1] + cy, (cell[0] + cx) as u32) else {
            continue;
        };
        let row = &mut rows[unknown - start];
        let own = weight * sample.area * hat[2][corner_z] * hat[1][cy] * hat[0][cx];
        for other in 0..8 {
            let (oz, oy, ox) = (other / 4, other / 2 % 2, other % 2);
            let k = 9 * (oz + 1 - corner_z) + 3 * (oy + 1 - cy) + (ox + 1 - cx);
            row[k] += own * hat[2][oz] * hat[1][oy] * hat[0][ox];
        }
    }
}

/// The cell of a position, and the hat functions of its two nodes along each axis there.
pub(super) fn hats(level: &Level, position: &[f64; 3]) -> ([usize; 3], [[f64; 2]; 3]) {
    let cell = position.map(|x| cell_of(x, level.depth));
    let hat = std::array::from_fn(|axis| {
        let t = position[axis] * cells_across(level.depth) as f64 - (cell[axis] - 1) as f64;
        [1.0 - t, t]
    });
    (cell, hat)
}

/// Adds to the right-hand side of a level's [`System`] what it owes to samples whose target is not 0.
pub(super) fn add_targets(level: &Level, samples: &[Sample], pull: f64, right: &mut [f64]) {
    let weight = pull / (level.width() * level.width());
    for sample in samples.iter().filter(|sample| sample.target != 0.0) {
        let (cell, hat) = hats(level, &sample.position);
        let own = weight * sample.area * sample.target;
        for (dz, dy) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            // Every cell with a sample is there, hence its nodes.
            if let Some(node) = level.nodes.find(cell[2] + dz, cell[1] + dy, cell[0] as u32) {
                for dx in 0..2 {
                    right[node + dx] += own * hat[2][dz] * hat[1][dy] * hat[0][dx];
                }
            }
        }
    }
}
