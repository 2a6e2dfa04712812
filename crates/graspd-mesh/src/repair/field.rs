//! The scalar field whose zero level is the new surface of a hopeless mesh.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::NodeGrid;
use graspd_geom::{TriangleTree, WindingField};

/// The winding number at the new surface: a half, and more than its error on top, because on one side of a flat sheet
/// it is nearly a half over a whole region.
const LEVEL: f64 = 0.52;
/// Accuracy of a first look at a winding number, which is enough in most places: the work grows with the accuracy.
const ROUGH: f64 = 0.15;
/// A first look this far from the level settles the side.
const SETTLED: f64 = 0.3;
/// Accuracy where it does not.
const ACCURACY: f64 = 0.01;
/// A settled winding number is taken for every point within this part of the distance to the surface: it is
/// harmonic there, and so changes little. A mistake would dent the new surface, but it would stay closed.
const REACH: f64 = 0.33;
/// Grid nodes along the sides of a block of which only the middle and the corners may have to be looked at.
const BLOCK: usize = 4;

/// Negative inside: near the input the signed distance to it; far from it (across holes), the winding number.
pub(super) struct Field<'a> {
    pub(super) grid: NodeGrid,
    pub(super) winding: &'a WindingField,
}

/// A point with a known winding number, and how far that reaches.
struct Known {
    at: Point3<f64>,
    reach: f64,
    winding: f64,
}

impl Known {
    fn is_settled(&self) -> bool {
        (self.winding - LEVEL).abs() > SETTLED
    }
}

impl Field<'_> {
    /// The values at all nodes, i fastest.
    pub(super) fn values(&self) -> Vec<f32> {
        self.by_blocks(|low, put| self.block(low, put))
    }

    /// Adds shells of the given half thickness \[m\] around the faces of a sheet to the inside.
    pub(super) fn add_shells(&self, values: &mut [f32], sheet: &TriangleTree, half: f64) {
        let spacing = self.grid.spacing.x;
        let shells = self.by_blocks(|low, put| {
            let (middle, radius) = self.ball(low);
            if sheet.distance(&middle) > half + radius + 2.0 * spacing {
                return;
            }
            for_block(low, |node| {
                let distance = sheet.distance(&self.grid.node(node)) - half;
                put(node, distance as f32);
            });
        });
        for (value, shell) in values.iter_mut().zip(shells) {
            *value = value.min(shell);
        }
    }

    /// Runs `block` for the lowest node of each block, and gives what it put at nodes; infinity elsewhere.
    fn by_blocks(
        &self,
        block: impl Fn([usize; 3], &mut dyn FnMut([usize; 3], f32)) + Sync,
    ) -> Vec<f32> {
        let [nx, ny, nz] = self.grid.dims;
        let mut values = vec![f32::INFINITY; nx * ny * nz];
        values
            .par_chunks_mut(BLOCK * nx * ny)
            .enumerate()
            .for_each(|(slab, values)| {
                let first = BLOCK * slab;
                let mut put = |[i, j, k]: [usize; 3], value: f32| {
                    // The last blocks reach beyond the grid.
                    if i < nx && j < ny && k < nz {
                        values[i + nx * (j + ny * (k - first))] = value;
                    }
                };
                for j in (0..ny).step_by(BLOCK) {
                    for i in (0..nx).step_by(BLOCK) {
                        block([i, j, first], &mut put);
                    }
                }
            });
        values
    }

    /// The middle of a block, and its distance from the block's corners.
    fn ball(&self, low: [usize; 3]) -> (Point3<f64>, f64) {
        let [a, b] = [0, BLOCK - 1].map(|step| self.grid.node(low.map(|i| i + step)));
        (nalgebra::center(&a, &b), 0.5 * (b - a).norm())
    }

    fn block(&self, low: [usize; 3], put: &mut dyn FnMut([usize; 3], f32)) {
        let (middle, radius) = self.ball(low);
        let distance = self.winding.tree().distance(&middle);
        let mut known = self.look(middle, distance);
        if distance > radius && known.is_settled() {
            let is_inside = known.winding > LEVEL;
            // No face passes through the block, so that the winding number is harmonic in it.
            let is_alike = known.reach >= radius
                || (0..8).all(|corner| {
                    let step = |axis: usize| (BLOCK - 1) * (corner >> axis & 1);
                    let node = [0, 1, 2].map(|axis| low[axis] + step(axis));
                    let there = self.look(self.grid.node(node), distance - radius);
                    there.is_settled() && (there.winding > LEVEL) == is_inside
                });
            if is_alike {
                let value = self.value(distance, known.winding);
                for_block(low, |node| put(node, value));
                return;
            }
        }
        for_block(low, |node| {
            let p = self.grid.node(node);
            let distance = self.winding.tree().distance(&p);
            if (p - known.at).norm() > known.reach {
                known = self.look(p, distance);
            }
            put(node, self.value(distance, known.winding));
        });
    }

    /// The winding number at a point with no face nearer than `distance`.
    fn look(&self, at: Point3<f64>, distance: f64) -> Known {
        let rough = Known {
            at,
            reach: REACH * distance,
            winding: self.winding.winding_number(&at, ROUGH),
        };
        if rough.is_settled() {
            return rough;
        }
        let fine = Known {
            winding: self.winding.winding_number(&at, ACCURACY),
            ..rough
        };
        Known {
            reach: if fine.is_settled() { fine.reach } else { 0.0 },
            ..fine
        }
    }

    fn value(&self, distance: f64, winding: f64) -> f32 {
        /// Grid cells over which the winding number runs, where it counts, from one side to the other.
        const CELLS: f64 = 8.0;
        let across = (LEVEL - winding).abs() * CELLS * self.grid.spacing.x;
        let distance = distance.min(across) as f32;
        if winding > LEVEL { -distance } else { distance }
    }
}

/// The nodes of a block, i fastest.
fn for_block(low: [usize; 3], mut each: impl FnMut([usize; 3])) {
    for k in low[2]..low[2] + BLOCK {
        for j in low[1]..low[1] + BLOCK {
            for i in low[0]..low[0] + BLOCK {
                each([i, j, k]);
            }
        }
    }
}
