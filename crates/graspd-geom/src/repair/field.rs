//! The scalar field whose zero level is the new surface of a hopeless mesh.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::{NodeGrid, TriangleTree, WindingField};

/// The winding number at the new surface: a half, and more than its error on top, because on one side of a flat sheet
/// it is nearly a half over a whole region.
const LEVEL: f64 = 0.52;
/// Accuracy of winding numbers.
const ACCURACY: f64 = 0.01;
/// A winding number this far from the level is clear ...
const CLEAR: f64 = 0.3;
/// ... and taken for every point within this part of the distance to the surface: it is harmonic there, and so
/// changes little. A mistake would dent the new surface, but it would stay closed.
const REACH: f64 = 0.33;
/// Grid nodes along the sides of a block of which only the middle may have to be looked at.
pub(super) const BLOCK: usize = 4;

/// Negative inside: near the input the signed distance to it; far from it (across holes), the winding number.
pub(super) struct Field<'a> {
    pub(super) grid: NodeGrid,
    pub(super) winding: &'a WindingField,
    /// Sheets that become shells, and half of their thickness \[m\].
    pub(super) shell: Option<(TriangleTree, f64)>,
}

/// A point with a known winding number, and how far that reaches.
struct Known {
    at: Point3<f64>,
    reach: f64,
    winding: f64,
}

impl Field<'_> {
    /// The values at the nodes of [`BLOCK`] layers from layer `first` on, i fastest.
    pub(super) fn layers(&self, first: usize) -> Vec<f64> {
        let [nx, ny, nz] = self.grid.dims;
        let layers = BLOCK.min(nz - first);
        let blocks = [nx.div_ceil(BLOCK), ny.div_ceil(BLOCK)];
        let values: Vec<Vec<f64>> = (0..blocks[0] * blocks[1])
            .into_par_iter()
            .map(|block| {
                let low = [
                    BLOCK * (block % blocks[0]),
                    BLOCK * (block / blocks[0]),
                    first,
                ];
                self.block(low)
            })
            .collect();
        let mut all = vec![f64::INFINITY; nx * ny * layers];
        for (block, values) in values.iter().enumerate() {
            let (x, y) = (BLOCK * (block % blocks[0]), BLOCK * (block / blocks[0]));
            for (index, &value) in values.iter().enumerate() {
                let i = x + index % BLOCK;
                let j = y + index / BLOCK % BLOCK;
                let k = index / (BLOCK * BLOCK);
                if i < nx && j < ny && k < layers {
                    all[i + nx * (j + ny * k)] = value;
                }
            }
        }
        all
    }

    /// The values of one block; those beyond the grid are of no use.
    fn block(&self, low: [usize; 3]) -> Vec<f64> {
        let [a, b] = [0, BLOCK - 1].map(|step| self.grid.node(low.map(|i| i + step)));
        let middle = nalgebra::center(&a, &b);
        let radius = 0.5 * (b - a).norm();
        let mut known = self.look(middle);
        if known.reach >= radius && self.shell_value(&middle, known.winding) > 2.0 * radius {
            return vec![self.value(&middle, known.winding); BLOCK * BLOCK * BLOCK];
        }
        let mut values = Vec::with_capacity(BLOCK * BLOCK * BLOCK);
        for k in 0..BLOCK {
            for j in 0..BLOCK {
                for i in 0..BLOCK {
                    let p = self.grid.node([low[0] + i, low[1] + j, low[2] + k]);
                    if (p - known.at).norm() > known.reach {
                        known = self.look(p);
                    }
                    values.push(self.value(&p, known.winding));
                }
            }
        }
        values
    }

    fn look(&self, at: Point3<f64>) -> Known {
        let winding = self.winding.winding_number(&at, ACCURACY);
        let is_clear = (winding - LEVEL).abs() > CLEAR;
        Known {
            reach: if is_clear {
                REACH * self.winding.tree().distance(&at)
            } else {
                0.0
            },
            at,
            winding,
        }
    }

    fn shell_value(&self, p: &Point3<f64>, winding: f64) -> f64 {
        match &self.shell {
            Some((tree, half)) if winding <= LEVEL => tree.distance(p) - half,
            _ => f64::INFINITY,
        }
    }

    fn value(&self, p: &Point3<f64>, winding: f64) -> f64 {
        /// Grid cells over which the winding number runs, where it counts, from one side to the other.
        const CELLS: f64 = 8.0;
        let across = (LEVEL - winding).abs() * CELLS * self.grid.spacing.x;
        let distance = self.winding.tree().distance(p).min(across);
        let solid = if winding > LEVEL { -distance } else { distance };
        solid.min(self.shell_value(p, winding))
    }
}
