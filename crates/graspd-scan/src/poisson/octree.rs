//! The levels of the octree: which cells are there, and which nodes the solution is sought at.

use super::runs::{Runs, intersection, union};
use super::samples::Sample;

/// Levels up to this depth have all their cells: so few that a sparse set would save nothing.
const FULL_DEPTH: u32 = 4;

/// Cells on each side of one with samples. One is what a sample's spread reaches; with two, the error of the
/// surface is a quarter smaller, and with three no smaller still.
const MARGIN: usize = 2;

/// One level: cells of side 2^-depth of the unit cube.
///
/// Cell i of the level along an axis has the number i + 1, so that 0 and 2^depth + 1 are cells outside the cube,
/// without material; nodes are numbered so that cell c lies between nodes c and c + 1. With these every node of the
/// cube has all its 26 neighbours.
pub(super) struct Level {
    pub(super) depth: u32,
    /// Around the samples; the parent of each is a cell of the level above.
    pub(super) cells: Runs,
    /// The corners of the cells.
    pub(super) nodes: Runs,
    /// The nodes with all their eight cells: the solution is sought there and taken from the level above elsewhere.
    pub(super) unknowns: Runs,
}

impl Level {
    /// The level around the samples.
    pub(super) fn new(depth: u32, samples: &[Sample]) -> Self {
        let side = cells_across(depth) + 2;
        let cells = if depth <= FULL_DEPTH {
            Runs::full(side)
        } else {
            cells_around(depth, samples)
        };
        let nodes = Runs::build(side + 1, |z, y, row| {
            for (dz, dy) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                // A row below 0 wraps to one that is not there.
                let runs = cells.row(z.wrapping_sub(dz), y.wrapping_sub(dy));
                row.extend(runs.iter().map(|run| [run.first, run.end + 1]));
            }
            union(row);
        });
        let unknowns = Runs::build(side + 1, |z, y, row| {
            if z == 0 || y == 0 {
                return;
            }
            let inner = |dz, dy| -> Vec<[u32; 2]> {
                (cells.row(z - dz, y - dy).iter())
                    .map(|run| [run.first + 1, run.end])
                    .filter(|interval| interval[0] < interval[1])
                    .collect()
            };
            *row = inner(0, 0);
            for (dz, dy) in [(0, 1), (1, 0), (1, 1)] {
                if !row.is_empty() {
                    *row = intersection(row, &inner(dz, dy));
                }
            }
        });
        Self {
            depth,
            cells,
            nodes,
            unknowns,
        }
    }

    /// Whether all cells of the cube are there.
    pub(super) fn is_full(&self) -> bool {
        self.depth <= FULL_DEPTH
    }

    /// The side of a cell, as a part of the cube's.
    pub(super) fn width(&self) -> f64 {
        1.0 / cells_across(self.depth) as f64
    }

    /// Whether a cell's or node's number is outside the cube, for `last` the greatest number.
    pub(super) fn is_outside(number: usize, last: usize) -> bool {
        number == 0 || number == last
    }
}

/// Cells along each axis of the unit cube.
pub(super) fn cells_across(depth: u32) -> usize {
    1 << depth
}

/// The number of the cell that holds a coordinate of the unit cube.
pub(super) fn cell_of(coordinate: f64, depth: u32) -> usize {
    let across = cells_across(depth);
    ((coordinate * across as f64) as usize).min(across - 1) + 1
}

/// The cells with samples, and [`MARGIN`] cells around each.
pub(super) fn cells_around(depth: u32, samples: &[Sample]) -> Runs {
    let side = cells_across(depth) + 2;
    let mut occupied: Vec<[u32; 3]> = (samples.iter())
        .map(|sample| sample.position.map(|x| cell_of(x, depth) as u32))
        .collect();
    occupied.dedup();
    occupied.sort_unstable_by_key(|&[x, y, z]| (z, y, x));
    occupied.dedup();
    let occupied = Runs::from_sorted(side, &occupied);
    Runs::build(side, |z, y, row| {
        for near_z in z.saturating_sub(MARGIN)..=z + MARGIN {
            for near_y in y.saturating_sub(MARGIN)..=y + MARGIN {
                let runs = occupied.row(near_z, near_y);
                row.extend(runs.iter().map(|run| {
                    [
                        run.first.saturating_sub(MARGIN as u32),
                        (run.end + MARGIN as u32).min(side as u32),
                    ]
                }));
            }
        }
        union(row);
    })
}
