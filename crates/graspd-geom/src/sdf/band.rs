//! Distances far from the surface, from a coarse grid of exact ones.
//!
//! The square of the distance to any set, less |x|^2, is concave: it is the least, over the points y of the set, of
//! the linear functions |y|^2 - 2 x.y. So within a cell whose corners x_c have the weights w_c in a trilinear
//! interpolation,
//!
//! ```text
//! d(x)^2 >= sum of w_c d(x_c)^2 - (sum of w_c |x_c|^2 - |x|^2) = sum of w_c d(x_c)^2 - sum of h_a^2 t_a (1 - t_a)
//! ```
//!
//! where h_a are the cell's sides and t_a the coordinates in it. This lower bound is what far nodes get: it agrees
//! with d at the corners, is continuous, and falls short of d by at most about (h_x^2 + h_y^2 + h_z^2) / 8 d.

use nalgebra::Point3;

use super::SdfGrid;
use super::grid::node;
use super::rows::Rows;
use crate::Vec3;
use crate::distance::SignedDistance;

/// Nodes along the side of a coarse cell.
const COARSE: usize = 8;
/// Rounding to single precision must not lengthen a distance.
const SHORTER: f64 = 1.0 - f32::EPSILON as f64;

/// Cells of 8 x 8 x 8 nodes, and which of them the band does not reach.
pub(super) struct CoarseCells {
    /// Cells along each axis; there is one corner more.
    cells: [usize; 3],
    dims: [usize; 3],
    spacing: Vec3<f64>,
    /// The exact distances at the corners, squared, x fastest.
    squared: Vec<f64>,
    /// Whether every point of the cell is farther from the surface than the band is wide.
    is_far: Vec<bool>,
}

impl CoarseCells {
    pub(super) fn new(surface: &SignedDistance, grid: &SdfGrid, band: f64) -> Self {
        let (dims, spacing) = (grid.dims(), grid.spacing());
        let cells = dims.map(|n| (n - 1).div_ceil(COARSE));
        let mut corners: Vec<Point3<f64>> = Vec::new();
        for k in 0..=cells[2] {
            for j in 0..=cells[1] {
                for i in 0..=cells[0] {
                    let index = [i, j, k].map(|cell| COARSE * cell);
                    let index = [0, 1, 2].map(|axis| index[axis].min(dims[axis] - 1));
                    corners.push(node(grid.origin(), spacing, index).into());
                }
            }
        }
        let mut coarse = Self {
            cells,
            dims,
            spacing,
            squared: (surface.signed_distances(&corners).iter())
                .map(|distance| distance * distance)
                .collect(),
            is_far: Vec::new(),
        };
        for k in 0..cells[2] {
            for j in 0..cells[1] {
                for i in 0..cells[0] {
                    let least = coarse
                        .corners([i, j, k])
                        .into_iter()
                        .fold(f64::INFINITY, f64::min);
                    // The subtracted sum is largest in the cell's middle.
                    let middle: f64 = (0..3)
                        .map(|axis| coarse.side(axis, [i, j, k][axis]).powi(2) / 4.0)
                        .sum();
                    coarse.is_far.push(least - middle > band * band);
                }
            }
        }
        coarse
    }

    /// Whether all nodes of the box with these two corners are in far cells; no side is longer than a cell's.
    #[inline]
    pub(super) fn are_far(&self, first: [usize; 3], last: [usize; 3]) -> bool {
        let (low, high) = (self.cell(first), self.cell(last));
        let is_far = |cell| self.is_far[self.number(cell)];
        if low == high {
            return is_far(low);
        }
        (0..8).all(|bits| is_far([0, 1, 2].map(|axis| [low, high][bits >> axis & 1][axis])))
    }

    /// Writes the lower bounds of the nodes in far cells.
    pub(super) fn fill_far(&self, rows: Rows, values: &mut [f32]) {
        for k in rows.layers.0..rows.layers.1 {
            for j in 0..rows.ny {
                let row = rows.nx * (j + rows.ny * (k - rows.layers.0));
                let [_, cell_j, cell_k] = self.cell([0, j, k]);
                for cell_i in 0..self.cells[0] {
                    let cell = [cell_i, cell_j, cell_k];
                    if self.is_far[self.number(cell)] {
                        self.fill_row(cell, [j, k], &mut values[row..row + rows.nx]);
                    }
                }
            }
        }
    }

    /// The nodes of one row of a far cell.
    fn fill_row(&self, cell: [usize; 3], [j, k]: [usize; 2], row: &mut [f32]) {
        let c = self.corners(cell);
        let [ty, tz] = [self.at(1, cell[1], j), self.at(2, cell[2], k)];
        let lerp = |low: f64, high: f64, t: f64| low + (high - low) * t;
        let low = lerp(lerp(c[0], c[2], ty), lerp(c[4], c[6], ty), tz);
        let high = lerp(lerp(c[1], c[3], ty), lerp(c[5], c[7], ty), tz);
        let bulge = |axis: usize, t: f64| self.side(axis, cell[axis]).powi(2) * t * (1.0 - t);
        let across = bulge(1, ty) + bulge(2, tz);
        let first = COARSE * cell[0];
        let end = if cell[0] + 1 == self.cells[0] {
            self.dims[0]
        } else {
            first + COARSE
        };
        for i in first..end {
            let tx = self.at(0, cell[0], i);
            let squared = lerp(low, high, tx) - across - bulge(0, tx);
            row[i] = (squared.max(0.0).sqrt() * SHORTER) as f32;
        }
    }

    /// The cell of a node; the last nodes belong to the last cells.
    #[inline]
    fn cell(&self, index: [usize; 3]) -> [usize; 3] {
        [0, 1, 2].map(|axis| (index[axis] / COARSE).min(self.cells[axis] - 1))
    }

    fn number(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.cells[0] * (j + self.cells[1] * k)
    }

    /// The squared distances at a cell's corners, x fastest.
    fn corners(&self, [i, j, k]: [usize; 3]) -> [f64; 8] {
        let [nx, ny, _] = self.cells.map(|n| n + 1);
        [0, 1, 2, 3, 4, 5, 6, 7].map(|bits| {
            let (i, j, k) = (i + (bits & 1), j + (bits >> 1 & 1), k + (bits >> 2));
            self.squared[i + nx * (j + ny * k)]
        })
    }

    /// How many nodes a cell is long.
    fn nodes(&self, axis: usize, cell: usize) -> usize {
        COARSE.min(self.dims[axis] - 1 - COARSE * cell)
    }

    /// How long a cell is \[m\].
    fn side(&self, axis: usize, cell: usize) -> f64 {
        self.nodes(axis, cell) as f64 * self.spacing.get(axis)
    }

    /// The coordinate of a node in its cell, 0 to 1.
    fn at(&self, axis: usize, cell: usize, index: usize) -> f64 {
        (index - COARSE * cell) as f64 / self.nodes(axis, cell) as f64
    }
}
