//! Samples in the unit cube, and their averages over small cells.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// A sample of the surface, or several near each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    /// In the unit cube; of several, their mean.
    pub(super) position: [f64; 3],
    /// Sum of the unit normals.
    pub(super) normal: Vector3<f64>,
    /// How many samples this stands for.
    pub(super) count: f64,
    /// Area of the surface that it stands for, in the unit cube.
    pub(super) area: f64,
    /// The depth whose cells hold as many samples as asked for (not an integer).
    pub(super) spread: f64,
    /// The value that the function is drawn to at its position.
    pub(super) target: f64,
}

/// Where the unit cube lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cube {
    pub(super) lowest: Point3<f64>,
    /// Its side \[m\].
    pub(super) side: f64,
}

impl Cube {
    /// The cube `scale` times as large as the box around the points, about the same middle.
    pub(super) fn around(points: &[Point3<f64>], scale: f64) -> Self {
        let first = points.first().copied().unwrap_or_default();
        let (low, high) = (points.iter()).fold((first, first), |(l, h), p| (l.inf(p), h.sup(p)));
        let side = scale * (high - low).max();
        Self {
            lowest: nalgebra::center(&low, &high) - Vector3::repeat(0.5 * side),
            side,
        }
    }
    /// A point in coordinates of the cube.
    pub(super) fn inward(&self, p: &Point3<f64>) -> [f64; 3] {
        ((p - self.lowest) / self.side).into()
    }
    /// A point in coordinates of the world.
    pub(super) fn outward(&self, p: [f64; 3]) -> Point3<f64> {
        self.lowest + Vector3::from(p) * self.side
    }
}

/// Averages the samples in each cell of a level whose normals look into the same octant: opposite sides of a thin
/// wall stay apart. The result is sorted by the cells' z, y, x.
pub(super) fn merged(samples: &[Sample], depth: u32) -> Vec<Sample> {
    let cells = f64::from(1_u32 << depth);
    let mut order: Vec<(u64, u32)> = (samples.par_iter().enumerate())
        .map(|(index, sample)| {
            let [x, y, z] = sample.position.map(|x| (x * cells) as u64);
            let octant = (0..3).fold(0, |bits, axis| {
                bits << 1 | u64::from(sample.normal[axis] < 0.0)
            });
            ((((z << 16 | y) << 16 | x) << 3) | octant, index as u32)
        })
        .collect();
    order.par_sort_unstable();
    order
        .chunk_by(|a, b| a.0 == b.0)
        .map(|group| {
            let first = &samples[group[0].1 as usize];
            if group.len() == 1 {
                return *first;
            }
            let mut sum = Sample {
                position: [0.0; 3],
                normal: Vector3::zeros(),
                count: 0.0,
                area: 0.0,
                target: 0.0,
                ..*first
            };
            for &(_, index) in group {
                let one = &samples[index as usize];
                for axis in 0..3 {
                    sum.position[axis] += one.count * one.position[axis];
                }
                sum.normal += one.normal;
                sum.count += one.count;
                sum.area += one.area;
                sum.target += one.count * one.target;
                sum.spread = sum.spread.max(one.spread);
            }
            sum.target /= sum.count;
            for axis in 0..3 {
                let mean = sum.position[axis] / sum.count;
                // Rounding must not carry a mean over its cell's border.
                let stays = (mean * cells) as u64 == (first.position[axis] * cells) as u64;
                sum.position[axis] = if stays { mean } else { first.position[axis] };
            }
            sum
        })
        .collect()
}
